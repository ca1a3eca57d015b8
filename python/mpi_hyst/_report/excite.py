"""A designed drive in the terminal and as a page: an experiment and its plan, demagnetization."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._report.page import Card, Provenance, render
from mpi_hyst._text import digits, in_unit, span, text_table
from mpi_hyst._types import Samples
from mpi_hyst.signals import ExperimentPart, ExperimentSegment

POSITION = "position_um"


@dataclass(frozen=True)
class Part:
    """A file to play, and the name of the one to record."""

    name: str
    rate: float
    drive: Samples
    segments: Sequence[ExperimentSegment]
    initialization_samples: int

    @classmethod
    def of(cls, name: str, made: ExperimentPart) -> Part:
        """Name a designed part."""
        return cls(name, made.rate, made.drive, made.segments, made.initialization_samples)

    @property
    def record(self) -> str:
        """The name that the commands have for its record."""
        return f"{PurePath(self.name).stem}_record.csv"

    @property
    def seconds(self) -> Samples:
        """The time of each sample."""
        return np.arange(self.drive.size) / self.rate

    @property
    def duration(self) -> float:
        """The time from the first sample to the last."""
        return (self.drive.size - 1) / self.rate

    @property
    def title(self) -> str:
        """The file, its duration and its rate."""
        return f"{self.name}: {digits(self.duration)} s, {self.drive.size} samples at " + (
            f"{digits(self.rate)} Hz"
        )

    def rows(self, unit: str) -> list[list[str]]:
        """Return a row for each segment."""
        return [self._row(number, one, unit) for number, one in enumerate(self.segments, 1)]

    def _row(self, number: int, segment: ExperimentSegment, unit: str) -> list[str]:
        span = segment.range[1] - segment.range[0]
        # What rounding leaves of zero is zero.
        low, high = (0.0 if abs(end) < 1e-6 * span else end for end in segment.range)
        return [
            f"{number} {segment.name}",
            segment.purpose,
            f"{segment.start / self.rate:.2f}",
            f"{(segment.stop - segment.start) / self.rate:.2f}",
            _frequency(segment),
            f"{digits(low)} to {digits(high)}" if low < high else digits(low),
            digits(0.5 * (high - low)),
            per_second(segment.max_slew, unit),
        ]


@dataclass(frozen=True)
class Plan:
    """All files of an experiment, in the order in which to play them."""

    parts: Sequence[Part]
    quantity: Quantity
    limits: tuple[float, float]
    slew: float
    cycles: int
    center: float | None
    start: float | None

    @property
    def header(self) -> list[str]:
        """The columns of the table of segments."""
        unit = self.quantity.in_parentheses
        return [
            *("segment", "what it shows", "from (s)", "seconds", "frequency (Hz)"),
            *(f"drive{unit}", f"amplitude{unit}", "largest slew"),
        ]

    @property
    def duration(self) -> float:
        """Seconds of all files."""
        return sum(part.duration for part in self.parts)

    @property
    def rest(self) -> float:
        """The drive at which every file starts and ends."""
        return float(self.parts[0].drive[0])

    @property
    def identify(self) -> str:
        """The command for records that start from a known state: nothing is skipped."""
        records = " ".join(shlex.quote(part.record) for part in self.fitted)
        return " \\\n    ".join(
            [
                f"mpi-hyst identify {records}",
                f"--input {shlex.quote(self.quantity.column)} --output {POSITION} --skip 0",
                f"--operators {self.cycles}",
                f"{self._limits} --slew {self.slew:g} -o stage.json --report fit.html",
            ]
        )

    @property
    def demagnetize(self) -> str:
        """The command for a sequence that brings the actuator to a known state."""
        loops = self.parts[-1]
        slew = next(one.max_slew for one in loops.segments if one.name == "major")
        given = {"--center": self.center, "--start": self.start}
        return " ".join(
            [
                f"mpi-hyst excite {self._limits} --slew {slew:.6g} --rate {loops.rate:g}",
                *(f"{name} {value:g}" for name, value in given.items() if value is not None),
                f"--cycles {self.cycles} --column {shlex.quote(self.quantity.column)}",
                "--demagnetize -o demagnetize.csv",
            ]
        )

    @property
    def fitted(self) -> Sequence[Part]:
        """The files in the order of the fit: the loops first, whose offset the stage takes."""
        return self.parts[::-1]

    @property
    def _limits(self) -> str:
        return f"--limits {','.join(f'{limit:g}' for limit in self.limits)}"

    def as_text(self, written: Sequence[str]) -> str:
        """Return the summary for the terminal."""
        unit = self.quantity.unit
        rows = [part.rows(unit) for part in self.parts]
        keep = (0, 3, 4, 5, 7)
        header = [self.header[column] for column in keep]
        tables = [
            f"{part.title}\n\n"
            + text_table(header, [[row[column] for column in keep] for row in own])
            for part, own in zip(self.parts, rows, strict=True)
        ]
        records = ", ".join(part.record for part in self.parts)
        return "\n\n".join(
            [
                f"written: {', '.join(written)}",
                *tables,
                "Before: the actuator must have rested at "
                f"{digits(self.rest)}{f' {unit}' if unit else ''} in a known state. If it has "
                f"not:\n{self.demagnetize}",
                "Next: play the drives in this order. Record time, drive and position at their "
                f"rates as {records}. Then\n{self.identify}",
            ]
        )

    def as_json(self) -> str:
        """Return the plan for programs: samples count from 0, `stop` is the one after the last."""
        return json.dumps(
            {
                "schema": "mpi_hyst/experiment/1",
                "column": self.quantity.column,
                "limits": list(self.limits),
                "slew": self.slew,
                "start": self.rest,
                "parts": [_part(part) for part in self.parts],
                "identify": self.identify.replace(" \\\n    ", " "),
            },
            indent=1,
        )


def _part(part: Part) -> dict[str, object]:
    return {
        "file": part.name,
        "record": part.record,
        "rate_hz": part.rate,
        "samples": part.drive.size,
        "initialization_samples": part.initialization_samples,
        "segments": [
            {
                "name": one.name,
                "purpose": one.purpose,
                "start": one.start,
                "stop": one.stop,
                "low": one.range[0],
                "high": one.range[1],
                "amplitude": 0.5 * (one.range[1] - one.range[0]),
                "frequencies_hz": list(one.frequencies),
                "max_slew": one.max_slew,
            }
            for one in part.segments
        ],
    }


def _frequency(segment: ExperimentSegment) -> str:
    low, high = segment.frequencies
    if high == 0.0:
        return ""
    return digits(high) if low == high else f"{digits(low)} to {digits(high)}"


_NAMED = 0.055  # share of the width that a segment needs for its name, or for its number
_NUMBERED = 0.009


def plan_report(plan: Plan, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    unit = plan.quantity.unit
    low, high = plan.limits
    rest = in_unit(plan.rest, unit)
    cards = [
        Card(f"{digits(plan.duration)} s", "duration"),
        Card(f"{digits(low)} to {in_unit(high, unit)}", "limits, both reached"),
        Card(per_second(plan.slew, unit), "slew rate, never exceeded"),
        Card(rest, "rest drive", "every file starts and ends there"),
    ]
    return render(
        "excite.html.j2",
        cards=cards,
        provenance=provenance,
        plan=plan,
        rest=rest,
        drives=_plan_figure(plan),
        position=POSITION,
    )


def _plan_figure(plan: Plan) -> canvas.Figure:
    """Draw the drive of each file over time, with its segments."""
    drawn = canvas.new_figure(0.6 + 2.5 * len(plan.parts))
    panels = drawn.subplots(len(plan.parts), 1, squeeze=False)[:, 0]
    for axes, part in zip(panels, plan.parts, strict=True):
        canvas.line(axes, part.seconds, part.drive, color=canvas.BLUE, linewidth=0.9)
        axes.set_xlim(0.0, part.duration)
        canvas.dress(axes, "", "time (s)", plan.quantity.label)
        axes.set_title(canvas.plain(part.name), loc="left", pad=18, fontsize=10.5, weight="bold")
        _name_segments(axes, part)
    return drawn


def _name_segments(axes: canvas.Axes, part: Part) -> None:
    """Shade every other segment, and write its number and name above where there is room."""
    for number, segment in enumerate(part.segments, 1):
        start, stop = segment.start / part.rate, segment.stop / part.rate
        if number % 2:
            axes.axvspan(start, stop, color=canvas.GRID, zorder=0)
        share = (stop - start) / part.duration
        if share < _NUMBERED:
            continue
        axes.text(
            0.5 * (start + stop),
            1.02,
            f"{number} {segment.name}" if share >= _NAMED else f"{number}",
            transform=axes.get_xaxis_transform(),
            ha="center",
            fontsize=8.5,
            color=canvas.SOFT,
        )


@dataclass(frozen=True)
class Drive:
    """The samples and the properties that were asked for."""

    values: Samples
    quantity: Quantity
    rate: float
    slew: float
    cycles: int

    @property
    def seconds(self) -> Samples:
        """The time of each sample."""
        return np.arange(self.values.size) / self.rate


def facts(drive: Drive) -> list[tuple[str, str]]:
    """Return what to check before the file is played, as names and values."""
    unit, values = drive.quantity.unit, drive.values
    seconds = (values.size - 1) / drive.rate
    return [
        ("samples", f"{values.size} at {digits(drive.rate)} Hz"),
        ("duration", f"{digits(seconds)} s"),
        ("range", span(float(values.min()), float(values.max()), unit)),
        ("start and end", in_unit(float(values[0]), unit)),
        ("largest step", _largest_step(drive)),
        ("reversals", f"{2 * drive.cycles + 1}, {2 * drive.cycles - 1} of them decaying"),
    ]


def _largest_step(drive: Drive) -> str:
    unit = drive.quantity.unit
    step = float(np.abs(np.diff(drive.values)).max())
    return f"{in_unit(step, unit)} per sample, {per_second(step * drive.rate, unit)}"


def per_second(slew: float, unit: str) -> str:
    """Format a slew rate."""
    return f"{digits(slew)} {unit}/s" if unit else f"{digits(slew)}/s"


def demagnetization_report(drive: Drive, name: str, provenance: Provenance = ()) -> str:
    """Return the HTML text. `name` is that of the CSV file."""
    pairs = dict(facts(drive))
    return render(
        "demagnetize.html.j2",
        cards=[
            Card(pairs["duration"], "duration"),
            Card(pairs["range"], "range"),
            Card(pairs["reversals"].partition(",")[0], "reversals"),
        ],
        provenance=provenance,
        drive=drive,
        name=name,
        drawn=_drive_figure(drive),
        slew=per_second(drive.slew, drive.quantity.unit),
        facts=pairs.items(),
    )


def _drive_figure(drive: Drive) -> canvas.Figure:
    figure = canvas.new_figure(3.8)
    axes = figure.subplots()
    canvas.line(axes, drive.seconds, drive.values, color=canvas.BLUE, linewidth=0.9)
    axes.set_xlim(0.0, drive.seconds[-1])
    canvas.dress(axes, "drive over time", "time (s)", drive.quantity.label)
    return figure
