"""The records of an identification, fitted and held out, and the errors of a model on them."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._core import Identification, LeftOutLoop, Quality
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.page import hashed_arrays
from mpi_hyst._types import Samples


@dataclass(frozen=True)
class Record:
    """A measured record. Its first `skip` samples initialize the model and count in no error."""

    name: str
    input: Samples
    output: Samples
    seconds: Samples | None
    dt: float | None
    skip: int
    sha256: str | None = None

    def until(self, sample: int) -> Record:
        """Return the part before a sample."""
        seconds = None if self.seconds is None else self.seconds[:sample]
        return replace(
            self, input=self.input[:sample], output=self.output[:sample], seconds=seconds
        )


@dataclass(frozen=True)
class Records:
    """Records to fit and records held out: separate ones, or the ends of those fitted."""

    fitted: Sequence[Record]
    held_out: Sequence[Record]
    ends: bool
    units: Mapping[str, str] = field(default_factory=dict)
    """The units of drive and position by the names of their columns, as far as they are known."""
    assumed: Sequence[str] = ()
    """What reading the files took for granted, and what may be otherwise."""
    doubts: Sequence[str] = ()
    """What of it something in the files speaks against: it makes the verdict amber."""

    @property
    def dt(self) -> float | None:
        """The sampling interval of the first record in seconds, or None if it is not known."""
        return self.fitted[0].dt

    @property
    def known(self) -> bool:
        """Whether the samples are there: a result that is shown alone has none."""
        return all(record.input.size > 0 for record in self.fitted)

    @property
    def intervals(self) -> list[float] | None:
        """The sampling intervals of the fitted records, or None if they are not known."""
        known = [record.dt for record in self.fitted if record.dt is not None]
        return known or None

    @property
    def names(self) -> list[str]:
        """The names of the fitted records."""
        return [record.name for record in self.fitted]

    @property
    def validate(self) -> Sequence[tuple[Samples, Samples, int]] | None:
        """Held-out records as the library takes them."""
        if not self.held_out or self.ends:
            return None
        return [(record.input, record.output, record.skip) for record in self.held_out]


@dataclass(frozen=True)
class Evaluated:
    """A record and the errors of a model on it."""

    record: Record
    quality: Quality
    place: int | None
    """Its number among the fitted records, if it is one or the rest of one."""
    offset: float
    """The output offset used for it."""

    def residuals(self, found: Identification) -> Samples:
        """Measured minus modelled output."""
        return _residuals(self.record, self.place, found)


def _residuals(record: Record, place: int | None, found: Identification) -> Samples:
    return found.residuals(
        *(record.input, record.output), record=place, skip=record.skip, dt=record.dt
    )


def evaluate(records: Records, found: Identification) -> tuple[list[Evaluated], list[Evaluated]]:
    """Return the fitted and the held-out records, each with the errors of a model."""
    offsets = [float(offset) for offset in found.output_offsets]
    places = range(len(records.fitted))
    fitted = list(map(Evaluated, records.fitted, found.records, places, offsets))
    # The end of a record goes on with what the record has of its own.
    own: Sequence[int | None] = places if records.ends else [None] * len(records.held_out)
    if not records.ends:
        offsets = [_own_offset(record, found) for record in records.held_out]
    return fitted, list(map(Evaluated, records.held_out, found.validation_records, own, offsets))


def _own_offset(record: Record, found: Identification) -> float:
    """Return the offset that suits a record best, with creep under way as it is at the end."""
    explained = record.output[-1] - _residuals(record, None, found)[-1]
    with told_as_a_finding():
        predicted = found.predict(record.input, dt=record.dt)[-1]
    return float(found.output_offsets[0] + explained - predicted)


@contextmanager
def told_as_a_finding() -> Iterator[None]:
    """Keep quiet about drives beyond the identified ones: `extrapolation` is a finding here."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "u: the drive reaches", UserWarning)
        yield


def loops_left_out(records: Records, found: Identification) -> Sequence[LeftOutLoop]:
    """Predict every loop from a fit to the others; empty if there is only one loop."""
    try:
        return found.leave_one_loop_out(
            [(record.input, record.output) for record in records.fitted],
            skip=[record.skip for record in records.fitted],
        )
    except ValueError as error:
        # The fit took these records, so they lack nothing but a second loop.
        if getattr(error, "parameter", None) == "records":
            return []
        raise


@dataclass(frozen=True)
class Task:
    """The input of an identification: records, quantities, and parameters that were given."""

    records: Records
    input: Quantity
    output: Quantity
    given: Collection[str] = ()
    """Names of parameters that were not fitted."""


def records_of_arrays(
    found: Identification,
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


def _held_out(found: Identification, validate: Any) -> list[Record]:
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
    _, sha256 = hashed_arrays(name, (u, y))
    return Record(name, u, y, seconds, dt, skip, sha256)
