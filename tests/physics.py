"""Stages of five kinds of physics, simulated apart from the library in small steps.

Converters of 16 bits, an amplifier of first order, hysteresis, one mode, creep, a dead time and
noise. A `Bench` goes on sample by sample, as the device on a table would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lfilter
from support import Array

# The outputs of a hysteresis at drives in small steps; it remembers what came before.
Hysteresis = Callable[[Array], Array]

STEP = 1.25e-4  # s, of the simulation
HIGH = 150.0  # V: the drive is 0 to HIGH
STROKE = 100.0  # um
DAMPING = 0.02
DEAD_TIME = 1e-3  # s
NOISE = 0.02  # um
CREEP = 0.012  # of a step, per decade
CREEP_TIMES = np.geomspace(0.01, 100.0, 8)  # s


def operators(lower: Callable[[float], Array], upper: Callable[[float], Array]) -> Hysteresis:
    """Return operators z(k) = max(lower, min(upper, z(k - 1))) from rest at 0, one a column."""
    z = np.zeros_like(lower(0.0))

    def outputs(drive: Array) -> Array:
        nonlocal z
        rows = []
        for u in drive.tolist():
            z = np.maximum(lower(u), np.minimum(upper(u), z))
            rows.append(z)
        return np.array(rows)

    return outputs


def coupled_plays() -> Hysteresis:
    """Forty coupled plays: equations (5) and (6)."""
    r = HIGH * np.arange(40) / 40
    weights = np.r_[1.0, 0.05 * np.exp(-2.0 * r[1:] / HIGH)]
    ra, rb, rc = 0.9 * r, 0.45 * r, 0.6 * r
    z = operators(
        lambda u: np.maximum(u - r, np.minimum(0.0, u - rc)),
        lambda u: np.minimum(u + ra, np.maximum(0.0, u + rb)),
    )
    return lambda drive: np.asarray(z(drive) @ weights)


def play_behind_tanh() -> Hysteresis:
    """A generalised play: the drive is bent before the plays."""
    r = np.linspace(0.0, 60.0, 21)
    weights = np.r_[0.8, 0.05 * np.exp(-r[1:] / 40.0)]
    z = operators(lambda u: u - r, lambda u: u + r)

    def outputs(drive: Array) -> Array:
        bent = 200.0 * (np.tanh((drive - 60.0) / 200.0) + np.tanh(0.3))
        return np.asarray(z(bent) @ weights)

    return outputs


def bouc_wen() -> Hysteresis:
    """x = u - 0.8 z, dz = (0.35 - (0.008 + 0.022 sign(z du)) |z|) du."""
    z = last = 0.0

    def outputs(drive: Array) -> Array:
        nonlocal z, last
        rows = []
        for u in drive.tolist():
            du = u - last
            z += 0.35 * du - 0.022 * abs(du) * z - 0.008 * du * abs(z)
            last = u
            rows.append(u - 0.8 * z)
        return np.array(rows)

    return outputs


def rate_dependent() -> Hysteresis:
    """Plays whose thresholds grow with the speed of the drive, seen through a lag of 20 ms."""
    r = np.linspace(0.0, 50.0, 11)[1:]
    weights = 0.06 * np.exp(-r / 40.0)
    speed, z, last = Lag(0.02, ahead=True), np.zeros(r.size), 0.0

    def outputs(drive: Array) -> Array:
        nonlocal z, last
        steps = np.diff(drive, prepend=last)
        last = float(drive[-1])
        rows = []
        for u, growth in zip(drive, 1.0 + 9e-4 * speed(np.abs(steps) / STEP), strict=True):
            z = np.maximum(u - r * growth, np.minimum(u + r * growth, z))
            rows.append(0.6 * u + weights @ z)
        return np.array(rows)

    return outputs


class Filter:
    """A linear filter that remembers."""

    def __init__(self, numerator: Array, denominator: Array) -> None:
        self.coefficients = (numerator, denominator)
        self.state = np.zeros(denominator.size - 1)

    def __call__(self, signal: Array) -> Array:
        answer, self.state = lfilter(*self.coefficients, signal, zi=self.state)
        return np.asarray(answer)


class Lag(Filter):
    """A lag of first order: its step comes with the sample that is `ahead`, or with the next."""

    def __init__(self, time_constant: float, *, ahead: bool = False) -> None:
        decay = np.exp(-STEP / time_constant)
        numerator = [1.0 - decay, 0.0] if ahead else [0.0, 1.0 - decay]
        super().__init__(np.array(numerator), np.array([1.0, -decay]))


class Mode(Filter):
    """A mode with a static gain of 1."""

    def __init__(self, frequency: float) -> None:
        w = 2.0 * np.pi * frequency
        continuous = ([w * w], [1.0, 2.0 * DAMPING * w, w * w])
        numerator, denominator, _ = cont2discrete(continuous, STEP, "zoh")
        super().__init__(numerator.ravel(), denominator)


@dataclass(frozen=True)
class PhysicalStage:
    """A stage that rests at 0 V, and what it is made of."""

    hysteresis: Callable[[], Hysteresis]
    amplifier: float  # Hz
    frequency: float = 80.0  # Hz

    def scale(self) -> float:
        """Return the um of a unit of the hysteresis."""
        way = np.r_[np.arange(0.0, HIGH, 0.05), np.arange(HIGH, 0.0, -0.05)]
        return STROKE / float(np.ptp(self.hysteresis()(way)))

    def measured(self, drive: Array, dt: float, seed: int) -> Array:
        """Return the position with noise, from a converter of 16 bits."""
        noise = np.random.default_rng(seed).normal(0.0, NOISE, drive.size)
        return rounded(Bench(self, dt).positions(drive) + noise, 1.7 * STROKE)


class Bench:
    """A stage at rest at 0 V, and the converters that it hangs on."""

    def __init__(self, stage: PhysicalStage, dt: float, seed: int = 0) -> None:
        self.steps = round(dt / STEP)
        self.scale = stage.scale()
        self.amplifier = Lag(1.0 / (2.0 * np.pi * stage.amplifier))
        self.hysteresis = stage.hysteresis()
        self.rest = float(self.hysteresis(np.zeros(1))[0])
        self.mode = Mode(stage.frequency)
        self.creep = [Lag(tau) for tau in CREEP_TIMES]
        self.late = np.zeros(round(DEAD_TIME / STEP))
        self.noise = np.random.default_rng(seed)
        self.position = 0.0

    def positions(self, drive: Array) -> Array:
        """Return the true position at every sample of a drive that is held in between."""
        held = np.repeat(rounded(drive, HIGH), self.steps)
        x = self.mode(self.scale * (self.hysteresis(self.amplifier(held)) - self.rest))
        share = CREEP * np.log10(CREEP_TIMES[-1] / CREEP_TIMES[0]) / CREEP_TIMES.size
        x = np.r_[self.late, x + share * sum(lag(x) for lag in self.creep)]
        self.late = x[held.size :]
        positions: Array = x[: held.size : self.steps]
        self.position = float(x[held.size])
        return positions

    def read(self) -> float:
        noisy = np.array([self.position + self.noise.normal(0.0, NOISE)])
        return float(rounded(noisy, 1.7 * STROKE)[0])

    def write(self, drive: float) -> None:
        self.positions(np.array([drive]))


def rounded(values: Array, span: float) -> Array:
    bit = span / 2.0**16
    steps: Array = np.round(values / bit)
    return steps * bit


STAGES = {
    "coupled plays": PhysicalStage(coupled_plays, 500.0),
    "play behind a tanh": PhysicalStage(play_behind_tanh, 500.0),
    "Bouc-Wen, slow amplifier": PhysicalStage(bouc_wen, 40.0),
    "thresholds that grow with speed": PhysicalStage(rate_dependent, 500.0),
    "a mode at 60 Hz": PhysicalStage(coupled_plays, 500.0, frequency=60.0),
}
