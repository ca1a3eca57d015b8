"""The commands with their options; what they do is in _identify, _precompensate and so on."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeVar

import click

from mpi_hyst._errors import CommandError, one_line

_INTERRUPTED = 130
_WRONG = 2
_MOST_OPERATORS = 100_000

_File = click.Path(path_type=Path)
_Function = TypeVar("_Function", bound=Callable[..., object])


class _Commands(click.Group):
    """A group whose every error is one line on standard error and exit status 2."""

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        *_: Any,
        **extra: Any,
    ) -> NoReturn:
        extra["standalone_mode"] = False
        try:
            status = super().main(args, prog_name, **extra)
        except click.Abort:
            _end("interrupted, nothing written", _INTERRUPTED)
        except click.ClickException as error:
            _end(" ".join(error.format_message().split()), _WRONG)
        except (CommandError, OSError) as error:
            _end(one_line(error), _WRONG)
        sys.exit(status if isinstance(status, int) else 0)


def _end(message: str, status: int) -> NoReturn:
    with suppress(OSError):
        click.echo(f"mpi-hyst: error: {message}", err=True)
    sys.exit(status)


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="mpi_hyst", prog_name="mpi-hyst")
@click.pass_context
def commands(context: click.Context) -> None:
    """Piezo hysteresis: identify a model from records, compensate with its exact inverse."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def _numbers(names: str) -> dict[str, Any]:
    """Make an option of several numbers with commas between them."""
    count = len(names.split(","))

    def convert(
        context: click.Context, option: click.Parameter, value: str | None
    ) -> tuple[float, ...] | None:
        if value is None:
            return None
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != count:
            message = f"expected {names}, {count} numbers, got {value!r}"
            raise click.BadParameter(message, context, option)
        return numbers

    return {"metavar": names, "callback": convert}


def _operators(
    context: click.Context, option: click.Parameter, value: str
) -> int | Literal["auto"]:
    """Read a number of operators, or auto."""
    if value == "auto":
        return "auto"
    number = int(value) if value.isascii() and value.isdigit() else 0
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


def _options(*options: Callable[[_Function], _Function]) -> Callable[[_Function], _Function]:
    def decorate(function: _Function) -> _Function:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


@commands.command(no_args_is_help=False)
@_options(
    click.argument("data", nargs=-1, required=True, type=_File),
    click.option("--input", "input_column", required=True, help="Column of the drive."),
    click.option("--output", "output_column", required=True, help="Column of the displacement."),
    click.option("-o", "model_path", type=_File, help="Model file to write (JSON)."),
    click.option("--report", "report_path", type=_File, help="Report to write (one HTML file)."),
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
        type=_File,
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
    click.option(
        "--ratios", **_numbers("RA,RB,RC"), help="Thresholds ra, rb, rc over r.  [fitted]"
    ),
    click.option("--input-offset", type=float, help="Where the model's zero lies.  [fitted]"),
    click.option("--delay", type=float, help="Samples by which the output lags.  [fitted]"),
    click.option(
        "--keep-partial",
        is_flag=True,
        help="On Ctrl-C write the best so far, marked as partial, instead of nothing.",
    ),
)
def identify(**options: Any) -> int:
    """Fit a model to measured records in CSV files.

    Each record starts from rest, or has its unknown start left out by --skip.
    Exit status 130 after Ctrl-C, with or without --keep-partial.
    """
    from mpi_hyst import _identify
    from mpi_hyst._identify_request import Request

    text, interrupted = _identify.run(Request(**options))
    click.echo(text)
    if interrupted:
        click.echo("mpi-hyst: interrupted, what was found until then is kept", err=True)
    return _INTERRUPTED if interrupted else 0


