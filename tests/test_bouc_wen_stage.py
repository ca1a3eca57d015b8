"""Bouc-Wen hysteresis behind an amplifier of 400 Hz, with a mode of 2.5 kHz, by default calls."""

from __future__ import annotations

import math

import mpi_hyst as mh
import numpy as np
import pytest
from law_stages import Stage, loops
from support import Array

DT = 5e-5  # s
SUB_STEPS = 10
HALF = 50.0  # V
NOISE = 2e-2  # um
AMPLIFIER, MODE, DAMPING = 400.0, 2500.0, 0.02


class Plant:
    """A lag, the piezo form 0.8 v - 0.4 h of Bouc-Wen, and a mode, in small steps."""

    def __init__(self) -> None:
        self.v = self.h = self.p = self.speed = 0.0

    def advance(self, u: float) -> float:
        """Hold a drive for an interval, and return the position at its end."""
        step, w = DT / SUB_STEPS, 2.0 * math.pi * MODE
        share = -math.expm1(-2.0 * math.pi * AMPLIFIER * step)
        for _ in range(SUB_STEPS):
            dv = share * (u - self.v)
            self.v += dv
            self.h += dv - 0.03 * abs(dv) * self.h - 0.012 * dv * abs(self.h)
            x = 0.8 * self.v - 0.4 * self.h
            self.speed += step * (w * w * (x - self.p) - 2.0 * DAMPING * w * self.speed)
            self.p += step * self.speed
        return self.p

    def positions(self, drives: Array) -> Array:
        """Return y(k), then hold u(k): a record."""
        rows = [self.p, *(self.advance(u) for u in drives.tolist())]
        return np.array(rows[:-1])


def record() -> tuple[Array, Array]:
    """Return loops of nine sizes, then a chirp to 4 kHz, and what was measured."""
    kind = Stage("", -HALF, HALF, lambda u: u)
    corners = loops(kind, [1.0, 0.8, 0.6, 0.4, 0.2, 0.5, 0.9, 0.3, 0.7])
    # 20 times as fast as there.
    slow = np.interp(np.arange(0.0, corners.size - 1, 0.5), np.arange(corners.size), corners)
    t = DT * np.arange(round(0.5 / DT))
    chirp = 4.0 * np.sin(2.0 * np.pi * (10.0 * t + 0.5 * (3990.0 / 0.5) * t**2))
    u = np.concatenate([slow, chirp])
    y = Plant().positions(u)
    return u, y + np.random.default_rng(3).normal(0.0, NOISE, u.size)


def raster(periods: int) -> Array:
    """Return a raster of 10 Hz with rounded corners, from its middle on."""
    phase = np.sin(2.0 * np.pi * 10.0 * DT * np.arange(round(periods * 0.1 / DT)))
    wave: Array = np.arcsin(0.98 * phase) / np.arcsin(0.98)
    return wave


def rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


@pytest.mark.slow
def test_rasters_in_open_and_closed_loop() -> None:
    u, y = record()
    stage = mh.identify(u, y, dt=DT).stage.replace(limits=(-HALF, HALF))
    stroke = float(np.ptp(y[: u.size // 2]))
    target = 0.35 * stroke * raster(4)  # over 70 % of it
    half = target.size // 2
    reached = Plant().positions(stage.precompensate(target, dt=DT, lead_in=0.1))
    open_loop = rms(reached[-half:] - target[-half:]) / stroke
    controller, plant, position, errors = stage.controller(DT), Plant(), 0.0, []
    noise = np.random.default_rng(4).normal(0.0, NOISE, target.size)
    for r, n in zip(target.tolist(), noise.tolist(), strict=True):
        errors.append(position - r)
        position = plant.advance(controller.step(r, position + n))
    closed_loop = rms(np.array(errors[-half:])) / stroke
    assert open_loop < 4e-3
    assert closed_loop < max(3e-4, 0.5 * NOISE / stroke)
