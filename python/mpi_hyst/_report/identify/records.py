"""The records of an identification, fitted and held out, and the errors of a model on them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
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
    """A record, the errors of a model on it, and the output offset used for them."""

    record: Record
    quality: mh.results.Quality
    offset: float

    def residuals(self, found: mh.results.Identification) -> Samples:
        """Measured minus modelled output."""
        own = self.offset - float(found.output_offsets[0])
        return self.record.output - (found.predict(self.record.input, dt=self.record.dt) + own)


def evaluate(
    records: Records, found: mh.results.Identification
) -> tuple[list[Evaluated], list[Evaluated]]:
    """Return the fitted and the held-out records, each with the errors of a model."""
    offsets = [float(offset) for offset in found.output_offsets]
    fitted = list(map(Evaluated, records.fitted, found.records, offsets))
    if not records.ends:
        offsets = [_own_offset(record, found) for record in records.held_out]
    return fitted, list(map(Evaluated, records.held_out, found.validation_records, offsets))


def _own_offset(record: Record, found: mh.results.Identification) -> float:
    """Return the output offset that minimizes the rms error on a record."""
    left = (record.output - found.predict(record.input, dt=record.dt))[record.skip :]
    return float(found.output_offsets[0] + left.mean())


@dataclass(frozen=True)
class Task:
    """The input of an identification: records, quantities, and parameters that were given."""

    records: Records
    input: Quantity
    output: Quantity
    given: Collection[str] = ()
    """Names of parameters that were not fitted."""
