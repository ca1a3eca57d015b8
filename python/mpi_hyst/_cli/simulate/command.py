"""The options of `mpi-hyst simulate`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, lead_in, limits, numbers, options, reference, report, stage
from mpi_hyst._cli.terminal import say


@click.command(short_help="Simulate control of a stage along a reference.")
@options(
    click.argument("stage_path", metavar="STAGE.json", type=FILE),
    click.argument("trajectory", metavar="REFERENCE.csv", type=FILE),
    limits("those of the stage, as far as its records reach"),
    click.option("-o", "result_path", type=FILE, help="Run to write (CSV)."),
    report,
    reference("reference"),
    lead_in("reference"),
    click.option(
        "--plant",
        "plant_path",
        type=FILE,
        metavar="OTHER.json",
        help="Stage or hysteresis that is simulated.  [default: STAGE.json]",
    ),
    stage,
    click.option(
        "--noise",
        type=float,
        metavar="RMS",
        help="Noise of the sensor, in the unit of the reference.  [default: that of the stage]",
    ),
    click.option(
        "--seed", type=int, default=0, show_default=True, help="Seed of the sensor noise."
    ),
    click.option(
        "--gains",
        **numbers("KP,KI"),
        help="Proportional gain (V/µm) and integral gain (V/µm/s).  [default: tuned]",
    ),
    click.option(
        "--feedforward",
        type=click.Choice(["preview", "inverse", "none"]),
        default="preview",
        show_default=True,
        help="preview: the reference passes through the inverse dynamics, then the exact inverse "
        "of the hysteresis. inverse: exact inverse of the hysteresis. none: feedback alone.",
    ),
)
def simulate(**given: Any) -> None:
    """Simulate a stage that follows a reference under feed-forward and feedback.

    STAGE.json is a stage or a model written by identify. The controller knows this stage, but not
    the noise, nor the stage given with --plant. Without --lead-in the reference should begin where
    the stage rests: else it begins with a jump, which counts in the errors.
    """
    from mpi_hyst._cli.simulate.run import Request, run

    say(run(Request.of(given)))
