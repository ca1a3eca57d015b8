"""A designed drive and the facts to check before it is played."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits, in_unit
from mpi_hyst._types import Samples


@dataclass(frozen=True)
class Drive:
    """The samples and the properties that were asked for.

    The first `initialization_samples` erase the unknown history of the actuator.
    """

    values: Samples
    quantity: Quantity
    rate: float
    slew: float
    cycles: int
    initialization_samples: int
    reversals: int
    demagnetizes: bool

    @property
    def seconds(self) -> Samples:
        """The time of each sample."""
        return np.arange(self.values.size) / self.rate

    @property
    def title(self) -> str:
        """The purpose of the drive."""
        return "demagnetizing sequence" if self.demagnetizes else "drive for identification"


def facts(drive: Drive) -> list[tuple[str, str]]:
    """Return what to check before the file is played, as names and values."""
    unit, values = drive.quantity.unit, drive.values
    seconds = (values.size - 1) / drive.rate
    pairs = [
        ("samples", f"{values.size} at {digits(drive.rate)} Hz"),
        ("duration", f"{digits(seconds)} s"),
        ("range", f"{digits(float(values.min()))} to {in_unit(float(values.max()), unit)}"),
        ("start and end", in_unit(float(values[0]), unit)),
        ("largest step", _largest_step(drive)),
        ("reversals", f"{drive.reversals}, {2 * drive.cycles - 1} of them decaying"),
    ]
    if not drive.demagnetizes:
        count = drive.initialization_samples
        pairs.append(("initialization", f"{count} samples, {digits(count / drive.rate)} s"))
    return pairs


def _largest_step(drive: Drive) -> str:
    unit = drive.quantity.unit
    step = float(np.abs(np.diff(drive.values)).max())
    slew = f"{digits(step * drive.rate)} {unit}/s" if unit else f"{digits(step * drive.rate)}/s"
    return f"{in_unit(step, unit)} per sample, {slew}"
