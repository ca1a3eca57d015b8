"""The loop shift in plain Python, from its differential equations.

x = (u - center) / half_range
f' = (x - f) / theta, theta = tau / 4, never farther from x than the limit; e = x - f
m' = (e^2 - m) / tau, n' = (x |e| - n) / tau, s = c_1 m + c_2 n

Between samples x is constant. So e^2 and |e| decay as exp(-2 t / theta) and exp(-t / theta), and
each mean is linear in itself and in one of them: the matrix exponential of both is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .dynamics import matrix_exponential


@dataclass
class LoopShift:
    """The arguments of mh.plant.LoopShift, and a sampling interval in seconds."""

    center: float
    half_range: float
    amplitudes: tuple[float, float]
    time_constant: float
    limit: float
    dt: float

    def __post_init__(self) -> None:
        h = self.dt / self.time_constant
        self.square = matrix_exponential([[-h, h], [0.0, -8.0 * h]])[0]
        self.product = matrix_exponential([[-h, h], [0.0, -4.0 * h]])[0]
        self.settle(self.center)

    def settle(self, drive: float) -> None:
        """At rest since forever."""
        self.follower = (drive - self.center) / self.half_range
        self.mean_square = self.mean_product = 0.0

    @property
    def shift(self) -> float:
        """s of now, whatever drive comes."""
        return self.amplitudes[0] * self.mean_square + self.amplitudes[1] * self.mean_product

    def step(self, drive: float) -> float:
        """s of now; then the drive is held for one interval."""
        shift = self.shift
        x = (drive - self.center) / self.half_range
        behind = min(max(x - self.follower, -self.limit), self.limit)
        keeps, takes = self.square
        self.mean_square = keeps * self.mean_square + takes * behind**2
        keeps, takes = self.product
        self.mean_product = keeps * self.mean_product + takes * x * abs(behind)
        self.follower = x - behind * math.exp(-4.0 * self.dt / self.time_constant)
        return shift
