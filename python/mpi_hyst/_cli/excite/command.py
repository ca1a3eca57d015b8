"""The options of `mpi-hyst excite`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, limits, numbers, options, report
from mpi_hyst._cli.terminal import say


@click.command(short_help="Design the drives to identify a stage from.")
@options(
    limits(),
    click.option(
        "--slew",
        type=float,
        required=True,
        metavar="V/S",
        help="Largest slew rate, in units of the drive per second.",
    ),
    click.option(
        "--rate", type=float, required=True, metavar="HZ", help="Sampling rate of loops and rests."
    ),
    click.option(
        "--fast-rate",
        type=float,
        metavar="HZ",
        help="Sampling rate of the fast signal.  [default: that of the loops]",
    ),
    click.option(
        "--frequencies",
        **numbers("FIRST,SECOND"),
        help="Two frequencies of a full stroke (Hz). A slew rate that is too low for them lowers "
        "them.  [default: 1,10]",
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
        help="Rest drive: every file starts and ends there.  [default: 0 if within the limits]",
    ),
    click.option(
        "--rest",
        type=float,
        metavar="SECONDS",
        help="Duration of each of four rests, which tell creep.  [default: 10]",
    ),
    click.option(
        "--fast-signal",
        type=click.Choice(["chirp", "multisine"]),
        help="Small signal that tells modes and dead time.  [default: chirp]",
    ),
    click.option(
        "--fast-amplitude",
        type=float,
        metavar="V",
        help="Its largest amplitude. A lightly damped mode multiplies it. At high "
        "frequencies the slew rate may ask for less.  [default: 1 % of half the range]",
    ),
    click.option(
        "--fast-frequency",
        type=float,
        metavar="HZ",
        help="Its highest frequency.  [default: 0.4 of the Nyquist frequency]",
    ),
    click.option(
        "--demagnetize",
        is_flag=True,
        help="Write a sequence that demagnetizes the actuator: it ends in a known state.",
    ),
    click.option("--column", default="voltage_v", show_default=True, help="Column of the drive."),
    click.option(
        "-o",
        "--out",
        "out",
        required=True,
        type=FILE,
        help="Directory for the experiment: fast.csv, loops.csv, plan.html, plan.json. A name "
        "that ends in .csv: one file with all of it, at one rate.",
    ),
    report,
)
def excite(**given: Any) -> None:
    """Design an experiment to identify a stage, within limits and slew rate.

    fast.csv has a small chirp or multisine for the modes. loops.csv has full, decaying, growing
    and small loops, rests for creep, and loops at a second frequency. plan.html shows both and
    names the command for identification.
    """
    from mpi_hyst._cli.excite.request import Request
    from mpi_hyst._cli.excite.run import run

    say(run(Request(**given)))
