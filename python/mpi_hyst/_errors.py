"""What the command line says when it cannot do what was asked: one line that names the thing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class CommandError(ValueError):
    """What was asked cannot be done; the message says in one line what is wrong and where."""


@contextmanager
def refusals(subject: str = "") -> Iterator[None]:
    """Turn what the library refuses into a CommandError that begins with `subject`."""
    try:
        yield
    except CommandError:
        raise
    except (ValueError, TypeError) as error:
        raise CommandError(f"{subject}: {error}" if subject else str(error)) from error


def one_line(error: BaseException) -> str:
    """Return the message of an error on one line, a file error with its file name first."""
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename is not None else ""
        return f"{where}{error.strerror}"
    return " ".join(str(error).split())
