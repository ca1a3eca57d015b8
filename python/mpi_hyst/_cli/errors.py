"""Errors and notes of the command line: one line that names the file, column or option.

A message of the library begins with the place: "record 1: u[3]: expected ...". The error carries
the name of the argument as `parameter`. The command line names a file, column or option instead.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping

import click

from mpi_hyst._text import printable

_RECORD = re.compile(r"record (\d+): ")
_MENTIONED = re.compile(r"`(\w+)`")
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


def note(text: str) -> None:
    """Say on standard error what the user should know; the command goes on."""
    click.echo(f"mpi-hyst: note: {short_line(text)}", err=True)


def parameter(error: BaseException | str) -> str:
    """Return the name of the argument that the library refuses; empty if it names none.

    A warning carries no name, but its message begins with it too.
    """
    if isinstance(error, (Warning, str)):
        return str(error).partition(":")[0].partition("[")[0]
    return str(getattr(error, "parameter", ""))


def renamed(message: str, argument: str, shown: str) -> str:
    """Put `shown` in place of the argument that a message begins with.

    An index counts samples of a file or column; an option of two numbers is named without it.
    """
    place, colon, rest = message.partition(":")
    name, _, index = place.partition("[")
    if name != argument:
        return message
    sample = f", sample {index.rstrip(']')}" if index and not shown.startswith("-") else ""
    return f"{shown}{sample}{colon}{rest}"


def with_options(message: str, argument: str, names: Mapping[str, str]) -> str:
    """Put files and options in place of arguments, as `names` has them.

    The message begins with `argument`; others that it mentions stand in backticks.
    """
    message = renamed(message, argument, names.get(argument, argument))
    return _MENTIONED.sub(lambda found: names.get(found[1], found[0]), message)


def without_record(message: str) -> tuple[int | None, str]:
    """Split off the number of the record that a message begins with, if there is one."""
    found = _RECORD.match(message)
    return (None, message) if found is None else (int(found[1]), message[found.end() :])
