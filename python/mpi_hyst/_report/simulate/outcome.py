"""A simulated run with what was simulated, and its errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits, in_unit
from mpi_hyst._types import Samples


@dataclass(frozen=True)
class Setup:
    """The stage and the controller."""

    model: str
    stage: str
    reference: str
    limits: tuple[float, float]
    dynamics: tuple[float, float] | None
    amplifier_bandwidth: float | None
    delay: float
    noise: float
    seed: int
    gains: tuple[float, float]
    tuned: bool
    inverse: bool
    ahead: int


@dataclass(frozen=True)
class Outcome:
    """A run and what it was made with."""

    run: mh.plant.Run
    dt: float
    quantity: Quantity
    setup: Setup

    @property
    def seconds(self) -> Samples:
        """When each sample is taken, from zero on."""
        return np.arange(len(self.run), dtype=np.float64) * self.dt


def facts(outcome: Outcome) -> list[tuple[str, str]]:
    """Return what the stage and the controller were."""
    run, metrics, setup = outcome.run, outcome.run.metrics, outcome.setup
    low, high = setup.limits
    kp, ki = setup.gains
    feedforward = "none"
    if setup.inverse:
        feedforward = f"exact inverse of {setup.model}"
        feedforward += f", {setup.ahead} samples of preview" if setup.ahead else ""
    return [
        ("samples", f"{len(run)} at {1.0 / outcome.dt:.6g} Hz, from rest"),
        ("stage", ", ".join([setup.stage, *_stage(setup, outcome.quantity.unit)])),
        ("feed-forward", feedforward),
        ("gains", f"kp {digits(kp)}, ki {digits(ki)}, {'tuned' if setup.tuned else 'given'}"),
        ("drive", f"{digits(metrics.drive_low)} to {digits(metrics.drive_high)}"),
        ("saturated", f"{metrics.saturated_count} of {len(run)} samples at {low:g} or {high:g}"),
    ]


def _stage(setup: Setup, unit: str) -> list[str]:
    parts = []
    if setup.dynamics is not None:
        frequency, damping = setup.dynamics
        parts.append(f"dynamics {frequency:g} Hz, {damping:g}")
    if setup.amplifier_bandwidth is not None:
        parts.append(f"amplifier {setup.amplifier_bandwidth:g} Hz")
    if setup.delay:
        parts.append(f"delay {setup.delay:g} samples")
    if setup.noise:
        parts.append(f"noise {in_unit(setup.noise, unit)} rms, seed {setup.seed}")
    return parts


def errors(outcome: Outcome) -> tuple[list[str], list[list[str]]]:
    """Return the errors, true and measured, as a table."""
    metrics, unit = outcome.run.metrics, outcome.quantity.unit
    suffix = f" {unit}" if unit else ""
    header = ["error", f"max{suffix}", f"rms{suffix}", "max %", "rms %", f"base{suffix}"]
    rows = []
    for name, largest, rms in (
        ("true position", metrics.max_position_error, metrics.position_rmse),
        ("measured", metrics.max_error, metrics.rmse),
    ):
        percents = [
            f"{100.0 * value / metrics.range:.3f}" if metrics.range else "-"
            for value in (largest, rms)
        ]
        rows.append([name, digits(largest), digits(rms), *percents, digits(metrics.range)])
    return header, rows
