"""The options of `mpi-hyst identify`."""

from __future__ import annotations

from typing import Any, Literal

import click

from mpi_hyst._cli.interrupts import STATUS
from mpi_hyst._cli.options import FILE, numbers, options
from mpi_hyst._cli.terminal import say

_MOST_OPERATORS = 100_000


def _operators(
    context: click.Context, option: click.Parameter, value: str
) -> int | Literal["auto"]:
    """Read a number of operators, or auto."""
    if value == "auto":
        return "auto"
    short = value.isascii() and value.isdigit() and len(value) < 10
    number = int(value) if short else 0
    if not 1 <= number <= _MOST_OPERATORS:
        message = f"expected auto or a whole number from 1 to {_MOST_OPERATORS}, got {value!r}"
        raise click.BadParameter(message, context, option)
    return number


def _smoothness(
    context: click.Context, option: click.Parameter, value: str
) -> float | Literal["auto"]:
    """Read how smooth the weights are to be, or auto."""
    if value == "auto":
        return "auto"
    try:
        return float(value)
    except ValueError:
        message = f"expected auto or a number >= 0, got {value!r}"
        raise click.BadParameter(message, context, option) from None


@click.command(no_args_is_help=False)
@options(
    click.argument("data", nargs=-1, required=True, type=FILE),
    click.option("--input", "input_column", required=True, help="Column of the drive."),
    click.option("--output", "output_column", required=True, help="Column of the displacement."),
    click.option("-o", "model_path", type=FILE, help="Model file to write (JSON)."),
    click.option("--report", "report_path", type=FILE, help="Report to write (one HTML file)."),
    click.option(
        "--skip",
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Leading part that sets the memory but is not fitted: 1000 (rows) or 5s. "
        "Once for all files, or once per file.",
    ),
    click.option(
        "--rows",
        multiple=True,
        type=click.IntRange(min=1),
        help="Read only so many rows. Once for all files, or once per file.",
    ),
    click.option("--time", help="Column of the time.  [default: time_s or time, if there]"),
    click.option(
        "--validate",
        multiple=True,
        type=FILE,
        metavar="FILE",
        help="Record with the same columns that is not fitted but predicted. May be repeated.",
    ),
    click.option(
        "--validate-skip",
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Leading part of the --validate files that sets the memory but is not judged.",
    ),
    click.option(
        "--validate-from",
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Do not fit but predict each file from there on. Once for all files, or once per "
        "file.",
    ),
    click.option(
        "--model",
        type=click.Choice(["modified", "conventional"]),
        default="modified",
        show_default=True,
        help="Coupled plays, or plays for comparison.",
    ),
    click.option(
        "--operators",
        metavar="NUMBER|auto",
        default="20",
        show_default=True,
        callback=_operators,
        help="How many; auto: as few as predict held-out stretches of the records about as well.",
    ),
    click.option(
        "--weights",
        type=click.Choice(["auto", "free", "quadratic", "split"]),
        default="auto",
        show_default=True,
        help="Any w >= 0, four numbers, or other weights below zero than above; auto: the simplest "
        "that predicts held-out stretches of the records as well as any.",
    ),
    click.option(
        "--smoothness",
        metavar="NUMBER|auto",
        default="0",
        show_default=True,
        callback=_smoothness,
        help="How much second differences of the weights cost; auto: what predicts held-out "
        "stretches best.",
    ),
    click.option(
        "--thresholds",
        type=click.Choice(["uniform", "quantiles"]),
        default="uniform",
        show_default=True,
        help="Evenly spaced, or where the drive turns round.",
    ),
    click.option("--ratios", **numbers("RA,RB,RC"), help="Thresholds ra, rb, rc over r.  [fitted]"),
    click.option("--input-offset", type=float, help="Where the model's zero lies.  [fitted]"),
    click.option("--delay", type=float, help="Samples by which the output lags.  [fitted]"),
    click.option(
        "--keep-partial",
        is_flag=True,
        help="On Ctrl-C write the best so far, marked as partial, instead of nothing.",
    ),
)
def identify(**given: Any) -> int:
    """Fit a model to measured records in CSV files.

    Each record starts from rest, or has its unknown start left out by --skip.
    Exit status 130 after Ctrl-C, with or without --keep-partial.
    """
    from mpi_hyst._cli.identify.request import Request
    from mpi_hyst._cli.identify.run import run

    text, interrupted = run(Request(**given))
    say(text)
    if interrupted:
        click.echo("mpi-hyst: interrupted, what was found until then is kept", err=True)
    return STATUS if interrupted else 0
