"""LabVIEW measurement files (.lvm), by lvm_read.

`lvm_read.read_str` is used, as `lvm_read.read` also reads and writes a pickle beside the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from mpi_hyst._io.record import Assumption, ReadError
from mpi_hyst._io.source import PLAIN, Lines, TextOptions, reader, whole
from mpi_hyst._io.table import Began, Table, of_arrays
from mpi_hyst._quantity import known_unit
from mpi_hyst._types import Samples

_Segment = Mapping[str, Any]


def read_lvm(path: Path, lines: Lines, packed: str, options: TextOptions = PLAIN) -> Table:
    """Open a LabVIEW measurement file. Segments follow each other; the time is `time_s`."""
    del options
    lvm_read = reader(str(path), "lvm_read", "lvm")
    with whole(path, "LabVIEW measurement file"):
        text = _padded([f"{line}\n" for line in lines])
        found = lvm_read.read_str("".join(text))
        segments = [found[number] for number in range(found["Segments"])]
        parts = [_Channels(segment, segments[0]) for segment in segments]
    first = parts[0]
    for number, part in enumerate(parts):
        if part.names != first.names:
            raise ReadError(
                f"{path}, segment {number}: expected the channels of segment 0, "
                f"{', '.join(first.names)}, got {', '.join(part.names)}"
            )
    said: list[Assumption] = [*_compared(path, parts)]
    arrays: dict[str, Samples] = {}
    for place in range(len(first.names)):
        # Names of channels may be the same: their places are not.
        arrays[str(place)] = np.concatenate([part.columns[place] for part in parts])
    called = {str(place): name for place, name in enumerate(first.names)}
    clocks: dict[str, Began] = {}
    times = [part.times for part in parts]
    if all(len({_same(clock) for clock in one.values()}) == 1 for one in times):
        joined = np.concatenate([part.time for part in parts])
        arrays = {("time_s" if first.is_time else "X"): joined, **arrays}
    elif len(parts) == 1 and first.is_time:
        clocks = {name: Began(*one) for name, one in first.times.items()}
    elif any(times):
        what = "channels begin at different times in several segments: no time is taken"
        said.append(Assumption("table", what, "doubtful"))
    several = f"{len(parts)} segments" if len(parts) > 1 else ""
    parts_of = ["LabVIEW measurement", f"packed as {packed}" if packed else "", several]
    return of_arrays(
        *(str(path), path, ", ".join(filter(None, parts_of)), arrays, first.units),
        clocks=clocks,
        assumed=said,
        called=called,
    )


def _padded(lines: Sequence[str]) -> list[str]:
    """Return the lines with as many tabs behind `Channels` as there are names below.

    lvm_read counts the columns by them, and programs may have cut them off.
    """
    padded = list(lines)
    counted: int | None = None
    for place, line in enumerate(lines):
        key = line.split("\t", 1)[0]
        if key == "Channels":
            counted = place
        elif key == "X_Value" and counted is not None:
            more = line.count("\t") - lines[counted].count("\t")
            padded[counted] = lines[counted].rstrip("\r\n") + "\t" * max(0, more) + "\n"
            counted = None
    return padded


def _compared(path: Path, parts: Sequence[_Channels]) -> Iterator[Assumption]:
    """Compare the units of all segments with those of the first one."""
    first = parts[0]
    for number, part in enumerate(parts[1:], start=1):
        for place, name in enumerate(first.names):
            one, other = (each.units.get(str(place), "") for each in (first, part))
            if one and other and one != other:
                raise ReadError(
                    f"{path}, segment {number}, channel {name}: expected {one} as in segment 0, "
                    f"got {other}: save the segments as files of their own"
                )
            if one != other:
                where = f"segment {0 if other else number}"
                what = f"{name} has no unit in {where}: {one or other} is assumed as in the other"
                first.units.setdefault(str(place), other)
                yield Assumption("units", what, "doubtful")


def _same(clock: tuple[float, float]) -> tuple[float, float]:
    """Return a clock as it is compared: starts that differ by a part of a step are the same."""
    start, step = clock
    return (round(start / step, 1) if step else start), float(f"{step:.6g}")


class _Channels:
    """The channels of a segment, each with its unit and its clock."""

    def __init__(self, segment: _Segment, first: _Segment) -> None:
        """Take the segment, and the first one, which tells when the record began."""
        data = np.asarray(segment["data"], dtype=np.float64)
        called: Sequence[str] = segment["Channel names"]
        labels: Sequence[str] = segment.get("Y_Unit_Label", [])
        # Labels stand above their channels; the first column may be left out of both.
        shift = 1 if called[:1] == ["X_Value"] else 0
        places = [
            index
            for index, name in enumerate(called)
            if index < data.shape[1] and name and name not in ("X_Value", "Comment")
        ]
        self.names = [called[index] for index in places]
        self.columns = [data[:, index] for index in places]
        # By the numbers of the channels, as text.
        self.units: dict[str, str] = {}
        self.is_time = str(segment.get("X_Dimension", ["Time"])[0] or "Time") == "Time"
        self.time = np.arange(0.0)
        self.times: dict[str, tuple[float, float]] = {}
        for place, index in enumerate(places):
            name, above = str(place), index - shift
            label = labels[above] if 0 <= above < len(labels) else ""
            if label:
                self.units[name] = known_unit(label) or label
            x: Samples | None = next(
                (data[:, i] for i in range(index, -1, -1) if called[i] == "X_Value"), None
            )
            step = _number(segment, "Delta_X", above)
            if x is None and step:
                x = np.asarray((_number(segment, "X0", above) or 0.0) + step * np.arange(len(data)))
            if x is None or not len(x):
                continue
            step = float(x[-1] - x[0]) / max(1, len(x) - 1)
            began = _began(segment, first, above) if self.is_time else 0.0
            self.times[name] = float(x[0]) + began, step
            self.time = x + began if place == 0 else self.time


def _number(segment: _Segment, key: str, above: int) -> float | None:
    """Return a number of the header above a channel, or that of the first one."""
    values = segment.get(key, [])
    for place in (above, 0):
        if 0 <= place < len(values) and values[place] is not None and not np.isnan(values[place]):
            return float(values[place])
    return None


def _began(segment: _Segment, first: _Segment, above: int) -> float:
    """Return when a channel began, in seconds after the first segment, as far as it is said."""
    when = _when(_text(segment, "Date", above), _text(segment, "Time", above))
    start = _when(_text(first, "Date", 0), _text(first, "Time", 0))
    return 0.0 if when is None or start is None else (when - start).total_seconds()


def _text(segment: _Segment, key: str, above: int) -> str:
    value = segment.get(key, "")
    if isinstance(value, str):
        return value
    return str(value[above] if 0 <= above < len(value) and value[above] else value[0])


def _when(date: str, time: str) -> datetime | None:
    # Python before 3.11 reads six digits of a fraction at most.
    whole, dot, fraction = time.replace(",", ".").partition(".")
    try:
        return datetime.fromisoformat(f"{date.replace('/', '-')}T{whole}{dot}{fraction[:6]:0<6}")
    except ValueError:
        return None
