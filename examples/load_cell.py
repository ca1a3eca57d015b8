"""A load cell with hysteresis, creep and a temperature: known loads, then loads from readings.

The load is the drive and the reading the position. So the inverse of the stage is the linearizer.
"""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]
Warmth = Numbers | None  # None: it is steady
Limits = tuple[float, float]
DT = 1.0  # seconds
SOON = 4  # samples after which a load that was put on is read


def calibrate(
    loads: Numbers, hold: int, temperature: Warmth, reading: Numbers, *, rested: bool = False
) -> mh.results.PlacesIdentification:
    """Identify the cell from loads that each lie on it for `hold` samples, the first one none.

    What lay on it before need not be known. `rested` says that nothing did, for a long time.
    """
    # Known: the reading soon after each load was put on, and at the end of its time.
    at = np.arange(loads.size).reshape(-1, hold)[:, [SOON, -1]].ravel()
    lengths = [(0.0, 0.0, float(k), float(reading[k] - reading[0])) for k in at]
    return mh.identify_places(
        *(loads, [], lengths),
        dt=DT,
        model="conventional",
        input_offset=0.0 if rested else "fit",
        drift=False if rested else "auto",
        dead_time=0.0,
        creep=[30.0, 300.0],  # time constants: half a hold, and some holds
        temperature=temperature,
    )


class Linearizer:
    """Loads from readings, sample by sample; `inverse.saturated` when one was held at a limit."""

    def __init__(
        self, stage: mh.Stage, zero: float, temperature: float, limits: Limits | None = None
    ) -> None:
        """Begin without a load, at a reading of `zero`.

        Without `limits` loads are held at the least and the greatest that were calibrated.
        """
        assert stage.temperature is not None
        self._zero, self._term = zero, stage.temperature
        self.inverse, self._lag = stage.inverse(DT, limits), stage.temperature.lag(DT)
        self._lag.settle(temperature)

    def step(self, reading: float, temperature: float) -> float:
        """Return the load."""
        added = self._term.at(self._lag.step(temperature))
        return self.inverse.step(reading - self._zero - added)
