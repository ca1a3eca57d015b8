"""Rows that are not fitted: a record becomes several, each with a zero of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mpi_hyst._cli.errors import CommandError
from mpi_hyst._report.identify.records import Record
from mpi_hyst._types import Samples

_SHORTEST = 10  # samples; what is shorter tells little beside a zero of its own

Stretch = tuple[int, int]


def parted(record: Record, left_out: Sequence[Stretch], mended: Sequence[Stretch]) -> list[Record]:
    """Return what lies between, each part with all samples before it: they set the memory."""
    for option, stretches in (("--leave-out", left_out), ("--mend", mended)):
        for first, last in stretches:
            if last > record.input.size:
                raise CommandError(
                    f"{option}: expected rows up to {record.input.size}, got {first}:{last}"
                )
    mended_record = replace(record, input=_mended(record, mended))
    found, begin = [], record.skip
    for first, last in [*sorted([*left_out, *mended]), (record.input.size, record.input.size)]:
        if first - begin >= _SHORTEST:
            found.append(replace(mended_record.until(first), skip=begin))
        begin = max(begin, last)
    if not found:
        raise CommandError("--leave-out and --mend leave no samples to fit")
    return found


def _mended(record: Record, stretches: Sequence[Stretch]) -> Samples:
    """Return the drive with straight lines over the stretches."""
    known = np.ones(record.input.size, dtype=bool)
    for first, last in stretches:
        known[first:last] = False
    if not known.any():
        raise CommandError("--mend: expected rows that are left as they are, got none")
    rows = np.arange(record.input.size)
    return np.interp(rows, rows[known], record.input[known])
