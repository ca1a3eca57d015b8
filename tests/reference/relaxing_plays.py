"""Plays that relax in plain Python, from their equations.

z_i = max(min(z_i, u - origin + r_i), u - origin - r_i)
tau_j s_j' = sum_i v_ij z_i - s_j, r = sum_j s_j

Between samples the plays are held: s_j comes nearer to its target as exp(-t / tau_j).
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass
class RelaxingPlays:
    """The arguments of mh.plant.RelaxingPlays, and a sampling interval in seconds."""

    thresholds: list[float]
    time_constants: list[float]
    weights: list[list[float]]
    origin: float
    dt: float

    def __post_init__(self) -> None:
        self.settle(0.0)

    def settle(self, drive: float) -> None:
        """At rest since forever: virgin but for the way there."""
        self.plays = [0.0 for _ in self.thresholds]
        self._move(drive)
        self.relaxed = self._targets()

    def _move(self, drive: float) -> None:
        x = drive - self.origin
        both = zip(self.plays, self.thresholds, strict=True)
        self.plays = [max(min(play, x + r), x - r) for play, r in both]

    def _targets(self) -> list[float]:
        rows = (zip(row, self.plays, strict=True) for row in self.weights)
        return [sum(weight * play for weight, play in row) for row in rows]

    def step(self, drive: float, position: float) -> float:
        """Return the position with what has relaxed; then the drive is held for one interval."""
        moved = position + sum(self.relaxed)
        self._move(drive)
        lags = zip(self.relaxed, self._targets(), self.time_constants, strict=True)
        self.relaxed = [
            target + math.exp(-self.dt / tau) * (relaxed - target) for relaxed, target, tau in lags
        ]
        return moved
