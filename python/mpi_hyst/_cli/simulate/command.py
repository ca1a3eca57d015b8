"""The options of `mpi-hyst track`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, numbers, options
from mpi_hyst._cli.terminal import say


@click.command(no_args_is_help=False)
@options(
    click.argument("model_path", metavar="MODEL.json", type=FILE),
    click.argument("trajectory", metavar="REFERENCE.csv", type=FILE),
    click.option(
        "--limits",
        required=True,
        **numbers("LOW,HIGH"),
        help="Limits of the drive, for example -500,500.",
    ),
    click.option("-o", "result_path", type=FILE, help="Run to write (CSV)."),
    click.option("--report", "report_path", type=FILE, help="Report to write (one HTML file)."),
    click.option("--column", help="Column of the reference.  [default: the only numeric one]"),
    click.option("--time", help="Column of the time.  [default: time_s or time, if there]"),
    click.option("--rate", type=float, metavar="HZ", help="Samples per second, without a time."),
    click.option(
        "--plant",
        "plant_path",
        type=FILE,
        metavar="ACTUATOR.json",
        help="What is simulated, if not MODEL.json itself.",
    ),
    click.option(
        "--dynamics",
        **numbers("FREQ,DAMPING"),
        help="Natural frequency (Hz) and damping ratio of the stage, for example 400,0.95.",
    ),
    click.option("--amplifier-bandwidth", type=float, metavar="HZ", help="Cut-off of the amplifier."),
    click.option(
        "--delay",
        type=float,
        default=0.0,
        show_default=True,
        help="Samples of dead time besides the hold.",
    ),
    click.option(
        "--noise",
        type=float,
        default=0.0,
        show_default=True,
        metavar="RMS",
        help="Of the sensor, in the unit of the reference.",
    ),
    click.option("--seed", type=int, default=0, show_default=True, help="Of the noise."),
    click.option("--gains", **numbers("KP,KI"), help="Of the feedback.  [tuned]"),
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
        help="Lead the reference through inverse dynamics.",
    ),
)
def track(**given: Any) -> None:
    """Let a simulated stage follow a reference with feed-forward and feedback.

    The options say what the stage is; the controller knows all of it but the noise and --plant.
    """
    from mpi_hyst._cli.simulate.run import Request, run

    say(run(Request(**given)))
