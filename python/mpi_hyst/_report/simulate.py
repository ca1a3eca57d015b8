"""A simulated run, for the terminal and as a page: reference, position, error and drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from mpi_hyst._core import Run, Tuning
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import closed_loop
from mpi_hyst._report.page import Card, Provenance, Rows, hashed_arrays, made_with, render
from mpi_hyst._text import digits, in_unit, span
from mpi_hyst._types import Samples

BASE = "% of the base: the peak-to-peak range of the reference"


@dataclass(frozen=True)
class Setup:
    """The simulated stage and its controller. Files are given by their paths.

    Of tuned gains `tuning` says more, where a report shows it.
    """

    stage: str
    plant: str
    reference: str
    limits: tuple[float, float]
    why: str
    """Why the limits are narrower than those of the stage, if they are."""
    linear_parts: Sequence[str]
    noise: float
    seed: int
    gains: tuple[float, float]
    tuned: bool
    tuning: Tuning | None
    feedforward: Literal["preview", "inverse", "none"]


@dataclass(frozen=True)
class Simulation:
    """A run and what it was made with."""

    whole: Run
    """With the lead-in."""
    dt: float
    quantity: Quantity
    setup: Setup | None = None
    """None for a run of which nothing else is known."""

    name: str = ""
    """What was followed on what."""
    drive: str = "drive"
    """The label of the drive."""
    drive_unit: str = ""
    lead_in_samples: int = 0
    """How many samples lie in front of the reference."""
    jump: float | None = None
    """How far from rest the reference begins, if it does."""

    @cached_property
    def run(self) -> Run:
        """The samples of the reference: those that errors and figures are of."""
        whole, before = self.whole, self.lead_in_samples
        if not before:
            return whole
        arrays = (whole.reference, whole.measured, whole.position, whole.drive)
        return Run(*(one[before:] for one in arrays), limits=whole.limits)

    @property
    def seconds(self) -> Samples:
        """The time of each sample of the whole, from zero at the beginning of the reference."""
        return np.arange(-self.lead_in_samples, len(self.run), dtype=np.float64) * self.dt


def facts(simulation: Simulation) -> list[tuple[str, str]]:
    """Return the facts about stage, controller and drive as names and values."""
    run, metrics, setup = simulation.run, simulation.run.metrics, simulation.setup
    if setup is None:
        return _of_run(simulation)
    low, high = setup.limits
    kp, ki = setup.gains
    unit = simulation.drive_unit
    per_error = f"{unit}/{simulation.quantity.unit}" if unit and simulation.quantity.unit else ""
    gains = [f"kp {in_unit(kp, per_error)}", f"ki {in_unit(ki, per_error and f'{per_error}/s')}"]
    feedforward = {
        "preview": f"inverse dynamics and exact inverse of {setup.stage}",
        "inverse": f"exact inverse of {setup.stage}",
        "none": "none",
    }[setup.feedforward]
    before = simulation.lead_in_samples
    return [
        ("samples", f"{len(run)} at {1.0 / simulation.dt:.6g} Hz, starting from rest"),
        *([("lead-in", f"{before} rows in front of the samples, not counted")] if before else []),
        ("stage", ", ".join([setup.plant, *setup.linear_parts, *_noise(simulation)])),
        ("feed-forward", feedforward),
        ("gains", ", ".join([*gains, "tuned" if setup.tuned else "given"])),
        ("drive", span(metrics.drive_low, metrics.drive_high, unit)),
        (
            "saturated",
            f"{metrics.saturated_count} of {len(run)} samples{_at((low, high), unit)}"
            + (f" ({setup.why})" if setup.why and metrics.saturated_count else ""),
        ),
    ]


def _of_run(simulation: Simulation) -> list[tuple[str, str]]:
    run, metrics, unit = simulation.run, simulation.run.metrics, simulation.drive_unit
    at = "" if run.limits is None else _at(run.limits, unit)
    return [
        ("samples", f"{len(run)} at {1.0 / simulation.dt:.6g} Hz"),
        ("drive", span(metrics.drive_low, metrics.drive_high, unit)),
        ("saturated", f"{metrics.saturated_count} of {len(run)} samples{at}"),
        ("without a reading", f"{metrics.missing_count} of {len(run)} samples"),
    ]


def _at(limits: tuple[float, float], unit: str) -> str:
    low, high = limits
    return f" at {low:g} or {high:g} {unit}".rstrip()


def _noise(simulation: Simulation) -> list[str]:
    setup = simulation.setup
    if setup is None or not setup.noise:
        return []
    return [f"noise {in_unit(setup.noise, simulation.quantity.unit)} rms (seed {setup.seed})"]


def errors(simulation: Simulation) -> Rows:
    """Return the errors of the true and of the measured position as a table."""
    metrics, unit = simulation.run.metrics, simulation.quantity.in_parentheses
    header = ["error", f"max{unit}", f"rms{unit}", "max (%)", "rms (%)", f"base{unit}"]
    rows = []
    for name, largest, rms in (
        ("true position", metrics.max_position_error, metrics.position_rmse),
        ("measured position", metrics.max_error, metrics.rmse),
    ):
        percents = [
            f"{100.0 * value / metrics.range:.3f}" if metrics.range else "-"
            for value in (largest, rms)
        ]
        rows.append([name, digits(largest), digits(rms), *percents, digits(metrics.range)])
    return header, rows


def report(simulation: Simulation, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    run, setup, unit = simulation.run, simulation.setup, simulation.quantity.unit
    metrics, limits = run.metrics, _limits(simulation)
    volts = simulation.drive_unit
    bounds = f"limits {limits[0]:g} to {limits[1]:g} {volts}".rstrip() if limits else ""
    rows = facts(simulation)
    tuning = None if setup is None else setup.tuning
    cards = [
        Card(in_unit(metrics.max_position_error, unit, 3), "largest error", "true position"),
        Card(in_unit(metrics.position_rmse, unit, 3), "rms error", "true position"),
        Card(dict(rows)["drive"], "drive", bounds),
        Card(str(metrics.saturated_count), "saturated samples", f"of {metrics.samples}"),
    ]
    return render(
        "simulate.html.j2",
        cards=cards,
        provenance=provenance,
        simulation=simulation,
        setup=setup,
        course=closed_loop.course_figure(_course(simulation)),
        errors=errors(simulation),
        base=BASE,
        facts=rows,
        tuning=None if tuning is None else closed_loop.tuning_figure(tuning),
    )


def _limits(simulation: Simulation) -> tuple[float, float] | None:
    return simulation.run.limits if simulation.setup is None else simulation.setup.limits


def _course(simulation: Simulation) -> closed_loop.Course:
    run, setup = simulation.run, simulation.setup
    return closed_loop.Course(
        run,
        simulation.seconds[simulation.lead_in_samples :],
        "time (s)",
        simulation.quantity,
        simulation.drive,
        _limits(simulation),
        noise=closed_loop.is_noisy(run) if setup is None else setup.noise > 0.0,
    )


def report_of_run(run: Run, dt: float, name: str, quantities: tuple[Quantity, Quantity]) -> str:
    """Return the HTML text."""
    drive, position = quantities
    arrays = (run.reference, run.measured, run.position, run.drive)
    data = hashed_arrays("reference, measured, position, drive as float64", arrays)
    made = made_with("mpi_hyst.reports.run in Python", [data])
    return report(Simulation(run, dt, position, None, name, drive.label, drive.unit), made)
