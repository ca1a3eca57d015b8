"""Stages of four kinds of physics, simulated apart from the library in small steps.

Converters of 16 bits, an amplifier of first order, hysteresis, one mode, creep, a dead time and
noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lfilter
from support import Array

Hysteresis = Callable[[Array], Array]

STEP = 1.25e-4  # s, of the simulation
HIGH = 150.0  # V: the drive is 0 to HIGH
STROKE = 100.0  # um
FREQUENCY, DAMPING = 80.0, 0.02
DEAD_TIME = 1e-3  # s
NOISE = 0.02  # um
CREEP = 0.012  # of a step, per decade
CREEP_TIMES = np.geomspace(0.01, 100.0, 8)  # s


def operators(
    lower: Callable[[float], Array], upper: Callable[[float], Array], drive: Array
) -> Array:
    """Return the outputs z(k) = max(lower, min(upper, z(k - 1))) of operators at rest at 0."""
    z = np.zeros_like(lower(0.0))
    rows = []
    for u in drive.tolist():
        z = np.maximum(lower(u), np.minimum(upper(u), z))
        rows.append(z)
    return np.array(rows)


def coupled_plays(drive: Array) -> Array:
    """Forty coupled plays: equations (5) and (6)."""
    r = HIGH * np.arange(40) / 40
    weights = np.r_[1.0, 0.05 * np.exp(-2.0 * r[1:] / HIGH)]
    ra, rb, rc = 0.9 * r, 0.45 * r, 0.6 * r
    z = operators(
        lambda u: np.maximum(u - r, np.minimum(0.0, u - rc)),
        lambda u: np.minimum(u + ra, np.maximum(0.0, u + rb)),
        drive,
    )
    output: Array = z @ weights
    return output


def play_behind_tanh(drive: Array) -> Array:
    """A generalised play: the drive is bent before the plays."""
    r = np.linspace(0.0, 60.0, 21)
    weights = np.r_[0.8, 0.05 * np.exp(-r[1:] / 40.0)]
    bent = 200.0 * (np.tanh((drive - 60.0) / 200.0) + np.tanh(0.3))
    output: Array = operators(lambda u: u - r, lambda u: u + r, bent) @ weights
    return output


def bouc_wen(drive: Array) -> Array:
    """x = u - 0.8 z, dz = (0.35 - (0.008 + 0.022 sign(z du)) |z|) du."""
    z, last, rows = 0.0, 0.0, []
    for u in drive.tolist():
        du = u - last
        z += 0.35 * du - 0.022 * abs(du) * z - 0.008 * du * abs(z)
        last = u
        rows.append(u - 0.8 * z)
    return np.array(rows)


def rate_dependent(drive: Array) -> Array:
    """Plays whose thresholds grow with the speed of the drive, seen through a lag of 20 ms."""
    r = np.linspace(0.0, 50.0, 11)[1:]
    weights = 0.06 * np.exp(-r / 40.0)
    decay = np.exp(-STEP / 0.02)
    speed = lfilter([1.0 - decay], [1.0, -decay], np.abs(np.diff(drive, prepend=0.0)) / STEP)
    z, rows = np.zeros(r.size), []
    for u, growth in zip(drive.tolist(), (1.0 + 9e-4 * speed).tolist(), strict=True):
        z = np.maximum(u - r * growth, np.minimum(u + r * growth, z))
        rows.append(0.6 * u + weights @ z)
    return np.array(rows)


@dataclass(frozen=True)
class PhysicalStage:
    """A stage that rests at 0 V, and what it is made of."""

    hysteresis: Hysteresis
    amplifier: float  # Hz

    def scale(self) -> float:
        """Return the um of a unit of the hysteresis."""
        way = np.r_[np.arange(0.0, HIGH, 0.05), np.arange(HIGH, 0.0, -0.05)]
        return STROKE / float(np.ptp(self.hysteresis(way)))

    def position(self, drive: Array, dt: float) -> Array:
        """Return the true position at every sample of a drive that is held in between."""
        held = np.repeat(rounded(drive, HIGH), round(dt / STEP))
        voltage = through_lag(held, 1.0 / (2.0 * np.pi * self.amplifier))
        h = self.scale() * self.hysteresis(voltage)
        x = through_mode(h - h[0])
        share = CREEP * np.log10(CREEP_TIMES[-1] / CREEP_TIMES[0]) / CREEP_TIMES.size
        x = x + share * sum(through_lag(x, tau) for tau in CREEP_TIMES)
        late = round(DEAD_TIME / STEP)
        delayed: Array = np.r_[np.zeros(late), x[:-late]]
        return delayed[:: round(dt / STEP)]

    def measured(self, drive: Array, dt: float, seed: int) -> Array:
        """Return the position with noise, from a converter of 16 bits."""
        noise = np.random.default_rng(seed).normal(0.0, NOISE, drive.size)
        return rounded(self.position(drive, dt) + noise, 1.7 * STROKE)


def rounded(values: Array, span: float) -> Array:
    bit = span / 2.0**16
    steps: Array = np.round(values / bit)
    return steps * bit


def through_lag(signal: Array, time_constant: float) -> Array:
    decay = np.exp(-STEP / time_constant)
    answer: Array = lfilter([0.0, 1.0 - decay], [1.0, -decay], signal)
    return answer


def through_mode(signal: Array) -> Array:
    w = 2.0 * np.pi * FREQUENCY
    continuous = ([w * w], [1.0, 2.0 * DAMPING * w, w * w])
    numerator, denominator, _ = cont2discrete(continuous, STEP, "zoh")
    answer: Array = lfilter(numerator.ravel(), denominator, signal)
    return answer


STAGES = {
    "coupled plays": PhysicalStage(coupled_plays, 500.0),
    "play behind a tanh": PhysicalStage(play_behind_tanh, 500.0),
    "Bouc-Wen, slow amplifier": PhysicalStage(bouc_wen, 40.0),
    "thresholds that grow with speed": PhysicalStage(rate_dependent, 500.0),
}
