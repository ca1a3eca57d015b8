"""The options of `mpi-hyst excite`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, limits, options, report
from mpi_hyst._cli.terminal import say


@click.command(short_help="Design a drive for identification.")
@options(
    limits(),
    click.option("--rate", type=float, required=True, metavar="HZ", help="Sampling rate."),
    click.option(
        "--slew",
        type=float,
        required=True,
        metavar="V/S",
        help="Largest slew rate, in units of the drive per second.",
    ),
    click.option(
        "--cycles",
        type=click.IntRange(min=1),
        default=20,
        show_default=True,
        help="Number of decaying cycles. Use one for each operator of the model to be fitted.",
    ),
    click.option(
        "--shape",
        type=click.Choice(["triangle", "sine"]),
        default="triangle",
        show_default=True,
        help="Straight lines between reversals, or half cosines, which have no steps in speed.",
    ),
    click.option(
        "--center",
        type=float,
        metavar="V",
        help="Drive at which the decaying cycles end.  [default: middle of the limits]",
    ),
    click.option(
        "--start",
        type=float,
        metavar="V",
        help="Drive at which the sequence starts and ends.  [default: 0 if within the limits]",
    ),
    click.option(
        "--demagnetize",
        is_flag=True,
        help="Write a sequence that demagnetizes the actuator: it ends in a known state.",
    ),
    click.option("--column", default="voltage_v", show_default=True, help="Column of the drive."),
    click.option(
        "-o", "--out", "drive_path", required=True, type=FILE, help="Drive to write (CSV)."
    ),
    report,
)
def excite(**given: Any) -> None:
    """Design a drive for identification or demagnetization, within limits and slew rate.

    A drive for identification first visits both limits, which erases the unknown history. Then it
    makes one full cycle and cycles of decreasing amplitude.
    """
    from mpi_hyst._cli.excite.run import Request, run

    say(run(Request(**given)))
