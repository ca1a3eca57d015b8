"""What a command says: its text, notes, errors on one line, progress, and how it was typed.

A message of the library begins with the place: "record 1: u[3]: expected ...". The error carries
the name of the argument as `parameter`. The command line names a file, column or option instead.
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import count
from typing import NoReturn

import click
from tqdm import tqdm

from mpi_hyst._progress import FORM
from mpi_hyst._text import in_unit, printable, printable_lines

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


def say(text: str) -> None:
    """Write to standard output, with control characters of names escaped."""
    click.echo(printable_lines(text))


def require_report_packages(what: str) -> None:
    """Refuse `what` before the work if the packages for reports are not installed."""
    try:
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401
    except ModuleNotFoundError as error:
        raise CommandError(f"{what} needs {error.name}: pip install 'mpi_hyst[all]'") from error


Progress = Callable[[float, float], None]


def _bar(what: str) -> tqdm[NoReturn]:
    # None: shown only on a terminal. Standard error may be closed.
    disable = True if sys.stderr is None else None
    return tqdm(
        total=1.0, desc=what, bar_format=FORM, file=sys.stderr, leave=False, disable=disable
    )


@contextmanager
def progress_bar(what: str, unit: str = "") -> Iterator[Progress]:
    """Show the fraction done and the best error so far."""
    with _bar(what) as bar:

        def show(fraction: float, best_rmse: float) -> None:
            bar.set_postfix_str(f"best rms {in_unit(best_rmse, unit, 3)}", refresh=False)
            bar.update(fraction - bar.n)

        yield show


@contextmanager
def fraction_bar(what: str) -> Iterator[Callable[[float], None]]:
    """Show the fraction done."""
    with _bar(what) as bar:

        def show(fraction: float) -> None:
            bar.update(fraction - bar.n)

        yield show


@contextmanager
def step_bar(what: str, steps: int) -> Iterator[Callable[[], None]]:
    """Show the fraction of steps done."""
    done = count(1)
    with fraction_bar(what) as show:
        yield lambda: show(next(done) / steps)


_KEY = "mpi_hyst.arguments"


def keep_arguments(context: click.Context, arguments: Sequence[str]) -> None:
    """Keep the arguments of this run."""
    context.meta[_KEY] = list(arguments)


def command_line() -> str | None:
    """Return the command as one would type it, or None where there is none."""
    context = click.get_current_context(silent=True)
    if context is None or _KEY not in context.meta:
        return None
    return shlex.join(["mpi-hyst", *context.meta[_KEY]])
