"""The report of an identification, from Python: its records come as arrays, or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import provenance
from mpi_hyst._report.identify import page
from mpi_hyst._report.identify.records import Record, Records, Task, loops_left_out
from mpi_hyst._types import Samples


def records(
    found: mh.results.Identification,
    u: Any,
    y: npt.ArrayLike | None,
    skip: int | Sequence[int],
    names: Sequence[str] | None,
    validate: Any,
) -> Records:
    """Check the records against the result, and put them in order."""
    count = len(found.records)
    pairs = _pairs(u, y, count)
    skips = list(skip) if isinstance(skip, list | tuple) else [skip] * count
    named = [f"record {number}" for number in range(1, count + 1)] if names is None else list(names)
    for argument, given in (("skip", skips), ("names", named)):
        if len(given) != count:
            raise ValueError(f"{argument}: expected {count}, one for each record, got {len(given)}")
    for i, name in enumerate(named):
        if not isinstance(name, str):
            raise TypeError(f"names[{i}]: expected a text, got {name!r}")
    intervals: list[float | None] = list(found.dt) or [None] * count
    made = [
        _record(name, *pair, dt, _leading(f"skip[{i}]", leading, pair[0]))
        for i, (name, pair, dt, leading) in enumerate(
            zip(named, pairs, intervals, skips, strict=True)
        )
    ]
    return Records(made, _held_out(found, validate), ends=False)


def _held_out(found: mh.results.Identification, validate: Any) -> list[Record]:
    """Check the records that were held out against the result."""
    if validate is None:
        return []
    if not isinstance(validate, tuple | list):
        expected = "expected (u, y), (u, y, skip) or a list of these"
        raise TypeError(f"validate: {expected}, got {validate!r}")
    given = [validate] if isinstance(validate, tuple) else validate
    count = len(found.validation_records)
    if len(given) != count:
        raise ValueError(
            f"validate: expected the {count} records that were held out, got {len(given)}"
        )
    dt = found.dt[0] if found.dt else None
    made = []
    for i, one in enumerate(given):
        if not isinstance(one, tuple | list) or len(one) not in (2, 3):
            raise TypeError(f"validate[{i}]: expected (u, y) or (u, y, skip), got {one!r}")
        name = f"validation record {i + 1}"
        pair = _pair(f"validate[{i}][0]", f"validate[{i}][1]", one[0], one[1])
        skip = _leading(f"validate[{i}][2]", one[2] if len(one) == 3 else 0, pair[0])
        made.append(_record(name, *pair, dt, skip))
    return made


def report(
    found: mh.results.Identification,
    given: Records,
    quantities: tuple[Quantity, Quantity],
    beside: mh.results.Identification | None,
) -> str:
    """Return the HTML text."""
    left_out: Sequence[mh.results.LeftOutLoop] = []
    data = []
    if given.known:
        left_out = loops_left_out(given, found)
        every = [*given.fitted, *given.held_out]
        data = [(f"{one.name}, u and y as float64", one.sha256) for one in every]
    stage = provenance.of_stage(found.stage)
    made = provenance.rows("mpi_hyst.reports.identification in Python", data, stage)
    return page.report(Task(given, *quantities), found, beside, left_out, provenance=made)


def _pairs(u: Any, y: npt.ArrayLike | None, count: int) -> list[tuple[Samples, Samples]]:
    """Return a pair for each record, of empty arrays where none are given."""
    if u is None:
        if y is not None:
            raise TypeError("u: expected the drive at which y was measured, got None")
        return [(np.empty(0), np.empty(0))] * count
    given = [(u, y)] if y is not None else list(u)
    if len(given) != count:
        raise ValueError(f"u: expected the {count} records that were fitted, got {len(given)}")
    pairs = []
    for i, pair in enumerate(given):
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise TypeError(f"u[{i}]: expected a pair (u, y), got {pair!r}")
        pairs.append(_pair(f"u[{i}]", f"y[{i}]", *pair))
    return pairs


def _pair(u_name: str, y_name: str, u: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Samples, Samples]:
    pair = _samples(u_name, u), _samples(y_name, y)
    if pair[0].size != pair[1].size:
        sizes = f"{pair[0].size} and {pair[1].size}"
        raise ValueError(f"{y_name}: expected as many samples as u has, got {sizes}")
    return pair


def _samples(name: str, values: npt.ArrayLike) -> Samples:
    made = np.asarray(values, dtype=np.float64)
    if made.ndim != 1 or made.size < 2 or not np.isfinite(made).all():
        raise ValueError(f"{name}: expected at least 2 finite samples in one row")
    return made


def _leading(name: str, skip: object, u: Samples) -> int:
    if isinstance(skip, bool) or not isinstance(skip, int):
        raise TypeError(f"{name}: expected a number of samples, got {skip!r}")
    if skip < 0 or (u.size and skip > u.size - 2):
        raise ValueError(f"{name}: expected 0 to {u.size - 2}, got {skip}")
    return skip


def _record(name: str, u: Samples, y: Samples, dt: float | None, skip: int) -> Record:
    seconds = None if dt is None else np.arange(u.size, dtype=np.float64) * dt
    _, sha256 = provenance.of_arrays(name, (u, y))
    return Record(name, u, y, seconds, dt, skip, sha256)
