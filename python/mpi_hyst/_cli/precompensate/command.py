"""The options of `mpi-hyst precompensate`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, numbers, options
from mpi_hyst._cli.terminal import say


@click.command(no_args_is_help=False)
@options(
    click.argument("model_path", metavar="MODEL.json", type=FILE),
    click.argument("trajectory", metavar="TRAJECTORY.csv", type=FILE),
    click.option("-o", "drive_path", required=True, type=FILE, help="Drive to write (CSV)."),
    click.option("--column", help="Column of the target.  [default: the only numeric one]"),
    click.option("--time", help="Column of the time.  [default: time_s or time, if there]"),
    click.option(
        "--limits", **numbers("LOW,HIGH"), help="Limits of the drive, for example -500,500."
    ),
    click.option(
        "--dynamics",
        **numbers("FREQ,DAMPING"),
        help="Natural frequency (Hz) and damping ratio of the stage, for example 400,0.95.",
    ),
    click.option("--delay", type=float, help="Samples of dead time besides the hold."),
    click.option("--amplifier-bandwidth", type=float, metavar="HZ", help="Cut-off of the amplifier."),
)
def precompensate(**given: Any) -> None:
    """Compute the drive that makes the model follow a trajectory: the exact inverse.

    With dynamics, delay or an amplifier it is led through their inverse too.
    """
    from mpi_hyst._cli.precompensate.run import Request, run

    say(run(Request(**given)))
