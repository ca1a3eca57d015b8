"""The options of `mpi-hyst precompensate`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, lead_in, limits, numbers, options, reference, stage
from mpi_hyst._cli.terminal import say


@click.command()
@options(
    click.argument("stage_path", metavar="STAGE.json", type=FILE),
    click.argument("trajectory", metavar="TRAJECTORY.csv", type=FILE),
    click.option(
        "-o",
        "drive_path",
        required=True,
        type=FILE,
        help="Drive to write (CSV), with columns such as time_s and drive.",
    ),
    reference("trajectory"),
    limits("those of the stage, as far as its records reach"),
    click.option(
        "--start",
        type=float,
        metavar="V",
        help="Drive at which the stage has rested, virgin but for the way there.  "
        "[default: 0, or the limit nearest to it]",
    ),
    click.option(
        "--history",
        **numbers("V,V,..."),
        help="Drives since that rest, oldest first: 0,150,0 after a full stroke from 0 to 150 V.",
    ),
    lead_in("trajectory"),
    stage,
)
def precompensate(**given: Any) -> None:
    """Compute the drive for which a stage follows a trajectory.

    STAGE.json is a stage or a model written by identify. Dynamics, creep and dead time of the
    stage are inverted, then the hysteresis, exactly. Without --lead-in the trajectory must begin
    where the stage is: at rest and virgin, unless --history says how it was driven before.
    """
    from mpi_hyst._cli.precompensate.run import Request, run

    say(run(Request.of(given)))
