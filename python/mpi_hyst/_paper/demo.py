"""The whole chain on the actuator of the paper, without any data.

The actuator is Table I with the digits that Table II recovers; the records are simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._types import Model, Samples

RATE = 10_000  # samples per second, the loop of the paper
NOISE = 0.015  # um rms, the noise of the paper's sensor
LIMITS = (-500.0, 500.0)  # V
_SEED = 2017

Progress = Callable[[float, float], None]
Watch = Callable[[str, str], AbstractContextManager[Progress | None]]


def seconds(values: Samples) -> Samples:
    """Return when each sample is taken."""
    return np.arange(values.size) / RATE


@dataclass(frozen=True)
class Measurement:
    """A simulated record: what was driven, what the sensor said, and where the actuator was."""

    name: str
    drive: Samples
    measured: Samples
    position: Samples


@dataclass(frozen=True)
class Error:
    """How far off, in um, and of which peak-to-peak."""

    max: float
    rms: float
    base: float

    @classmethod
    def of(cls, difference: Samples, wanted: Samples) -> Error:
        """Sum up a difference."""
        rms = float(np.sqrt(np.mean(difference**2)))
        return cls(float(np.abs(difference).max()), rms, float(np.ptp(wanted)))


@dataclass(frozen=True)
class Scheme:
    """A way to drive the actuator along the target, and where it went."""

    name: str
    drive: Samples
    position: Samples
    target: Samples

    @property
    def error(self) -> Error:
        """Against the target."""
        return Error.of(self.position - self.target, self.target)


@dataclass(frozen=True)
class Demo:
    """Everything the demo computes."""

    actuator: mh.ModifiedPrandtlIshlinskii
    records: tuple[Measurement, Measurement]
    conventional: mh.results.Identification
    modified: mh.results.Identification
    target: Samples
    schemes: list[Scheme]

    def modelled(self, found: mh.results.Identification, record: Measurement) -> Samples:
        """Return what a model says about a record."""
        return found.predict(record.drive)


def _unwatched(*_: str) -> AbstractContextManager[None]:
    return nullcontext()


def compute(watch: Watch = _unwatched) -> Demo:
    """Make the records, fit both models, and follow the target with every scheme.

    `watch` gives the function that hears of the progress of a fit, by its name and unit.
    """
    actuator = mh.paper.table_1_recovered()
    records = _records(actuator)
    learned = records[0]
    with watch("conventional model", "um") as progress:
        conventional = mh.identify(
            learned.drive, learned.measured, model="conventional", progress=progress
        )
    with watch("modified model", "um") as progress:
        modified = mh.identify(learned.drive, learned.measured, progress=progress)
    target = _target()
    drives = _drives(actuator, conventional.model, modified.model, learned, target)
    schemes = [Scheme(name, drive, actuator.forward().run(drive), target) for name, drive in drives]
    return Demo(actuator, records, conventional, modified, target, schemes)


def _records(actuator: mh.ModifiedPrandtlIshlinskii) -> tuple[Measurement, Measurement]:
    noise = np.random.default_rng(_SEED)
    decaying = mh.signals.decaying_triangle(LIMITS[1], 5.0, cycles=6, rate=RATE)
    waves = [
        mh.signals.sine(amplitude, frequency, seconds=1.0, rate=RATE)
        for amplitude, frequency in ((260.0, 2.0), (150.0, 7.3), (60.0, 19.0))
    ]
    unseen = np.sum(waves, axis=0)

    def measure(name: str, drive: Samples) -> Measurement:
        position = actuator.forward().run(drive)
        measured = position + noise.normal(0.0, NOISE, drive.size)
        return Measurement(name, drive, measured, position)

    return measure("identification", decaying), measure("validation", unseen)


def _target() -> Samples:
    """Return a full stroke and then moves that turn around at many places, in um."""
    stroke = mh.signals.triangle(3.0, 2.5, seconds=0.4, rate=RATE)
    slow = mh.signals.sine(1.7, 2.5, seconds=0.8, rate=RATE)
    fast = mh.signals.sine(0.9, 21.25, seconds=0.8, rate=RATE)
    return np.concatenate([stroke, slow + fast])


def _drives(
    actuator: mh.ModifiedPrandtlIshlinskii,
    conventional: Model,
    modified: Model,
    learned: Measurement,
    target: Samples,
) -> Sequence[tuple[str, Samples]]:
    assert isinstance(conventional, mh.PrandtlIshlinskii)
    gain = np.ptp(learned.drive) / np.ptp(learned.measured)
    closed_form = conventional.closed_form_inverse()
    return (
        ("straight line (no model)", gain * target),
        ("conventional model, closed form", closed_form.forward().run(target)),
        ("Table II, parametric inverse", mh.paper.table_2().forward().run(target)),
        ("identified model, exact inverse", modified.inverse(LIMITS).run(target)),
        ("true model, exact inverse", actuator.inverse(LIMITS).run(target)),
    )


def exact(demo: Demo) -> Scheme:
    """Return the scheme an engineer would use: the exact inverse of the identified model."""
    return demo.schemes[-2]
