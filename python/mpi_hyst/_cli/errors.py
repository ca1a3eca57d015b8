"""Errors of the command line: one line that names the file, column or option."""

from __future__ import annotations

import os

from mpi_hyst._text import printable

_LONGEST = 1000  # characters; a message may quote a file of any length


class CommandError(ValueError):
    """A request that cannot be carried out; the message says what is wrong and where."""


def one_line(error: BaseException) -> str:
    """Return the message of an error on one line; the file name comes first."""
    if isinstance(error, OSError) and error.strerror:
        where = f"{os.fsdecode(error.filename)}: " if error.filename is not None else ""
        return short_line(f"{where}{error.strerror}")
    return short_line(str(error))


def short_line(text: str) -> str:
    """Return the text on one line, without control characters, shortened if it is very long."""
    line = printable(" ".join(text[: 2 * _LONGEST].split()))
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]} ..."
