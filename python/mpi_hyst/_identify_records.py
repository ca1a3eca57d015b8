"""The records of `mpi-hyst identify`: those to fit and those held out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

import mpi_hyst as mh
from mpi_hyst._errors import CommandError
from mpi_hyst._identify_request import Request
from mpi_hyst._records import Samples, read_columns
from mpi_hyst._tables import digits

_Value = TypeVar("_Value", str, int)
_AMOUNT = re.compile(r"(?P<count>\d+(\.\d+)?|\.\d+) ?(?P<seconds>s)?")


@dataclass(frozen=True)
class Record:
    """One measured record, its first `skip` samples neither fitted nor judged."""

    name: str
    input: Samples
    output: Samples
    seconds: Samples | None
    sample_time: float | None
    skip: int

    def until(self, sample: int) -> Record:
        """Return what comes before a sample."""
        seconds = None if self.seconds is None else self.seconds[:sample]
        return replace(
            self, input=self.input[:sample], output=self.output[:sample], seconds=seconds
        )


@dataclass(frozen=True)
class Records:
    """Those to fit, and those held out: others, or the ends of the same ones."""

    fitted: Sequence[Record]
    held_out: Sequence[Record]
    ends: bool

    @property
    def names(self) -> list[str]:
        """The names of those to fit."""
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
class Judged:
    """A record with the errors of a model on it, and the output offset that it was judged with."""

    record: Record
    quality: mh.Quality
    offset: float

    def residuals(self, found: mh.Identification) -> Samples:
        """Measured minus modelled output."""
        own = self.offset - float(found.output_offsets[0])
        return self.record.output - (found.predict(self.record.input) + own)


def judge(records: Records, found: mh.Identification) -> tuple[list[Judged], list[Judged]]:
    """Return the fitted records and the held-out ones, each with the errors of a model."""
    offsets = [float(offset) for offset in found.output_offsets]
    fitted = list(map(Judged, records.fitted, found.records, offsets))
    if not records.ends:
        offsets = [_own_offset(record, found) for record in records.held_out]
    return fitted, list(map(Judged, records.held_out, found.validation_records, offsets))


def _own_offset(record: Record, found: mh.Identification) -> float:
    """Return the output offset that suits a record best, as the library judges it."""
    left = (record.output - found.predict(record.input))[record.skip :]
    return float(found.output_offsets[0] + left.mean())


def read(request: Request) -> Records:
    """Read all records, each with the part to skip."""
    records = _read("--skip", request.data, request.skip, request.rows, request)
    held_out = _read("--validate-skip", request.validate, request.validate_skip, (), request)
    _check_sample_times([*records, *held_out])
    if not request.validate_from:
        return Records(records, held_out, ends=False)
    ends = _ends(records, request)
    fitted = [record.until(end) for record, end in zip(records, ends, strict=True)]
    held_out = [replace(record, skip=end) for record, end in zip(records, ends, strict=True)]
    return Records(fitted, held_out, ends=True)


def _read(
    option: str, paths: Sequence[Path], skip: Sequence[str], rows: Sequence[int], request: Request
) -> list[Record]:
    skips = _per_file(option, skip, "0", paths)
    counts = _per_file("--rows", rows, 0, paths)
    names = [request.input_column, request.output_column]
    records = []
    for path, amount, count in zip(paths, skips, counts, strict=True):
        columns = read_columns(path, names, time=request.time, rows=count or None)
        records.append(
            Record(
                name=path.name,
                input=columns.values[request.input_column],
                output=columns.values[request.output_column],
                seconds=columns.seconds,
                sample_time=columns.sample_time,
                skip=_samples(option, amount, columns.path, columns.seconds, columns.samples),
            )
        )
    return records


def _ends(records: Sequence[Record], request: Request) -> list[int]:
    """Return the samples from which on the records are held out."""
    option = "--validate-from"
    ends = []
    amounts = _per_file(option, request.validate_from, "", request.data)
    for record, path, amount in zip(records, request.data, amounts, strict=True):
        end = _samples(option, amount, path, record.seconds, record.input.size)
        if end <= record.skip:
            raise CommandError(f"{path}: {option} {amount} leaves nothing to fit")
        ends.append(end)
    return ends


def _per_file(
    option: str, values: Sequence[_Value], default: _Value, data: Sequence[Path]
) -> list[_Value]:
    """Spread the values of an option over the files: one for all, or one for each."""
    if len(values) not in (0, 1, len(data)):
        raise CommandError(
            f"{option}: given {len(values)} times for {len(data)} files; once for all, or once each"
        )
    if len(values) == len(data):
        return list(values)
    return [values[0] if values else default] * len(data)


def _samples(option: str, amount: str, path: Path, seconds: Samples | None, samples: int) -> int:
    """Turn rows, as in 1000, or seconds, as in 5s, into samples: fewer than the file has."""
    match = _AMOUNT.fullmatch(amount.strip())
    if match is None or (not match["seconds"] and not match["count"].isdigit()):
        raise CommandError(
            f"{option}: expected rows as in 1000 or seconds as in 5s, got {amount!r}"
        )
    if not match["seconds"]:
        count = int(match["count"])
    elif seconds is None:
        raise CommandError(f"{path}: {option} {amount} needs a time column, name it with --time")
    else:
        count = int(np.searchsorted(seconds - seconds[0], float(match["count"])))
    if count >= samples:
        raise CommandError(f"{path}: {option} {amount} leaves nothing of {samples} samples")
    return count


def _check_sample_times(records: Sequence[Record]) -> None:
    """Refuse records of different rates: their delay in samples would not be one number."""
    first = records[0]
    for record in records[1:]:
        if first.sample_time is None or record.sample_time is None:
            continue
        if abs(record.sample_time - first.sample_time) > 1e-3 * first.sample_time:
            times = f"{digits(first.sample_time)} s and {digits(record.sample_time)} s"
            raise CommandError(
                f"{record.name}: not sampled at the rate of {first.name} ({times} a sample)"
            )
