"""A demagnetizing sequence and the facts to check before it is played."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits, in_unit, span
from mpi_hyst._types import Samples


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
