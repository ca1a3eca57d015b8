"""The records of an identification, fitted and held out, and the errors of a model on them."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
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
    def validate(
        self,
    ) -> Sequence[tuple[Samples, Samples, int]] | None:
        """Held-out records as the library takes them."""
        if not self.held_out or self.ends:
            return None
        return [(record.input, record.output, record.skip) for record in self.held_out]


@dataclass(frozen=True)
class Evaluated:
    """A record and the errors of a model on it."""

    record: Record
    quality: mh.results.Quality
    place: int | None
    """Its number among the fitted records, if it is one or the rest of one."""
    offset: float
    """The output offset used for it."""

    def residuals(self, found: mh.results.Identification) -> Samples:
        """Measured minus modelled output."""
        return _residuals(self.record, self.place, found)


def _residuals(record: Record, place: int | None, found: mh.results.Identification) -> Samples:
    return found.residuals(
        *(record.input, record.output), record=place, skip=record.skip, dt=record.dt
    )


def evaluate(
    records: Records, found: mh.results.Identification
) -> tuple[list[Evaluated], list[Evaluated]]:
    """Return the fitted and the held-out records, each with the errors of a model."""
    offsets = [float(offset) for offset in found.output_offsets]
    places = range(len(records.fitted))
    fitted = list(map(Evaluated, records.fitted, found.records, places, offsets))
    # The end of a record goes on with what the record has of its own.
    own: Sequence[int | None] = places if records.ends else [None] * len(records.held_out)
    if not records.ends:
        offsets = [_own_offset(record, found) for record in records.held_out]
    return fitted, list(map(Evaluated, records.held_out, found.validation_records, own, offsets))


def _own_offset(record: Record, found: mh.results.Identification) -> float:
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


def loops_left_out(
    records: Records, found: mh.results.Identification
) -> Sequence[mh.results.LeftOutLoop]:
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
