"""A designed drive and what an engineer checks before playing it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits, in_unit
from mpi_hyst._types import Samples


@dataclass(frozen=True)
class Drive:
    """The samples, what they were asked to be, and how many come before the memory is known."""

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
        """When each sample is put out."""
        return np.arange(self.values.size) / self.rate

    @property
    def title(self) -> str:
        """What the drive is for."""
        return "demagnetising sequence" if self.demagnetizes else "drive to identify from"


def facts(drive: Drive) -> list[tuple[str, str]]:
    """Name what an engineer checks before playing the file."""
    unit, values = drive.quantity.unit, drive.values
    seconds = (values.size - 1) / drive.rate
    pairs = [
        ("samples", f"{values.size} at {digits(drive.rate)} Hz"),
        ("duration", f"{digits(seconds)} s"),
        ("range", f"{digits(float(values.min()))} to {in_unit(float(values.max()), unit)}"),
        ("start and end", in_unit(float(values[0]), unit)),
        ("largest step", _largest_step(drive)),
        ("reversals", f"{drive.reversals}, of them {2 * drive.cycles - 1} decaying"),
    ]
    if not drive.demagnetizes:
        initialization_samples = f"{drive.initialization_samples} samples, {digits(drive.initialization_samples / drive.rate)} s"
        pairs.append(("until the memory is known", initialization_samples))
    return pairs


def _largest_step(drive: Drive) -> str:
    unit = drive.quantity.unit
    step = float(np.abs(np.diff(drive.values)).max())
    speed = f"{digits(step * drive.rate)} {unit}/s" if unit else digits(step * drive.rate)
    return f"{in_unit(step, unit)} a sample, {speed}"
