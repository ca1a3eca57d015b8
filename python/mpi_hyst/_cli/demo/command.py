"""The options of `mpi-hyst demo`."""

from __future__ import annotations

from pathlib import Path

import click

from mpi_hyst._cli.options import directory as directory_option
from mpi_hyst._cli.terminal import say


@click.command(short_help="Identify a measured stack and a simulated actuator.")
@directory_option("mpi-hyst-demo", "the report, the models and the records")
def demo(directory: Path) -> None:
    """Fit a measured piezo stack, then the simulated actuator of the paper. Needs no data."""
    from mpi_hyst._cli.demo.run import run

    say(run(directory))
