"""The slow gain in plain Python, from its differential equations.

x = u / half_range
f' = (x - f) / theta, theta = tau / 4, never farther from x than 1; e = x - f
m' = (e^2 - m) / tau, v = zero + (1 + amplitude m) (h - zero)

Between samples x is constant. So e^2 decays as exp(-2 t / theta), and m is linear in itself and in
it: the matrix exponential of both is exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .dynamics import matrix_exponential


@dataclass
class SlowGain:
    """The arguments of mh.plant.SlowGain, and a sampling interval in seconds."""

    half_range: float
    amplitude: float
    zero: float
    time_constant: float
    dt: float

    def __post_init__(self) -> None:
        h = self.dt / self.time_constant
        self.square = matrix_exponential([[-h, h], [0.0, -8.0 * h]])[0]
        self.settle(0.0)

    def settle(self, drive: float) -> None:
        """At rest since forever."""
        self.follower = drive / self.half_range
        self.mean_square = 0.0

    def step(self, drive: float, position: float) -> float:
        """Return what the gain makes of a position; then the drive is held for one interval."""
        changed = self.zero + (1.0 + self.amplitude * self.mean_square) * (position - self.zero)
        x = drive / self.half_range
        behind = min(max(x - self.follower, -1.0), 1.0)
        keeps, takes = self.square
        self.mean_square = keeps * self.mean_square + takes * behind**2
        self.follower = x - behind * math.exp(-4.0 * self.dt / self.time_constant)
        return changed
