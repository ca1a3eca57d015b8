"""A plant and the published control law, one float at a time, written from the equations.

u -> limits, D/A converter -> amplifier -> hysteresis -> dynamics -> position -> A/D converter

The amplifier and the dynamics are state-space systems, discretised for a held input by the matrix
exponential of the joint system; the hysteresis is the loop over all operators.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .dynamics import Matrix, matrix_exponential
from .models import Model


@dataclass
class Converter:
    """The nearest of 2^bits equally spaced levels from low to high, the upper one of two."""

    bits: int
    low: float
    high: float

    def __call__(self, value: float) -> float:
        intervals: int = 2**self.bits - 1
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        code: int = math.floor(share * intervals + 0.5)
        return self.low + (self.high - self.low) * (code / intervals)


class StateSpace:
    """x' = a x + b u from rest, exact for a u held over dt; the output is the first state."""

    def __init__(self, a: Matrix, b: Sequence[float], dt: float) -> None:
        joint = [[*(value * dt for value in row), g * dt] for row, g in zip(a, b, strict=True)]
        self.transition = matrix_exponential([*joint, [0.0] * (len(a) + 1)])[: len(a)]
        self.state = [0.0] * len(a)

    def step(self, u: float) -> float:
        held = [*self.state, u]
        self.state = [sum(p * q for p, q in zip(row, held, strict=True)) for row in self.transition]
        return self.state[0]


def first_order(frequency: float, dt: float) -> StateSpace:
    """y' = w (u - y)."""
    w = 2.0 * math.pi * frequency
    return StateSpace([[-w]], [w], dt)


def second_order(frequency: float, damping: float, dt: float) -> StateSpace:
    """y'' + 2 zeta w y' + w^2 y = w^2 u; the states are y and y' / w."""
    w = 2.0 * math.pi * frequency
    return StateSpace([[0.0, w], [-w, -2.0 * damping * w]], [0.0, w], dt)


class Plant:
    """Noise-free, at rest at zero. ``sub_steps`` hold the mean of the hysteresis at their ends.

    Without an amplifier a held drive makes the hysteresis constant: one step is exact.
    """

    def __init__(
        self,
        hysteresis: Model,
        frequency: float,
        damping: float,
        dt: float,
        *,
        amplifier_bandwidth: float | None = None,
        sub_steps: int = 1,
        dac: Converter | None = None,
        adc: Converter | None = None,
    ) -> None:
        self.hysteresis, self.dac, self.adc, self.sub_steps = hysteresis, dac, adc, sub_steps
        self.dynamics = second_order(frequency, damping, dt / sub_steps)
        pole = amplifier_bandwidth
        self.amplifier = None if pole is None else first_order(pole, dt / sub_steps)
        self.displacement = self.position = 0.0

    @property
    def measured(self) -> float:
        return self.position if self.adc is None else self.adc(self.position)

    def step(self, drive: float) -> None:
        u = drive if self.dac is None else self.dac(drive)
        if self.amplifier is None:
            self.position = self.dynamics.step(self.hysteresis.step(u))
            return
        for _ in range(self.sub_steps):
            displacement = self.hysteresis.step(self.amplifier.step(u))
            self.position = self.dynamics.step((self.displacement + displacement) / 2.0)
            self.displacement = displacement


class PositionalLaw:
    """u(k) = F[r(k)] + kp e(k) + ki sum_(j<=k) e(j), e = reference - measurement."""

    def __init__(self, feed_forward: Callable[[float], float], kp: float, ki: float) -> None:
        self.feed_forward, self.kp, self.ki, self.sum = feed_forward, kp, ki, 0.0

    def step(self, reference: float, measurement: float) -> float:
        error = reference - measurement
        self.sum += error
        return self.feed_forward(reference) + self.kp * error + self.ki * self.sum


def closed_loop(
    plant: Plant, law: PositionalLaw, reference: Sequence[float]
) -> tuple[list[float], list[float], list[float]]:
    """Measured, position and drive as commanded, of every sample."""
    measured, position, drive = [], [], []
    for r in reference:
        measured.append(plant.measured)
        position.append(plant.position)
        drive.append(law.step(r, plant.measured))
        plant.step(drive[-1])
    return measured, position, drive
