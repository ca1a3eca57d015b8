"""Stages of different physics, and records of them: what tests of the verdict share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mpi_hyst as mh
import numpy as np
from support import Array

RATE = 1000.0
NOISE = 1e-3  # of the range


@dataclass(frozen=True)
class Bench:
    """A stage, and the limits of its drive in V."""

    name: str
    low: float
    high: float
    position: Callable[[Array], Array]

    def drive(self) -> tuple[Array, int]:
        """Return a drive to identify from, with the samples that set the memory."""
        slew = 4.0 * (self.high - self.low)
        made = mh.signals.excitation(self.low, self.high, slew=slew, rate=RATE)
        return made.drive, made.initialization_samples

    def measured(self, u: Array, seed: int = 11) -> Array:
        """Return the position with noise."""
        y = self.position(u)
        noise = np.random.default_rng(seed).normal(0.0, NOISE * np.ptp(y), u.size)
        return y + noise

    def cycles(self, count: int, samples: int = 400) -> Array:
        """Return sines over the whole range."""
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        phase = 2.0 * np.pi * np.arange(count * samples) / samples
        u: Array = middle + half * np.sin(phase)
        return u


def _paper(u: Array) -> Array:
    return mh.paper.table_1_recovered().forward().run(u)


def _unipolar(u: Array) -> Array:
    """A conventional model of 15 plays at 0 to 150 V."""
    thresholds = 5.0 * np.arange(15)
    weights = np.r_[0.5, 0.03 * np.exp(-np.arange(1, 15) / 5.0)]
    return mh.PrandtlIshlinskii(weights, thresholds).forward().run(u)


def _bouc_wen(u: Array) -> Array:
    """z' = A u' - b |u'| z - g u' |z|, y = 0.6 u - z, in steps of at most 1 V."""
    a, b, g = 0.1, 0.011, 0.002
    z, last, y = 0.0, float(u[0]), np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        steps = max(1, round(abs(now - last)))
        h = (now - last) / steps
        for _ in range(steps):
            z += a * h - b * abs(h) * z - g * h * abs(z)
        y[k], last = 0.6 * now - z, now
    return y


def _behind_tanh(u: Array) -> Array:
    """Generalised plays: those of an input that saturates."""
    thresholds = np.linspace(0.0, 40.0, 13)
    weights = np.r_[0.6, 0.04 * np.exp(-thresholds[1:] / 25.0)]
    saturating = 260.0 * np.tanh((u - 75.0) / 260.0)
    return mh.PrandtlIshlinskii(weights, thresholds).forward().run(saturating)


BENCHES = [
    Bench("paper", -500.0, 500.0, _paper),
    Bench("unipolar", 0.0, 150.0, _unipolar),
    Bench("Bouc-Wen", 0.0, 150.0, _bouc_wen),
    Bench("behind tanh", 0.0, 150.0, _behind_tanh),
]
