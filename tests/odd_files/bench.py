"""Simulated stages of different physics, their records, and a trajectory that no record holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import mpi_hyst as mh
import numpy as np
from support import Array

RATE = 200.0


@dataclass(frozen=True)
class Record:
    """A record: when, which drive was put out, and which position was read."""

    t: Array
    u: Array
    y: Array
    rest: int = 0
    """Samples before the memory is known."""

    def spoilt(self, change: Callable[[Array], Array], column: str = "y") -> Record:
        """Return the record with another column."""
        values: Array = change(getattr(self, column).copy())
        return replace(self, u=values) if column == "u" else replace(self, y=values)

    def at(self, samples: Array | slice) -> Record:
        """Return the record of these samples."""
        return replace(self, t=self.t[samples], u=self.u[samples], y=self.y[samples])

    @property
    def span(self) -> float:
        """The peak-to-peak of the position."""
        return float(np.ptp(self.y))


@dataclass(frozen=True)
class Bench:
    """A stage, the limits of its drive, and the noise of its sensor as a share of the range."""

    name: str
    hysteresis: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii
    low: float
    high: float
    units: tuple[str, str] = ("v", "um")
    noise: float = 5e-4
    offset: float = 0.0
    creep: mh.plant.Creep | None = None
    dynamics: mh.plant.SecondOrder | None = None
    dead_time: float = 0.0

    @cached_property
    def stage(self) -> mh.Stage:
        """The whole stage."""
        return mh.Stage(
            self.hysteresis, creep=self.creep, dynamics=self.dynamics, dead_time=self.dead_time
        )

    def position(self, u: Array, rate: float = RATE) -> Array:
        """Return the true position."""
        return self.offset + self.stage.forward(dt=1.0 / rate).run(u)

    def excitation(self, cycles: int = 6, rate: float = RATE, seconds: float = 1.0) -> Array:
        """Return a full stroke and decaying loops; `seconds` for one way at full swing."""
        slew = (self.high - self.low) / seconds
        return mh.signals.excitation(self.low, self.high, slew=slew, rate=rate, cycles=cycles).drive

    def measured(self, u: Array, rate: float = RATE, seed: int = 7) -> Record:
        """Return the record of a drive, with noise."""
        y = self.position(u, rate)
        noise = np.random.default_rng(seed).normal(0.0, 1.0, u.size)
        return Record(np.arange(u.size) / rate, u, y + self.noise * np.ptp(y) * noise)

    def record(self, rate: float = RATE) -> Record:
        """Return a good record, which begins at rest."""
        return self.measured(self.excitation(rate=rate), rate)

    def sine(self, cycles: int, samples: int = 200) -> Array:
        """Return sines over the whole range, from the lower limit on."""
        phase = 2.0 * np.pi * np.arange(cycles * samples) / samples
        u: Array = self.low + 0.5 * (self.high - self.low) * (1.0 - np.cos(phase))
        return u

    def steps(self, levels: int, hold: int, seed: int = 3) -> Array:
        """Return random levels, each held, with a full stroke in front."""
        drawn = np.random.default_rng(seed).uniform(self.low, self.high, levels)
        return np.repeat(np.r_[self.low, self.high, self.low, drawn], hold)

    def unseen(self, rate: float = RATE) -> tuple[Array, int]:
        """Return a drive for validation within 2 % of the limits, and where the memory is known."""
        margin = 0.02 * (self.high - self.low)
        low, high = self.low + margin, self.high - margin
        turns = np.random.default_rng(99).uniform(low, high, 14)
        points = np.r_[np.clip(0.0, low, high), high, low, turns]
        ways = np.abs(np.diff(points)) / (high - low)
        times = np.r_[0.0, np.cumsum(ways)]
        count = int(times[-1] * rate)
        return np.interp(np.arange(count) / rate, times, points), int(times[2] * rate)


def _plays(low: float, high: float, travel: float, loss: float) -> mh.PrandtlIshlinskii:
    """Six plays at rest at the lower limit that travel so far; `loss` is about the loop width."""
    span = high - low
    thresholds = span * np.array([0.0, 0.04, 0.1, 0.18, 0.28, 0.42])
    weights = np.r_[1.0, loss * np.array([0.5, 0.9, 0.7, 0.5, 0.4])]
    reached = float(np.sum(weights * (span - thresholds)))
    return mh.PrandtlIshlinskii(weights * travel / reached, thresholds, input_offset=low)


STACK = Bench("stack", _plays(0.0, 150.0, 15.0, 0.6), 0.0, 150.0)
BIPOLAR = Bench("bipolar", mh.paper.table_1_recovered(), -500.0, 500.0)
NANO = Bench("nano", _plays(0.0, 10.0, 900.0, 0.4), 0.0, 10.0, ("v", "nm"), offset=52000.0)
MAGNET = Bench("magnet", _plays(-2.0, 2.0, 240.0, 0.9), -2.0, 2.0, ("a", "mt"), noise=1e-3)
TUBE = Bench("tube", _plays(-200.0, 200.0, 0.05, 0.5), -200.0, 200.0, ("v", "mm"), noise=1e-3)
CREEPING = replace(STACK, name="creeping", creep=mh.plant.Creep.logarithmic(0.02, 0.01, 100.0, 8))
LATE = replace(STACK, name="late", dynamics=mh.plant.SecondOrder(25.0, 0.6), dead_time=0.01)
