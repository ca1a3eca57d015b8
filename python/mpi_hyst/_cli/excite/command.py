"""The options of `mpi-hyst excite`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, numbers, options
from mpi_hyst._cli.terminal import say


@click.command(no_args_is_help=False)
@options(
    click.option(
        "--limits",
        required=True,
        **numbers("LOW,HIGH"),
        help="Limits of the drive (V), for example -500,500.",
    ),
    click.option("--rate", type=float, required=True, metavar="HZ", help="Samples per second."),
    click.option(
        "--slew", type=float, required=True, metavar="V/S", help="Largest speed of the drive."
    ),
    click.option(
        "--cycles",
        type=click.IntRange(min=1),
        default=20,
        show_default=True,
        help="Decaying cycles: one for each operator of the model to be fitted.",
    ),
    click.option(
        "--shape",
        type=click.Choice(["triangle", "sine"]),
        default="triangle",
        show_default=True,
        help="Straight moves, or half cosines without a jump of speed.",
    ),
    click.option(
        "--around", type=float, metavar="V", help="What the decay ends at.  [middle of the limits]"
    ),
    click.option(
        "--start", type=float, metavar="V", help="Where the drive starts and ends.  [zero if there]"
    ),
    click.option(
        "--demagnetize",
        is_flag=True,
        help="Write the sequence that brings the actuator from any history to rest instead.",
    ),
    click.option("--column", default="voltage_v", show_default=True, help="Column of the drive."),
    click.option(
        "-o", "--out", "drive_path", required=True, type=FILE, help="Drive to write (CSV)."
    ),
    click.option("--report", "report_path", type=FILE, help="Report to write (one HTML file)."),
)
def excite(**given: Any) -> None:
    """Design the drive to identify from, within limits and slew, or a demagnetising one.

    It visits both limits, which makes the memory known, then turns at reversals that decay.
    """
    from mpi_hyst._cli.excite.run import Request, run

    say(run(Request(**given)))
