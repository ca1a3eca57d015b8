"""What the command line says when it cannot do what was asked: one line that names the thing."""

from __future__ import annotations

import os

from mpi_hyst._text import printable

_LONGEST = 1000  # characters of a message: a hostile file may quote itself at any length


class CommandError(ValueError):
    """What was asked cannot be done; the message says in one line what is wrong and where."""


def one_line(error: BaseException) -> str:
    """Return the message of an error on one line, a file error with its file name first."""
    if isinstance(error, OSError) and error.strerror:
        where = f"{os.fsdecode(error.filename)}: " if error.filename is not None else ""
        return short_line(f"{where}{error.strerror}")
    return short_line(str(error))


def short_line(text: str) -> str:
    """Put a text on one line that a terminal can show, and cut it if it is very long."""
    line = printable(" ".join(text[: 2 * _LONGEST].split()))
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]} ..."
