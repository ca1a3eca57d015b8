"""The entry point of `mpi-hyst`. It needs no optional package to start."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import NoReturn

from mpi_hyst._cli.interrupts import NOTHING_WRITTEN, STATUS


def main() -> None:
    """Run the command line; a missing extra gives one line and exit status 2."""
    try:
        for extra in ("click", "tqdm"):
            try:
                import_module(extra)
            except ModuleNotFoundError:
                _end(f"the command line needs {extra}: pip install 'mpi_hyst[all]'", 2)
        from mpi_hyst._cli.commands import commands
    except KeyboardInterrupt:
        _end(NOTHING_WRITTEN, STATUS)
    commands.main(prog_name="mpi-hyst", ends_process=True)


def _end(message: str, status: int) -> NoReturn:
    if sys.stderr is not None:
        sys.stderr.write(f"mpi-hyst: error: {message}\n")
    sys.exit(status)


if __name__ == "__main__":
    main()
