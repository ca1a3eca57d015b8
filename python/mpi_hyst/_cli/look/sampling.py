"""The steps of a time column: their mean, jitter and gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._text import digits
from mpi_hyst._types import Samples

_GAP = 1.5  # steps: a longer one lacks samples
_UNEVEN = 0.1  # of a step: identify refuses more
_SLOWEST = 0.5  # seconds; a longer step is hardly one of a record of hysteresis
_SHOWN = 3  # gaps
_ROUNDING = 1e-4  # % of a step


@dataclass(frozen=True)
class Sampling:
    """The steps of a time column, in its own unit and in seconds."""

    times: Samples
    quantity: Quantity

    @property
    def scale(self) -> float:
        """Seconds in the unit of the column; one without a unit is taken as seconds."""
        return SECONDS[self.quantity.time_unit or "s"]

    @property
    def steps(self) -> Samples:
        """The steps in seconds."""
        return np.diff(self.times) * self.scale

    @property
    def step(self) -> float:
        """The mean step in seconds."""
        return float(self.times[-1] - self.times[0]) * self.scale / (self.times.size - 1)

    @property
    def increases(self) -> bool:
        """Whether every time is later than the one before."""
        return bool((self.steps > 0.0).all())

    @property
    def gaps(self) -> list[int]:
        """The samples before which others are missing."""
        usual = float(np.median(self.steps))
        return [int(at) + 1 for at in np.flatnonzero(self.steps > _GAP * usual)]

    @property
    def uneven(self) -> bool:
        """Whether `identify` refuses the times, as the samples are not equally far apart."""
        even = self.times[0] * self.scale + self.step * np.arange(self.times.size)
        return bool(np.abs(self.times * self.scale - even).max() > _UNEVEN * self.step)

    @property
    def unit_is_doubtful(self) -> bool:
        """Whether the unit is not said, and the steps are too long for seconds."""
        return not self.quantity.time_unit and self.step >= _SLOWEST

    def facts(self) -> list[tuple[str, str]]:
        """Return what to know about the sampling, as names and values. Rows count from 0."""
        if not self.increases:
            at = int(np.flatnonzero(~(self.steps > 0.0))[0]) + 1
            return [("sampling", f"the time does not increase at row {at}")]
        usual = float(np.median(self.steps))
        whole = self.steps[self.steps <= _GAP * usual]
        jitter = float(whole.std())
        share = 100.0 * jitter / usual
        said = f"{digits(jitter, 2)} s rms, {digits(share, 2)} % of a step"
        pairs = [
            ("sampling", f"{digits(self.step)} s on average, {digits(1.0 / self.step)} Hz"),
            ("jitter", said if share > _ROUNDING else "none"),
            ("gaps", self._gaps(usual)),
        ]
        if self.quantity.time_unit not in ("", "s"):
            pairs.append(("time unit", f"{self.quantity.unit}, converted to seconds"))
        return pairs

    def _gaps(self, usual: float) -> str:
        gaps = self.gaps
        if not gaps:
            return "none"
        shown = [f"{digits(self.steps[at - 1], 3)} s before row {at}" for at in gaps[:_SHOWN]]
        more = f" and {len(gaps) - _SHOWN} more" if len(gaps) > _SHOWN else ""
        return f"{', '.join(shown)}{more}; the usual step is {digits(usual)} s"
