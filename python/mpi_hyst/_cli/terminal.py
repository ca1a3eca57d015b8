"""Output of a command, and the check for optional packages."""

from __future__ import annotations

import click

from mpi_hyst._cli.errors import CommandError
from mpi_hyst._text import printable_lines


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
