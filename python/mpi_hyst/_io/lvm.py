"""LabVIEW measurement files (.lvm), by lvm_read.

`lvm_read.read_str` is used, as `lvm_read.read` also reads and writes a pickle beside the file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.columns import ReadError
from mpi_hyst._io.lines import Lines
from mpi_hyst._io.table import Table, of_arrays, reader, whole
from mpi_hyst._quantity import known_unit

_Segment = Mapping[str, Any]


def read_lvm(path: Path, lines: Lines, packed: str) -> Table:
    """Open a LabVIEW measurement file. Segments follow each other; the time is `time_s`."""
    lvm_read = reader(str(path), "lvm_read", "lvm")
    with whole(path, "LabVIEW measurement file"):
        found = lvm_read.read_str("".join(f"{line}\n" for line in lines))
        segments = [found[number] for number in range(found["Segments"])]
        parts = [_columns(segment, segments[0]) for segment in segments]
    names = list(parts[0])
    for number, part in enumerate(parts):
        if list(part) != names:
            raise ReadError(
                f"{path}, segment {number}: expected the channels of segment 0, "
                f"{', '.join(names)}, got {', '.join(part)}"
            )
    arrays = {name: np.concatenate([part[name] for part in parts]) for name in names}
    several = f"{len(parts)} segments" if len(parts) > 1 else ""
    what = ["LabVIEW measurement", f"packed as {packed}" if packed else "", several]
    units = _units(segments[0], names)
    return of_arrays(str(path), path, ", ".join(filter(None, what)), arrays, units)


def _columns(segment: _Segment, first: _Segment) -> dict[str, npt.NDArray[Any]]:
    """Return the channels of a segment, with the time in front."""
    data = np.asarray(segment["data"], dtype=np.float64)
    names: Sequence[str] = segment["Channel names"]
    channels = {
        name: data[:, index]
        for index, name in enumerate(names)
        if index < data.shape[1] and name and name not in ("X_Value", "Comment")
    }
    x: npt.NDArray[Any] | None = next(
        (data[:, index] for index, name in enumerate(names) if name == "X_Value"), None
    )
    if x is None and (step := _first(segment, "Delta_X")):
        x = (_first(segment, "X0") or 0.0) + step * np.arange(len(data))
    if x is None:
        return channels
    is_time = str(segment.get("X_Dimension", ["Time"])[0] or "Time") == "Time"
    return {"time_s": x + _began(segment, first), **channels} if is_time else {"X": x, **channels}


def _first(segment: _Segment, key: str) -> float | None:
    value = segment.get(key, [None])[0]
    return None if value is None or np.isnan(value) else float(value)


def _began(segment: _Segment, first: _Segment) -> float:
    """Return when a segment began, in seconds after the first one, as far as it is said."""
    when, start = (_when(_text(one, "Date"), _text(one, "Time")) for one in (segment, first))
    return 0.0 if when is None or start is None else (when - start).total_seconds()


def _text(segment: _Segment, key: str) -> str:
    value = segment.get(key, "")
    return str(value if isinstance(value, str) else value[0])


def _when(date: str, time: str) -> datetime | None:
    # Python before 3.11 reads six digits of a fraction at most.
    whole, dot, fraction = time.replace(",", ".").partition(".")
    try:
        return datetime.fromisoformat(f"{date.replace('/', '-')}T{whole}{dot}{fraction[:6]:0<6}")
    except ValueError:
        return None


def _units(segment: _Segment, names: Sequence[str]) -> dict[str, str]:
    channels = [name for name in names if name not in ("time_s", "X")]
    labels = segment.get("Y_Unit_Label", [])
    return {
        name: known_unit(text) or text for name, text in zip(channels, labels, strict=False) if text
    }
