"""Identification and compensation of the actuator of the paper, from simulated records.

The actuator is Table I with the digits recovered from Table II.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._types import Model, Samples

RATE = 10_000  # Hz, the sampling rate of the paper
DT = 1.0 / RATE
NOISE = 0.015  # um rms, the noise of the paper's sensor
LIMITS = (-500.0, 500.0)  # V
_SEED = 2017

Progress = Callable[[float, float], None]
Watch = Callable[[str, str], AbstractContextManager[Progress | None]]


def seconds(values: Samples) -> Samples:
    """Return the time of each sample."""
    return np.arange(values.size) / RATE


@dataclass(frozen=True)
class Measurement:
    """A simulated record: drive, measured position, true position."""

    name: str
    drive: Samples
    measured: Samples
    position: Samples


@dataclass(frozen=True)
class Error:
    """Largest and rms error in um, and the range that is the base of percentages."""

    max: float
    rms: float
    base: float

    @classmethod
    def of(cls, difference: Samples, wanted: Samples) -> Error:
        """Return the errors of a difference."""
        rms = float(np.sqrt(np.mean(difference**2)))
        return cls(float(np.abs(difference).max()), rms, float(np.ptp(wanted)))


@dataclass(frozen=True)
class OpenLoopScheme:
    """A way to compute the drive for the target, and the resulting position."""

    name: str
    drive: Samples
    position: Samples
    target: Samples

    @property
    def error(self) -> Error:
        """Position minus target."""
        return Error.of(self.position - self.target, self.target)


@dataclass(frozen=True)
class Demo:
    """All results of the demo."""

    actuator: mh.Stage
    records: tuple[Measurement, Measurement]
    conventional: mh.results.Identification
    modified: mh.results.Identification
    target: Samples
    schemes: list[OpenLoopScheme]

    def modelled(self, found: mh.results.Identification, record: Measurement) -> Samples:
        """Return the prediction of a record."""
        return found.predict(record.drive)


def _unwatched(*_: str) -> AbstractContextManager[None]:
    return nullcontext()


def compute(watch: Watch = _unwatched) -> Demo:
    """Make the records, fit both models, and follow the target with each scheme.

    `watch` takes the name of a fit and a unit; its context gives the progress function.
    """
    actuator = mh.Stage(mh.paper.table_1_recovered(), limits=LIMITS, noise=NOISE)
    records = _records(actuator)
    learned = records[0]
    with watch("conventional model", "µm") as progress:
        conventional = mh.identify(
            learned.drive, learned.measured, dt=DT, model="conventional", progress=progress
        )
    with watch("modified model", "µm") as progress:
        modified = mh.identify(learned.drive, learned.measured, dt=DT, progress=progress)
    target = _target()
    drives = _drives(actuator, conventional.model, modified.stage, learned, target)
    schemes = [
        OpenLoopScheme(name, drive, actuator.forward(DT).run(drive), target)
        for name, drive in drives
    ]
    return Demo(actuator, records, conventional, modified, target, schemes)


def _records(actuator: mh.Stage) -> tuple[Measurement, Measurement]:
    noise = np.random.default_rng(_SEED)
    decaying = mh.signals.decaying_triangle(LIMITS[1], 5.0, cycles=6, rate=RATE)
    waves = [
        mh.signals.sine(amplitude, frequency, seconds=1.0, rate=RATE)
        for amplitude, frequency in ((260.0, 2.0), (150.0, 7.3), (60.0, 19.0))
    ]
    unseen = np.sum(waves, axis=0)

    def measure(name: str, drive: Samples) -> Measurement:
        position = actuator.forward(DT).run(drive)
        measured = position + noise.normal(0.0, NOISE, drive.size)
        return Measurement(name, drive, measured, position)

    return measure("identification", decaying), measure("validation", unseen)


def _target() -> Samples:
    """Return a full stroke, then motion with many reversals, in um."""
    stroke = mh.signals.triangle(3.0, 2.5, seconds=0.4, rate=RATE)
    slow = mh.signals.sine(1.7, 2.5, seconds=0.8, rate=RATE)
    fast = mh.signals.sine(0.9, 21.25, seconds=0.8, rate=RATE)
    return np.concatenate([stroke, slow + fast])


def _drives(
    actuator: mh.Stage,
    conventional: Model,
    modified: mh.Stage,
    learned: Measurement,
    target: Samples,
) -> Sequence[tuple[str, Samples]]:
    assert isinstance(conventional, mh.PrandtlIshlinskii)
    gain = np.ptp(learned.drive) / np.ptp(learned.measured)
    closed_form = conventional.closed_form_inverse()
    return (
        ("constant gain (no model)", gain * target),
        ("conventional model, closed-form inverse", closed_form.forward().run(target)),
        ("Table II, parametric inverse", mh.paper.table_2().forward().run(target)),
        (
            "identified model, exact inverse",
            modified.replace(limits=LIMITS).inverse(DT).run(target),
        ),
        ("true model, exact inverse", actuator.inverse(DT).run(target)),
    )


def exact(demo: Demo) -> OpenLoopScheme:
    """Return the recommended scheme: the exact inverse of the identified model."""
    return demo.schemes[-2]
