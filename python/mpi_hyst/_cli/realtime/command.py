"""The options of `mpi-hyst realtime`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, numbers, options, slew


def _priority(context: click.Context, option: click.Parameter, value: str | None) -> int | None:
    """Read a priority, which must not be taken for the name of the file behind it."""
    if value is None:
        return None
    try:
        return int(value)
    except ValueError:
        message = f"expected a priority from 1 to 99, got {value!r}; "
        message += "without one put --fifo behind STAGE.json"
        raise click.BadParameter(message, context, option) from None


@click.command(short_help="Run the loop of a stage in real time.")
@options(
    click.argument("stage_path", metavar="STAGE.json", type=FILE),
    click.option(
        "--rate", type=float, default=10_000.0, show_default=True, help="Samples per second."
    ),
    click.option(
        "--seconds",
        type=float,
        default=10.0,
        show_default=True,
        help="When it goes to rest. Ctrl-C, SIGTERM and SIGHUP do the same.",
    ),
    click.option(
        "--reference",
        type=FILE,
        metavar="FILE.csv",
        help="Positions, one for each sample, followed again and again. A time column must fit "
        "--rate.  [default: a sine of 10 Hz over half of what the stage reaches]",
    ),
    click.option("--column", help="Column of the reference.  [default: the only numeric one]"),
    click.option(
        "--udp",
        metavar="HOST:PORT",
        help="Plant that talks in datagrams; needs --local.  [default: a simulated plant]",
    ),
    click.option("--local", metavar="HOST:PORT", help="Where its measurements come in."),
    click.option(
        "--shared-memory", type=FILE, metavar="FILE", help="Memory that the plant maps too."
    ),
    click.option(
        "--rest", type=float, metavar="V", help="Drive at the end.  [default: 0, or nearest to it]"
    ),
    click.option(
        "--rest-rate",
        type=float,
        metavar="V/s",
        help="How fast it goes there.  [default: the range of the drive in half a second]",
    ),
    click.option(
        "--misses",
        type=click.Choice(["skip", "catch_up", "stop"]),
        default="skip",
        show_default=True,
        help="What becomes of missed deadlines.",
    ),
    click.option(
        "--watchdog",
        **numbers("STALE,REST"),
        help="Seconds without a measurement until the drive is held, and until it goes to rest.  "
        "[default: 0,0.1]",
    ),
    click.option(
        "--spin",
        type=float,
        default=0.0,
        metavar="SECONDS",
        help="How long to spin before each deadline instead of sleeping.  [default: 0]",
    ),
    click.option("--cpu", type=int, help="Processor on which the loop runs."),
    click.option(
        "--fifo",
        is_flag=False,
        flag_value="80",
        metavar="PRIORITY",
        callback=_priority,
        help="SCHED_FIFO, with this priority or 80.",
    ),
    click.option("--mlock", is_flag=True, help="Keep all memory in memory."),
    slew("that of the stage, and no more"),
    click.option("-o", "record_path", type=FILE, help="Record to write (npy)."),
    click.option("--json", "json_path", type=FILE, help="Report to write (JSON)."),
    click.option("--plot", "plot_path", type=FILE, help="Histograms to draw (PNG, SVG or PDF)."),
)
def realtime(**given: Any) -> None:
    """Run the loop of a stage in real time, and show how late and how long its samples were.

    STAGE.json is a stage with limits, written by identify. The loop ends by a ramp to the rest
    drive within the slew rate: after --seconds, at Ctrl-C, and when measurements are missing.

    The exit status is 0 if it ended as it was asked to, and 3 if the watchdog, a missed deadline or
    input and output ended it, if the drive is not at rest or the other side of UDP says that nobody
    listens, or if rows of the record are missing.
    """
    from mpi_hyst._cli.realtime.run import Request, run

    click.get_current_context().exit(run(Request(**given)))
