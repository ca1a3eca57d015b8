"""What `mpi-hyst demo` computes: a measured stack, then the actuator of the paper.

Models of the stack are fitted to one record and judged by another. The actuator is Table I with the
digits recovered from Table II; it is identified from simulated records, and compensated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Literal

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


STACK_NOISE = (0.065, 0.072)  # um rms at rest, from the provenance of the records


@dataclass(frozen=True)
class Prediction:
    """A model's errors on the record that it was fitted to, and on the other one."""

    name: str
    fitted: Error
    unseen: Error
    output: Samples
    """What the model says of the other record, with the offset that suits that record best."""


@dataclass(frozen=True)
class MeasuredStack:
    """The records, the recommended model, and what every model says of the unseen record."""

    fitted: mh.datasets.Record
    unseen: mh.datasets.Record
    found: mh.results.Identification
    line: Prediction
    conventional: Prediction
    modified: Prediction

    @property
    def predictions(self) -> tuple[Prediction, Prediction, Prediction]:
        """Every model, the simplest first."""
        return self.line, self.conventional, self.modified


def compute_stack(watch: Watch) -> MeasuredStack:
    """Fit all models to the decaying loops and predict the major loops.

    `watch` takes the name of a fit and a unit; its context gives the progress function.
    """
    fitted = mh.datasets.piezo_stack("decaying_loops")
    unseen = mh.datasets.piezo_stack("major_loops")

    def fit(model: Literal["modified", "conventional"]) -> mh.results.Identification:
        with watch(f"measured stack, {model} model", "µm") as progress:
            return mh.identify(
                *(fitted.u, fitted.y),
                dt=fitted.dt,
                skip=fitted.skip,
                model=model,
                operators=20,
                progress=progress,
            )

    def predicted(name: str, found: mh.results.Identification) -> Prediction:
        return _judged(
            name,
            *(fitted, found.residuals(fitted.u, fitted.y, record=0)),
            *(unseen, found.residuals(unseen.u, unseen.y, skip=unseen.skip)),
        )

    found = fit("modified")
    return MeasuredStack(
        *(fitted, unseen, found),
        _straight_line(fitted, unseen),
        predicted("conventional model (plays)", fit("conventional")),
        predicted("modified model (coupled plays)", found),
    )


def _straight_line(fitted: mh.datasets.Record, unseen: mh.datasets.Record) -> Prediction:
    moved = slice(fitted.skip, None)
    line = np.polynomial.Polynomial.fit(fitted.u[moved], fitted.y[moved], 1)
    residuals = [record.y - line(record.u) for record in (fitted, unseen)]
    # As for the models: the zero of the sensor is arbitrary in every record.
    residuals[1] -= residuals[1][unseen.skip :].mean()
    return _judged("constant gain (no model)", fitted, residuals[0], unseen, residuals[1])


def _judged(
    name: str,
    fitted: mh.datasets.Record,
    of_fitted: Samples,
    unseen: mh.datasets.Record,
    of_unseen: Samples,
) -> Prediction:
    def error(residuals: Samples, record: mh.datasets.Record) -> Error:
        return Error.of(residuals[record.skip :], record.y[record.skip :])

    return Prediction(
        name, error(of_fitted, fitted), error(of_unseen, unseen), unseen.y - of_unseen
    )
