"""The options of `mpi-hyst export`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, limits, numbers, options, stage
from mpi_hyst._cli.terminal import say


@click.command(short_help="Write a stage for other tools: FMU, C, bytes.")
@options(
    click.argument("stage_path", metavar="STAGE.json", type=FILE),
    click.option("--fmu", "fmu", is_flag=True, help="Functional mock-up unit (FMI 2.0)."),
    click.option("--c", "c", is_flag=True, help="Header of constants for C and C++."),
    click.option(
        "--bytes", "as_bytes", is_flag=True, help="The stage as bytes, for the C library."
    ),
    click.option(
        "-o", "result_path", type=FILE, help="File to write.  [default: STAGE.fmu, .h or .bin]"
    ),
    click.option(
        "--kind",
        type=click.Choice(["forward", "inverse", "controller"]),
        help="What the unit runs.  [default: forward]",
    ),
    click.option("--dt", type=float, metavar="SECONDS", help="Sampling interval of unit or gains."),
    click.option("--rate", type=float, metavar="HZ", help="The same as samples per second."),
    click.option(
        "--feedforward",
        type=click.Choice(["inverse", "preview"]),
        help="Of a controller.  [default: inverse]",
    ),
    click.option(
        "--gains",
        **numbers("KP,KI"),
        help="Proportional gain (V/µm) and integral gain (V/µm/s) of a controller.  "
        "[default: tuned]",
    ),
    click.option("--name", help="What the unit is called, or names in C begin with."),
    limits("those of the stage"),
    stage,
)
def export(**given: Any) -> None:
    """Write a stage for other tools.

    A functional mock-up unit runs in tools of co-simulation and needs --dt or --rate. A header has
    the constants of the stage for C and C++, with --dt also tuned gains and filters, and the stage
    as bytes.
    """
    from mpi_hyst._cli.export.run import Request, run

    say(run(Request.of(given)))
