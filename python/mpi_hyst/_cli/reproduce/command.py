"""The options of `mpi-hyst reproduce`."""

from __future__ import annotations

from pathlib import Path

import click

from mpi_hyst._cli.options import directory as directory_option
from mpi_hyst._cli.terminal import say


@click.command(short_help="Recompute the tables and figures of the paper.")
@directory_option("mpi-hyst-reproduce", "the report and results.json")
@click.option("--quick", is_flag=True, help="Use 3 noise seeds instead of 10.")
def reproduce(directory: Path, quick: bool) -> None:
    """Recompute the tables and figures of the paper, and compare further control schemes.

    Needs no data.
    """
    from mpi_hyst._cli.reproduce.run import run

    say(run(directory, quick=quick))
