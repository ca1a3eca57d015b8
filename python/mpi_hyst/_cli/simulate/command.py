"""The options of `mpi-hyst simulate`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, limits, numbers, options, reference, report, stage
from mpi_hyst._cli.terminal import say


@click.command(short_help="Simulate control of a stage along a reference.")
@options(
    click.argument("model_path", metavar="MODEL.json", type=FILE),
    click.argument("trajectory", metavar="REFERENCE.csv", type=FILE),
    limits(required=True),
    click.option("-o", "result_path", type=FILE, help="Run to write (CSV)."),
    report,
    reference("reference"),
    click.option(
        "--plant",
        "plant_path",
        type=FILE,
        metavar="ACTUATOR.json",
        help="Hysteresis of the simulated stage.  [default: MODEL.json]",
    ),
    stage,
    click.option(
        "--noise",
        type=float,
        default=0.0,
        show_default=True,
        metavar="RMS",
        help="Noise of the sensor, in the unit of the reference.",
    ),
    click.option(
        "--seed", type=int, default=0, show_default=True, help="Seed of the sensor noise."
    ),
    click.option(
        "--gains",
        **numbers("KP,KI"),
        help="Proportional and integral gain of the feedback.  [default: tuned]",
    ),
    click.option(
        "--feedforward",
        type=click.Choice(["inverse", "none"]),
        default="inverse",
        show_default=True,
        help="Exact inverse of MODEL.json, or feedback alone.",
    ),
    click.option(
        "--preview/--no-preview",
        default=True,
        show_default=True,
        help="Pass the reference through the inverse dynamics.",
    ),
)
def simulate(**given: Any) -> None:
    """Simulate a stage that follows a reference under feed-forward and feedback.

    The controller knows the dynamics, the amplifier bandwidth and the dead time of the stage. It
    does not know the noise, nor the hysteresis given with --plant.
    """
    from mpi_hyst._cli.simulate.run import Request, run

    say(run(Request.of(given)))
