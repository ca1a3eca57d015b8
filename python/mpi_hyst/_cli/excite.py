"""`mpi-hyst excite`: the drives of an experiment, or a demagnetizing sequence, as CSV files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import click

import mpi_hyst as mh
from mpi_hyst._cli.options import command, flag, flags, limits, numbers, option, passed, report
from mpi_hyst._cli.outputs import Output, check_directory, check_outputs, write_outputs, write_table
from mpi_hyst._cli.terminal import (
    CommandError,
    command_line,
    parameter,
    require_report_packages,
    say,
    with_options,
)
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import excite as page
from mpi_hyst._report.excite import Drive, Part, Plan
from mpi_hyst._report.page import made_with
from mpi_hyst._text import in_unit, printable, text_pairs
from mpi_hyst._types import Samples

TIME = "time_s"
_EXPERIMENT = ("experiment",)
_BOTH = ("experiment", "demagnetize")


@dataclass(frozen=True)
class Request:
    """What the drives keep within, what they show, and where they go."""

    limits: tuple[float, float] = limits()
    slew: float = option(
        passed=_BOTH,
        required=True,
        metavar="V/S",
        help="Largest slew rate, in units of the drive per second.",
    )
    rate: float = option(
        passed=_BOTH, required=True, metavar="HZ", help="Sampling rate of loops and rests."
    )
    fast_rate: float | None = option(
        passed=_EXPERIMENT,
        metavar="HZ",
        help="Sampling rate of the fast signal.  [default: that of the loops]",
    )
    frequencies: tuple[float, float] | None = option(
        passed=_EXPERIMENT,
        **numbers("FIRST,SECOND"),
        help="Two frequencies of a full stroke (Hz). A slew rate that is too low for them lowers "
        "them.  [default: 1,10]",
    )
    cycles: int = option(
        passed=_BOTH,
        type=click.IntRange(min=1),
        default=20,
        help="Number of decaying cycles. Use one for each operator of the model to be fitted.",
    )
    shape: Literal["triangle", "sine"] = option(
        passed=_BOTH,
        default="triangle",
        help="Straight lines between reversals, or half cosines, which have no steps in speed.",
    )
    center: float | None = option(
        passed=_BOTH,
        metavar="V",
        help="Drive at which the decaying cycles end.  [default: middle of the limits]",
    )
    start: float | None = option(
        passed=_BOTH,
        metavar="V",
        help="Rest drive: every file starts and ends there.  [default: 0 if within the limits]",
    )
    rest: float | None = option(
        passed=_EXPERIMENT,
        metavar="SECONDS",
        help="Duration of each of four rests, which tell creep.  [default: 10]",
    )
    fast_signal: Literal["chirp", "multisine"] | None = option(
        passed=_EXPERIMENT, help="Small signal that tells modes and dead time.  [default: chirp]"
    )
    fast_amplitude: float | None = option(
        passed=_EXPERIMENT,
        metavar="V",
        help="Its largest amplitude. A lightly damped mode multiplies it. At high "
        "frequencies the slew rate may ask for less.  [default: 1 % of half the range]",
    )
    fast_frequency: float | None = option(
        passed=_EXPERIMENT,
        metavar="HZ",
        help="Its highest frequency.  [default: 0.8 of the Nyquist frequency]",
    )
    demagnetize: bool = flag(
        help="Write a sequence that demagnetizes the actuator: it ends in a known state."
    )
    column: str = option(default="voltage_v", help="Column of the drive.")
    out: Path = option(
        *("-o", "--out"),
        required=True,
        help="Directory for the experiment: fast.csv, loops.csv, plan.html, plan.json. A name "
        "that ends in .csv: one file with all of it, at one rate.",
    )
    report_path: Path | None = report()

    @property
    def quantity(self) -> Quantity:
        """The drive."""
        return Quantity(self.column)

    @property
    def single_file(self) -> bool:
        """Whether the drive goes to one file, instead of a directory."""
        return self.demagnetize or self.out.suffix.lower() == ".csv"

    def check(self) -> None:
        """Refuse names of columns that a CSV file cannot have, and options that contradict."""
        if self.column in ("", TIME):
            raise CommandError(f"--column: expected a name other than {TIME}, got {self.column!r}")
        if self.column != printable(self.column).strip():
            raise CommandError(f"--column: expected a printable name, got {self.column!r}")
        both = passed(self, "demagnetize")
        others = [name for name in passed(self, "experiment") if name not in both]
        if self.demagnetize and others:
            raise CommandError(f"{flags(Request)[others[0]]}: not with --demagnetize")

    def explain(self, error: Exception) -> CommandError:
        """Return the error of the library with the option in front, or in place of the argument."""
        argument = parameter(error)
        message = with_options(str(error), argument, flags(Request))
        return CommandError(f"--limits: {message}" if argument in ("low", "high") else message)


@command(Request, short_help="Design the drives to identify a stage from.")
def excite(request: Request) -> None:
    """Design an experiment to identify a stage, within limits and slew rate.

    fast.csv has a small chirp or multisine for the modes. loops.csv has full, decaying, growing
    and small loops, rests for creep, and loops at a second frequency. plan.html shows both and
    names the command for identification.
    """
    say(run(request))


def run(request: Request) -> str:
    """Design the drives, write them, and return the summary."""
    request.check()
    return _demagnetize(request) if request.demagnetize else _experiment(request)


def _experiment(request: Request) -> str:
    directory = None if request.single_file else request.out
    report_path = request.report_path
    if directory is not None and report_path is None:
        report_path = directory / "plan.html"
    paths = _check_places(request, directory, report_path)
    plan = _plan(request)
    outputs = [
        _table(path, part.seconds, request.column, part.drive)
        for path, part in zip(paths, plan.parts, strict=True)
    ]
    if directory is not None:
        outputs.append(Output.of(directory / "plan.json", plan.as_json()))
    if report_path is not None:
        text = page.plan_report(plan, made_with(command_line()))
        outputs.append(Output.of(report_path, text))
    write_outputs(outputs, directory)
    return plan.as_text([str(output.path) for output in outputs])


def _check_places(request: Request, directory: Path | None, report_path: Path | None) -> list[Path]:
    """Refuse files that cannot be written, and return those for the drives."""
    if report_path is not None:
        what = "--report" if request.report_path is not None else "the plan in a directory"
        require_report_packages(what)
    if directory is None:
        check_outputs([request.out, report_path])
        return [request.out]
    check_directory(directory)
    drives = [directory / "fast.csv", directory / "loops.csv"]
    own = [*drives, directory / "plan.json"]
    if report_path in own:
        raise CommandError(f"{report_path}: named for two outputs")
    # What lies in a directory that is yet to be made has nothing in its way.
    outputs = [path for path in (*own, report_path) if path is not None]
    check_outputs([path for path in outputs if directory.exists() or path.parent != directory])
    return drives


def _plan(request: Request) -> Plan:
    try:
        made = mh.signals.experiment(
            *request.limits, joined=request.single_file, **passed(request, "experiment")
        )
    except (ValueError, TypeError) as error:
        raise request.explain(error) from error
    names = [request.out.name] if request.single_file else [f"{one.name}.csv" for one in made]
    parts = [Part.of(name, one) for name, one in zip(names, made, strict=True)]
    return Plan(
        parts,
        request.quantity,
        request.limits,
        request.slew,
        request.cycles,
        request.center,
        request.start,
    )


def _demagnetize(request: Request) -> str:
    check_outputs([request.out, request.report_path])
    if request.report_path is not None:
        require_report_packages("--report")
    try:
        values = mh.signals.demagnetize(*request.limits, **passed(request, "demagnetize"))
    except (ValueError, TypeError) as error:
        raise request.explain(error) from error
    drive = Drive(values, request.quantity, request.rate, request.slew, request.cycles)
    outputs = [_table(request.out, drive.seconds, request.column, drive.values)]
    if request.report_path is not None:
        made = made_with(command_line())
        text = page.demagnetization_report(drive, request.out.name, made)
        outputs.append(Output.of(request.report_path, text))
    write_outputs(outputs)
    low, high = request.limits
    center = 0.5 * (low + high) if request.center is None else request.center
    return (
        f"{request.out}: demagnetizing sequence\n\n{text_pairs(page.facts(drive))}\n\n"
        "Next: play it. The actuator is then in the state in which a model with the input "
        f"offset {in_unit(center, drive.quantity.unit)} starts."
    )


def _table(path: Path, seconds: Samples, column: str, drive: Samples) -> Output:
    return Output.of(path, write_table({TIME: seconds, column: drive}))
