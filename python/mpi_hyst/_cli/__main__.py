"""The command line for `python -m mpi_hyst._cli`. It needs no optional package to start."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, NoReturn

from mpi_hyst_command.interrupted import NOTHING_WRITTEN, STATUS

if TYPE_CHECKING:
    import click


def main() -> None:
    """Run the command line. Ctrl-C before this module was imported is a traceback."""
    try:
        commands = imported()
    except KeyboardInterrupt:
        _end(NOTHING_WRITTEN, STATUS)
    commands.main(prog_name="mpi-hyst", ends_process=True)


def imported() -> click.Group:
    """Import the commands; a missing extra gives one line and exit status 2."""
    for extra in ("click", "tqdm"):
        try:
            import_module(extra)
        except ModuleNotFoundError:
            _end(f"the command line needs {extra}: pip install 'mpi_hyst[all]'", 2)
    from mpi_hyst._cli.commands import commands

    return commands


def _end(message: str, status: int) -> NoReturn:
    if sys.stderr is not None:
        sys.stderr.write(f"mpi-hyst: error: {message}\n")
    sys.exit(status)


if __name__ == "__main__":
    main()