@commands.command(no_args_is_help=False)
@_options(
    click.argument("model_path", metavar="MODEL.json", type=_File),
    click.argument("trajectory", metavar="TRAJECTORY.csv", type=_File),
    click.option("-o", "drive_path", required=True, type=_File, help="Drive to write (CSV)."),
    click.option("--column", help="Column of the target.  [default: the only numeric one]"),
    click.option("--time", help="Column of the time.  [default: time_s or time, if there]"),
    click.option(
        "--limits", **_numbers("LOW,HIGH"), help="Limits of the drive, for example -500,500."
    ),
    click.option(
        "--dynamics",
        **_numbers("FREQ,DAMPING"),
        help="Natural frequency (Hz) and damping ratio of the stage, for example 400,0.95.",
    ),
    click.option("--delay", type=float, help="Samples of dead time besides the hold."),
    click.option("--amplifier-pole", type=float, metavar="HZ", help="Cut-off of the amplifier."),
)
def precompensate(**options: Any) -> None:
    """Compute the drive that makes the model follow a trajectory: the exact inverse.

    With dynamics, delay or an amplifier it is led through their inverse too.
    """
    from mpi_hyst import _precompensate

    click.echo(_precompensate.run(_precompensate.Request(**options)))


@commands.command(no_args_is_help=False)
@_options(
    click.option(
        "--limits",
        required=True,
        **_numbers("LOW,HIGH"),
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
        "-o", "--out", "drive_path", required=True, type=_File, help="Drive to write (CSV)."
    ),
    click.option("--report", "report_path", type=_File, help="Report to write (one HTML file)."),
)
def excite(**options: Any) -> None:
    """Design the drive to identify from, within limits and slew, or a demagnetising one.

    It visits both limits, which makes the memory known, then turns at reversals that decay.
    """
    from mpi_hyst import _excite

    click.echo(_excite.run(_excite.Request(**options)))


@commands.command()
@click.option(
    "--out",
    "directory",
    type=_File,
    default=Path("mpi-hyst-demo"),
    show_default=True,
    help="Directory for the report, the models and the records.",
)
def demo(directory: Path) -> None:
    """Show the whole chain on the actuator of the paper; needs no data."""
    from mpi_hyst import _demo

    click.echo(_demo.run(directory))


@commands.command()
@click.option(
    "--out",
    "directory",
    type=_File,
    default=Path("mpi-hyst-reproduce"),
    show_default=True,
    help="Directory for the report and results.json.",
)
@click.option("--quick", is_flag=True, help="3 seeds of noise instead of 10.")
def reproduce(directory: Path, quick: bool) -> None:
    """Recompute every table and figure of the paper, and go beyond it; needs no data."""
    from mpi_hyst import _reproduce

    click.echo(_reproduce.run(directory, quick=quick))


@commands.command(no_args_is_help=False)
@_options(
    click.argument("model_path", metavar="MODEL.json", type=_File),
    click.argument("trajectory", metavar="REFERENCE.csv", type=_File),
    click.option(
        "--limits",
        required=True,
        **_numbers("LOW,HIGH"),
        help="Limits of the drive, for example -500,500.",
    ),
    click.option("-o", "result_path", type=_File, help="Run to write (CSV)."),
    click.option("--report", "report_path", type=_File, help="Report to write (one HTML file)."),
    click.option("--column", help="Column of the reference.  [default: the only numeric one]"),
    click.option("--time", help="Column of the time.  [default: time_s or time, if there]"),
    click.option("--rate", type=float, metavar="HZ", help="Samples per second, without a time."),
    click.option(
        "--plant",
        "plant_path",
        type=_File,
        metavar="ACTUATOR.json",
        help="What is simulated, if not MODEL.json itself.",
    ),
    click.option(
        "--dynamics",
        **_numbers("FREQ,DAMPING"),
        help="Natural frequency (Hz) and damping ratio of the stage, for example 400,0.95.",
    ),
    click.option("--amplifier-pole", type=float, metavar="HZ", help="Cut-off of the amplifier."),
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
    click.option("--gains", **_numbers("KP,KI"), help="Of the feedback.  [tuned]"),
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
def track(**options: Any) -> None:
    """Let a simulated stage follow a reference with feed-forward and feedback.

    The options say what the stage is; the controller knows all of it but the noise and --plant.
    """
    from mpi_hyst import _track

    click.echo(_track.run(_track.Request(**options)))
