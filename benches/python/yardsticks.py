"""What the benches have in common: actuator, signals, and the loops without this package.

All loops evaluate all coupled plays for every sample, equation (5), from rest. numba compiles for
the processor it runs on, with fastmath and parallel off.
"""

from __future__ import annotations

import platform
from dataclasses import dataclass

import llvmlite.binding
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

    @classmethod
    def individual(cls, n: int, seed: int) -> Parameters:
        """An actuator of the same kind: each weight, and thresholds and ratios, up to 10 % away."""
        like, random = cls.of(n), np.random.default_rng(seed)
        reach, ra, rb, rc = random.uniform(0.9, 1.1, 4)
        r = reach * like.r
        weights = like.weights * random.uniform(0.9, 1.1, n)
        return cls(weights, r, 0.95 * ra * r, 0.3 * 0.95 * rb * r, 0.35 * rc * r)

    def model(self) -> mh.ModifiedPrandtlIshlinskii:
        """The same parameters as a model."""
        return mh.ModifiedPrandtlIshlinskii(self.weights, self.r, self.ra, self.rb, self.rc)


def _signals() -> dict[str, Array]:
    time = np.arange(SAMPLES) / RATE
    decay = np.linspace(1.0, 0.0, SAMPLES)
    random = np.random.default_rng(1)
    noise = random.normal(0.0, 0.1, SAMPLES)
    return {
        "1 Hz sine, decaying": 500.0 * decay * np.sin(2.0 * np.pi * time),
        "50 Hz sine + 0.1 V noise": 500.0 * np.sin(100.0 * np.pi * time) + noise,
        "white noise, full range": random.uniform(-500.0, 500.0, SAMPLES),
    }


SIGNALS = _signals()
"""Drives in V, sampled at 10 kHz."""


@numba.njit(fastmath=False, parallel=False)
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


@numba.njit(fastmath=False, parallel=False, inline="always")
def larger(a: float, b: float) -> float:
    """One instruction, which `max` is not because of NaN."""
    return a if a > b else b


@numba.njit(fastmath=False, parallel=False, inline="always")
def smaller(a: float, b: float) -> float:
    """One instruction, which `min` is not because of NaN."""
    return a if a < b else b


@numba.njit(fastmath=False, parallel=False)
def filled(values: Array, filler: float) -> Array:
    """The values, and as many fillers as make a multiple of four of them."""
    result = np.full(-(-values.size // 4) * 4, filler)
    result[: values.size] = values
    return result


@numba.njit(fastmath=False, parallel=False, inline="always")
def vectorised(
    sample: float,
    weights: Array,
    r: Array,
    ra: Array,
    rb: Array,
    rc: Array,
    z: Array,
    product: Array,
) -> float:
    """One sample in loops over operators that the compiler vectorises; their number is 4 k.

    Without fastmath a sum keeps its order, and its loop is not vectorised. So the loop over
    operators writes products, and four sums side by side add them.
    """
    for i in range(z.size):
        low = larger(sample - r[i], smaller(sample - rc[i], 0.0))
        high = smaller(sample + ra[i], larger(sample + rb[i], 0.0))
        z[i] = larger(low, smaller(high, z[i]))
        product[i] = weights[i] * z[i]
    a = b = c = d = 0.0
    for i in range(0, z.size, 4):
        a += product[i]
        b += product[i + 1]
        c += product[i + 2]
        d += product[i + 3]
    return (a + c) + (b + d)


@numba.njit(fastmath=False, parallel=False)
def numba_vectorised(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, y: Array
) -> None:
    """The loop over samples, with what is left of the last four operators filled up."""
    weights = filled(weights, 0.0)
    r, ra = filled(r, np.inf), filled(ra, np.inf)
    rb, rc = filled(rb, np.inf), filled(rc, np.inf)
    z, product = np.zeros(weights.size), np.zeros(weights.size)
    for k in range(x.size):
        y[k] = vectorised(x[k], weights, r, ra, rb, rc, z, product)


@numba.njit(fastmath=False, parallel=False)
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


@numba.njit(fastmath=False, parallel=False)
def numba_array_vectorised(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, z: Array, y: Array
) -> None:
    """The same, vectorised. The number of operators is a multiple of four."""
    product = np.zeros(weights.size)
    for j in range(x.size):
        y[j] = vectorised(x[j], weights, r, ra, rb, rc, z[j], product)


@numba.njit(fastmath=False, parallel=False)
def numba_individual(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, z: Array, y: Array
) -> None:
    """The same with a row of weights and thresholds for each actuator."""
    for j in range(x.size):
        total = 0.0
        for i in range(z.shape[1]):
            low = max(x[j] - r[j, i], min(0.0, x[j] - rc[j, i]))
            high = min(x[j] + ra[j, i], max(0.0, x[j] + rb[j, i]))
            z[j, i] = max(low, min(high, z[j, i]))
            total += weights[j, i] * z[j, i]
        y[j] = total


@numba.njit(fastmath=False, parallel=False)
def numba_individual_vectorised(
    x: Array, weights: Array, r: Array, ra: Array, rb: Array, rc: Array, z: Array, y: Array
) -> None:
    """The same, vectorised. The number of operators is a multiple of four."""
    product = np.zeros(z.shape[1])
    for j in range(x.size):
        y[j] = vectorised(x[j], weights[j], r[j], ra[j], rb[j], rc[j], z[j], product)


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
    "numba, vectorised": numba_vectorised,
    "numpy": numpy_loop,
}


ARRAY_LOOPS = {"numba": numba_array, "numba, vectorised": numba_array_vectorised}

# Apart from those above: one loop for both kinds, with rows of one for all, takes a third longer.
INDIVIDUAL_LOOPS = {"numba": numba_individual, "numba, vectorised": numba_individual_vectorised}


def instructions() -> str:
    """The instruction set for which numba compiles: that of this processor."""
    if platform.machine().lower() not in {"x86_64", "amd64"}:
        return platform.machine()
    has = llvmlite.binding.get_host_cpu_features().get
    if has("avx2") and has("fma"):
        return "x86-64-v4" if has("avx512f") else "x86-64-v3"
    return "x86-64"


def same(got: Array, expected: Array) -> bool:
    """Equal to 1e-12 of the range: far above rounding, far below any error of a loop."""
    return bool(np.abs(got - expected).max() <= 1e-12 * np.ptp(expected))
