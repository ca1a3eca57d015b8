"""The options of `mpi-hyst identify`."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Literal

import click
from mpi_hyst_command import STATUS

from mpi_hyst._cli.options import (
    FILE,
    limits,
    numbers,
    options,
    report,
    slew,
    time_column,
    time_unit,
)
from mpi_hyst._cli.terminal import say

_MOST_OPERATORS = 100_000
_MOST_TERMS = 100
_MAPS = click.Choice(["auto", "none", "smooth"])
_STRETCH = re.compile(r"(?P<first>[0-9]{1,9}):(?P<end>[0-9]{1,9})")


def _operators(
    context: click.Context, option: click.Parameter, value: str | None
) -> int | Literal["auto"] | None:
    """Read a number of operators, or auto, or nothing."""
    if value is None:
        return None
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
    """Read the penalty on rough weights, or auto."""
    if value == "auto":
        return "auto"
    try:
        return float(value)
    except ValueError:
        message = f"expected auto or a number >= 0, got {value!r}"
        raise click.BadParameter(message, context, option) from None


def _number(context: click.Context, option: click.Parameter, value: str | None) -> int | str | None:
    """Read a small number, or a word."""
    del context, option
    return int(value) if value is not None and value.isdigit() else value


def _creep(context: click.Context, option: click.Parameter, value: str | None) -> int | str | None:
    """Read a number of terms, or a word."""
    if value is None or value in ("auto", "none", "log"):
        return value
    if not (
        value.isascii() and value.isdigit() and len(value) < 4 and 0 < int(value) < _MOST_TERMS
    ):
        message = (
            f"expected auto, none, log or a whole number from 1 to {_MOST_TERMS - 1}, got {value!r}"
        )
        raise click.BadParameter(message, context, option)
    return int(value)


def _number_or_word(
    what: str,
) -> Callable[[click.Context, click.Parameter, str | None], float | str | None]:
    """Return a reader of this number, or of auto and none."""

    def read(
        context: click.Context, option: click.Parameter, value: str | None
    ) -> float | str | None:
        if value is None or value in ("auto", "none"):
            return value
        try:
            return float(value)
        except ValueError:
            message = f"expected auto, none or {what}, got {value!r}"
            raise click.BadParameter(message, context, option) from None

    return read


def _stretches(
    context: click.Context, option: click.Parameter, values: tuple[str, ...]
) -> tuple[tuple[int, int], ...]:
    """Read stretches of rows, each as in 700:706."""
    found = []
    for value in values:
        match = _STRETCH.fullmatch(value)
        if match is None or int(match["first"]) >= int(match["end"]):
            message = f"expected rows FROM:TO, the first and the one behind the last, got {value!r}"
            raise click.BadParameter(message, context, option)
        found.append((int(match["first"]), int(match["end"])))
    return tuple(sorted(found))


@click.command()
@options(
    click.argument("data", nargs=-1, required=True, type=FILE),
    click.option(
        "--input",
        "input_column",
        required=True,
        help="Column of the drive, by name or number from 0.",
    ),
    click.option("--output", "output_column", required=True, help="Column of the position."),
    click.option("-o", "stage_path", type=FILE, help="Stage to write (JSON)."),
    report,
    click.option(
        "--skip",
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Leading part that initializes the model but is not fitted: 1000 (rows) or 5s. "
        "Once for all files, or once per file.",
    ),
    click.option(
        "--rows",
        multiple=True,
        type=click.IntRange(min=1),
        help="Number of rows to read. Once for all files, or once per file.  [default: all]",
    ),
    click.option(
        "--leave-out",
        multiple=True,
        metavar="FROM:TO",
        callback=_stretches,
        help="Rows whose position is not fitted, or is missing: 700:706 are rows 700 to 705, "
        "counted from 0. What is behind them has a zero of its own. Repeatable.",
    ),
    click.option(
        "--mend",
        multiple=True,
        metavar="FROM:TO",
        callback=_stretches,
        help="Rows whose drive was recorded wrong, or is missing: a straight line takes its place, "
        "and the position is not fitted. Repeatable.",
    ),
    time_column,
    time_unit,
    click.option(
        "--rate", type=float, metavar="HZ", help="Sampling rate, for files without a time column."
    ),
    click.option(
        "--input-unit",
        metavar="UNIT",
        help="Unit of the drive; nothing is converted.  [default: that in its name or in the file, "
        "else V]",
    ),
    click.option(
        "--output-unit",
        metavar="UNIT",
        help="Unit of the position, likewise.  [default: that in its name or in the file, else um]",
    ),
    click.option(
        "--negate-output",
        is_flag=True,
        help="Turn the sign of the position, in all files: for a sensor that counts the other way.",
    ),
    click.option(
        "--validate",
        multiple=True,
        type=FILE,
        metavar="FILE",
        help="Record for validation, with the same columns: predicted, not fitted. Repeatable.",
    ),
    click.option(
        "--validate-skip",
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Leading part of the --validate files that initializes the model but counts in no "
        "error.",
    ),
    click.option(
        "--validate-from",
        multiple=True,
        metavar="ROWS|SECONDSs",
        help="Reserve each file from here to its end for validation. Once for all files, or once "
        "per file.",
    ),
    click.option(
        "--model",
        type=click.Choice(["modified", "conventional"]),
        default="modified",
        show_default=True,
        help="Model of coupled plays, or of plays.",
    ),
    click.option(
        "--operators",
        metavar="NUMBER|auto",
        show_default="20, or 40 or 80 where these predict better",
        callback=_operators,
        help="Number of operators. auto: the smallest of 4 to 80 whose cross-validation error is "
        "as good as the best.",
    ),
    click.option(
        "--weights",
        type=click.Choice(["auto", "free", "quadratic", "split"]),
        default="auto",
        show_default=True,
        help="Law of the weights. free: each w >= 0. quadratic: four parameters. split: other "
        "weights below zero than above. auto: the simplest whose cross-validation error is as "
        "good as the best.",
    ),
    click.option(
        "--smoothness",
        metavar="NUMBER|auto",
        default="auto",
        show_default=True,
        callback=_smoothness,
        help="Penalty on second differences of the weights. auto: by cross-validation.",
    ),
    click.option(
        "--loss",
        type=click.Choice(["auto", "squares", "robust"]),
        help="What glitches of the position do to the fit. auto: samples that lie far from those "
        "about them, up to 25 in a row, are left out. squares: all samples count. robust: nearer "
        "ones are left out, too.  [default: auto]",
    ),
    click.option(
        "--thresholds",
        type=click.Choice(["uniform", "quantiles", "geometric"]),
        default="uniform",
        show_default=True,
        help="Thresholds at equal distances, at quantiles of the reversals of the drive, or "
        "growing by a constant factor from a hundredth of the range on: more operators "
        "for small loops.",
    ),
    click.option(
        "--ratios", **numbers("RA,RB,RC"), help="Ratios ra/r, rb/r, rc/r.  [default: fitted]"
    ),
    click.option(
        "--input-offset", type=float, help="Drive at which the model rests.  [default: fitted]"
    ),
    click.option(
        "--dead-time",
        type=float,
        metavar="SECONDS",
        help="Time that the position is behind hysteresis and dynamics.  [default: fitted]",
    ),
    click.option(
        "--dynamics",
        type=click.Choice(["auto", "none", "1", "2"]),
        callback=_number,
        help="Linear dynamics of this order. auto: second order, or first in the place of an "
        "overdamped one that is not told from it, if the records tell them.  [default: auto]",
    ),
    click.option(
        "--modes",
        type=click.Choice(["auto", "1", "2", "3"]),
        callback=_number,
        help="Number of modes in parallel of second-order dynamics. auto: as many as the records "
        "tell.  [default: auto]",
    ),
    click.option(
        "--creep",
        metavar="TERMS|log|auto|none",
        callback=_creep,
        help="Creep: log-type, or so many terms a decade apart. auto: log-type, if "
        "cross-validation asks for it.  [default: auto]",
    ),
    click.option(
        "--loop-shift",
        metavar="SECONDS|auto|none",
        callback=_number_or_word("a time constant in seconds"),
        help="Movement of the centre of a loop with its amplitude, with this time constant. auto: "
        "if cross-validation asks for it.  [default: auto]",
    ),
    click.option(
        "--amplifier",
        metavar="HZ|auto|none",
        callback=_number_or_word("a bandwidth in Hz"),
        help="Amplifier of this bandwidth in front of the hysteresis. auto: one that is fitted, if "
        "the records tell its lag from a dead time.  [default: auto]",
    ),
    click.option(
        "--input-map",
        type=_MAPS,
        help="Smooth map of the drive in front of the hysteresis. auto: if cross-validation asks "
        "for it.  [default: auto]",
    ),
    click.option(
        "--output-map",
        type=_MAPS,
        help="Smooth map of the position behind the hysteresis. auto: if cross-validation asks for "
        "it; see the finding map_not_told.  [default: auto]",
    ),
    click.option(
        "--compare",
        is_flag=True,
        help="Compare models: conventional, polynomial + plays, modified, and modified with each "
        "extension. Each is judged on held-out stretches of the fitted rows; the table and the "
        "report show what each buys.",
    ),
    limits("none"),
    slew("none"),
    click.option(
        "--keep-partial",
        is_flag=True,
        help="On Ctrl-C write the best fit so far, marked as partial.",
    ),
    click.option(
        "--strict",
        is_flag=True,
        help="Exit with status 1 if the verdict is amber or red. The files are written all the "
        "same.",
    ),
)
def identify(**given: Any) -> int:
    """Fit a stage to measured records in files: CSV, MATLAB, HDF5, and others; see `look`.

    The stage is written with -o: hysteresis, maps, dead time, dynamics, amplifier, creep and loop
    shift as far as the records tell them, and the limits and slew rate of its drive if they are
    given. A record must start from rest, or its start must be skipped with --skip. The first line
    is the verdict on the result: green, amber or red. Ctrl-C writes no files unless --keep-partial
    is given; the exit status is 130.
    """
    from mpi_hyst._cli.identify.request import Request
    from mpi_hyst._cli.identify.run import run

    done = run(Request.of(given))
    say(done.text)
    if done.interrupted:
        click.echo("mpi-hyst: interrupted, the partial result is written", err=True)
        return STATUS
    if given["strict"] and done.verdict != "green":
        click.echo(f"mpi-hyst: --strict: the verdict is {done.verdict}", err=True)
        return 1
    return 0
