"""The plan of an experiment: what each file holds, and the commands before and after."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from mpi_hyst._quantity import Quantity
from mpi_hyst._report.excite.drive import per_second
from mpi_hyst._text import digits, text_table
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
