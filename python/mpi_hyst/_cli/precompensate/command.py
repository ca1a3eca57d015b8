"""The options of `mpi-hyst precompensate`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, limits, options, reference, stage
from mpi_hyst._cli.terminal import say


@click.command()
@options(
    click.argument("model_path", metavar="MODEL.json", type=FILE),
    click.argument("trajectory", metavar="TRAJECTORY.csv", type=FILE),
    click.option("-o", "drive_path", required=True, type=FILE, help="Drive to write (CSV)."),
    reference("trajectory"),
    limits(),
    stage,
)
def precompensate(**given: Any) -> None:
    """Compute the drive for which the model follows a trajectory.

    The hysteresis is inverted exactly, sample by sample. Dynamics, amplifier bandwidth and dead
    time are inverted as well if they are given.
    """
    from mpi_hyst._cli.precompensate.run import Request, run

    say(run(Request.of(given)))
