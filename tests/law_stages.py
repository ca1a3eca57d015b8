"""Stages of twelve kinds, each simulated by a few lines of its own, and records of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import mpi_hyst as mh
import numpy as np
from support import Array

DT = 2e-3  # s
NOISE = 5e-4  # of the range


@dataclass(frozen=True)
class Stage:
    name: str
    low: float
    high: float
    position: Callable[[Array], Array]


def plays(u: Array, thresholds: Array, weights: Array) -> Array:
    return mh.PrandtlIshlinskii(weights, thresholds).forward().run(u)


def usual(u: Array, half: float = 50.0) -> Array:
    """Plays of a piezo stack over a range of twice half."""
    thresholds = np.linspace(0.0, 0.9 * half, 19)
    return plays(u, thresholds, np.r_[0.6, 0.04 * np.exp(-thresholds[1:] / (0.5 * half))])


def lagged(x: Array, time: float, dt: float = DT) -> Array:
    """Return x behind a lag of first order, at rest at its first value."""
    share, out, last = -np.expm1(-dt / time), np.empty(x.size), x[0]
    for k, now in enumerate(x.tolist()):
        out[k] = last
        last += share * (now - last)
    return out


def ringing(x: Array, frequency: float, damping: float) -> Array:
    """Return x behind a mode, in small steps of a held input."""
    w, n = 2.0 * np.pi * frequency, 40
    h, p, v, out = DT / n, x[0], 0.0, np.empty(x.size)
    for k, now in enumerate(x.tolist()):
        out[k] = p
        for _ in range(n):
            v += h * (w * w * (now - p) - 2.0 * damping * w * v)
            p += h * v
    return out


def bouc_wen(u: Array) -> Array:
    h, last, out = 0.0, float(u[0]), np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        steps = max(1, int(abs(now - last) / 0.2))
        du = (now - last) / steps
        for _ in range(steps):
            h += du - 0.03 * abs(du) * h - 0.012 * du * abs(h)
        last = now
        out[k] = 0.8 * now - 0.4 * h
    return out


def preisach(u: Array) -> Array:
    """Relays of random thresholds that are drawn once, and a line."""
    rng = np.random.default_rng(8)
    up = rng.uniform(-50.0, 50.0, 400)
    down = up - rng.exponential(25.0, 400)
    state, out = np.where(u[0] >= up, 1.0, -1.0), np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        state = np.where(now >= up, 1.0, np.where(now <= down, -1.0, state))
        out[k] = state.mean()
    return 20.0 * out + 0.5 * u


def curved(x: Array) -> Array:
    return x + 2.5e-3 * x**2 + 2e-5 * x**3


def creeping(u: Array) -> Array:
    x = usual(u)
    return x + sum(0.012 * lagged(x, time) for time in (0.1, 1.0, 10.0))


def screw(u: Array) -> Array:
    """Backlash, and an error with the pitch of the screw."""
    x = plays(u, np.array([0.0, 1.5]), np.array([0.0, 1.0]))
    return np.asarray(x + 0.4 * np.sin(2.0 * np.pi * x / 24.0))


STAGES = [
    Stage("plays", -50.0, 50.0, usual),
    Stage("plays to one side", 0.0, 100.0, usual),
    Stage("Bouc-Wen", -50.0, 50.0, bouc_wen),
    Stage("relays", -50.0, 50.0, preisach),
    Stage("saturating drive", -50.0, 50.0, lambda u: usual(45.0 * np.tanh(u / 45.0))),
    Stage("curved position", -50.0, 50.0, lambda u: curved(usual(u))),
    Stage("creep of three decades", -50.0, 50.0, creeping),
    Stage("lag behind", -50.0, 50.0, lambda u: lagged(usual(u), 8e-3)),
    Stage("lag in front", -50.0, 50.0, lambda u: usual(lagged(u, 1.2e-2))),
    Stage("mode", -50.0, 50.0, lambda u: ringing(usual(u), 40.0, 0.05)),
    Stage("mode of a square", 0.0, 100.0, lambda u: ringing(usual(u) ** 2 / 60.0, 40.0, 0.05)),
    Stage("one side curved", -50.0, 50.0, lambda u: usual(u) + 0.002 * np.maximum(u, 0.0) ** 2),
]


def named(name: str) -> Stage:
    return next(stage for stage in STAGES if stage.name == name)


def way(corners: list[float], speed: float) -> Array:
    """Straight moves from corner to corner."""
    moves = [
        np.linspace(a, b, max(1, math.ceil(abs(b - a) / (speed * DT))), endpoint=False)
        for a, b in pairwise(corners)
    ]
    return np.concatenate([*moves, corners[-1:]])


def decaying(ends: tuple[float, float], samples: int, frequency: float, speed: float) -> Array:
    """A sine about the middle that decays from the whole range to a tenth of it.

    The way to the middle is of this speed.
    """
    middle, half = 0.5 * (ends[1] + ends[0]), 0.5 * (ends[1] - ends[0])
    size, t = np.linspace(1.0, 0.1, samples), np.arange(samples) * DT
    sine = middle + half * size * np.sin(2.0 * np.pi * frequency * t)
    return np.concatenate([way([0.0, middle], speed), sine])


def activated_cells(u: Array, dt: float) -> Array:
    """Relays that heat makes jump: their loops widen by as much with every decade of rate."""
    rng, heat = np.random.default_rng(3), 0.7
    middle, half = rng.normal(0.0, 22.0, 600), np.abs(rng.normal(14.0, 6.0, 600))
    up, down = middle + half, middle - half
    m, out, elapsed = np.sign(u[0] - middle), np.empty(u.size), 10.0
    for k, now in enumerate(u.tolist()):
        rise = np.exp(np.clip((now - up) / heat, -40.0, 20.0))
        fall = np.exp(np.clip((down - now) / heat, -40.0, 20.0))
        rest = (rise - fall) / (rise + fall)
        m = rest + np.exp(-elapsed * (rise + fall)) * (m - rest)
        out[k], elapsed = m.mean(), dt
    return 0.4 * u + 25.0 * out


def loops(stage: Stage, sizes: list[float]) -> Array:
    """Return straight loops about the middle, at 2 Hz for a full one."""
    middle, half = 0.5 * (stage.low + stage.high), 0.5 * (stage.high - stage.low)
    corners = [0.0]
    for size in sizes:
        corners += [middle + half * size, middle - half * size]
    step = 8.0 * half * DT
    ways = [
        np.linspace(a, b, max(2, round(abs(b - a) / step)), endpoint=False)
        for a, b in pairwise(corners)
    ]
    return np.concatenate([*ways, [corners[-1]]])


def alike(stage: Stage) -> Array:
    return loops(stage, [1.0] * 3)


def varied(stage: Stage) -> Array:
    return loops(stage, [1.0, 0.8, 0.6, 0.4, 0.2, 0.5, 0.9, 0.3, 0.7])


def measured(stage: Stage, u: Array, seed: int = 3) -> Array:
    y = stage.position(u)
    return y + np.random.default_rng(seed).normal(0.0, NOISE * np.ptp(y), u.size)
