"""What the benches have in common: actuator, signals, and the loops without this package.

Both loops evaluate all coupled plays for every sample, equation (5), from rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import mpi_hyst as mh
import numba
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

OPERATORS = (20, 100, 1000)

SAMPLES = 10_000
RATE = 10_000.0  # Hz


@dataclass(frozen=True)
class Parameters:
    """Weights and thresholds as plain arrays: what a loop over operators needs."""

    weights: Array
    r: Array
    ra: Array
    rb: Array
    rc: Array

    @classmethod
    def of(cls, n: int) -> Parameters:
        """An actuator like the paper's with n operators over ±500 V, in µm."""
        r = 500.0 * np.arange(n) / n
        weights = np.where(np.arange(n) == 0, 4.3e-3, 3.2e-3 / n)
        return cls(weights, r, 0.95 * r, 0.3 * 0.95 * r, 0.35 * r)

    def model(self) -> mh.ModifiedPrandtlIshlinskii:
        """The same parameters as a model."""
        return mh.ModifiedPrandtlIshlinskii(self.weights, self.r, self.ra, self.rb, self.rc)


def _signals() -> dict[str, Array]:
    time = np.arange(SAMPLES) / RATE
    decay = np.linspace(1.0, 0.0, SAMPLES)
    noise = np.random.default_rng(1).normal(0.0, 0.1, SAMPLES)
    return {
        "1 Hz sine, decaying": 500.0 * decay * np.sin(2.0 * np.pi * time),
        "50 Hz sine + 0.1 V noise": 500.0 * np.sin(100.0 * np.pi * time) + noise,
    }


SIGNALS = _signals()
"""Drives in V, sampled at 10 kHz."""


@numba.njit
def numba_loop(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, y: Array
) -> None:
    """The loop over samples and operators, compiled; y takes the result."""
    z = np.zeros(weights.size)
    for k in range(x.size):
        total = 0.0
        for i in range(weights.size):
            low = max(x[k] - r[i], min(0.0, x[k] - rc[i]))
            high = min(x[k] + ra[i], max(0.0, x[k] + rb[i]))
            z[i] = max(low, min(high, z[i]))
            total += weights[i] * z[i]
        y[k] = total


@numba.njit
def numba_two_passes(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, y: Array
) -> None:
    """The same with the sum in a loop of its own, so that the compiler can vectorise the first."""
    z = np.zeros(weights.size)
    for k in range(x.size):
        for i in range(weights.size):
            low = max(x[k] - r[i], min(0.0, x[k] - rc[i]))
            high = min(x[k] + ra[i], max(0.0, x[k] + rb[i]))
            z[i] = max(low, min(high, z[i]))
        total = 0.0
        for i in range(weights.size):
            total += weights[i] * z[i]
        y[k] = total


@numba.njit
def numba_array(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, z: Array, y: Array
) -> None:
    """One sample for each of many actuators, z their operators, a row for each."""
    for j in range(x.size):
        total = 0.0
        for i in range(weights.size):
            low = max(x[j] - r[i], min(0.0, x[j] - rc[i]))
            high = min(x[j] + ra[i], max(0.0, x[j] + rb[i]))
            z[j, i] = max(low, min(high, z[j, i]))
            total += weights[i] * z[j, i]
        y[j] = total


def numpy_loop(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, y: Array
) -> None:
    """A Python loop over samples, each on all operators at once."""
    z = np.zeros(weights.size)
    for k, sample in enumerate(x):
        low = np.maximum(sample - r, np.minimum(0.0, sample - rc))
        high = np.minimum(sample + ra, np.maximum(0.0, sample + rb))
        z = np.maximum(low, np.minimum(high, z))
        y[k] = weights @ z


LOOPS = {
    "numba": numba_loop,
    "numba, two passes": numba_two_passes,
    "numpy": numpy_loop,
}


def same(got: Array, expected: Array) -> bool:
    """Equal to 1e-12 of the range: far above rounding, far below any error of a loop."""
    return bool(np.abs(got - expected).max() <= 1e-12 * np.ptp(expected))
