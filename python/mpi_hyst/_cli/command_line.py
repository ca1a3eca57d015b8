"""The command line as it was given, for the reports."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import click

_KEY = "mpi_hyst.arguments"


def keep(context: click.Context, arguments: Sequence[str]) -> None:
    """Keep the arguments of this run."""
    context.meta[_KEY] = list(arguments)


def command_line() -> str | None:
    """Return the command as one would type it, or None where there is none."""
    context = click.get_current_context(silent=True)
    if context is None or _KEY not in context.meta:
        return None
    return shlex.join(["mpi-hyst", *context.meta[_KEY]])
