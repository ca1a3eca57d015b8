"""The command `mpi-hyst`: its entry point, which needs nothing but the base install to start."""

from __future__ import annotations

import sys
from importlib import import_module


def main() -> None:
    """Run the command line; a missing extra gives one line and exit status 2."""
    for extra in ("click", "tqdm"):
        try:
            import_module(extra)
        except ModuleNotFoundError:
            sys.stderr.write(
                f"mpi-hyst: error: the command line needs {extra}: pip install 'mpi_hyst[all]'\n"
            )
            sys.exit(2)
    from mpi_hyst._commands import commands

    commands.main(prog_name="mpi-hyst")


if __name__ == "__main__":
    main()
