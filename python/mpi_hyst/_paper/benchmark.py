"""The benchmark: the references of the paper, its control law, and simulated plants A1 and P3.

With the published law these plants give the published maximum errors. So do other plants. A1 has
a natural frequency of 400 Hz, a damping ratio of 0.95 and 16 nm of sensor noise (rms).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, TypeAlias

import numpy as np

import mpi_hyst as mh
from mpi_hyst._types import Samples

RATE = 10_000  # Hz, the sampling rate of the paper
DT = 1.0 / RATE
AMPLITUDE = 3.3  # um
LIMITS = (-560.0, 560.0)  # V, of the plants
NOISE = 0.016  # um rms, of plant A1
DYNAMICS = mh.plant.SecondOrder(400.0, 0.95)  # Hz, damping ratio, of plant A1

FeedForward: TypeAlias = mh.Forward | mh.Inverse | mh.StageInverse
PlantName = Literal["A1", "P3"]
PLANTS: tuple[PlantName, PlantName] = ("A1", "P3")


@dataclass(frozen=True)
class Motion:
    """A reference of 3.3 um that repeats after `period` samples."""

    name: str
    period: float
    shape: Literal["triangle", "sine"] = "sine"

    @property
    def samples(self) -> int:
        """The period as a whole number of samples."""
        return round(self.period)

    def reference(self, seconds: float) -> Samples:
        """Return the reference in um."""
        frequency = RATE / self.period
        if self.shape == "triangle":
            return mh.signals.triangle(AMPLITUDE, frequency, seconds=seconds)
        return mh.trajectories.Sine(AMPLITUDE, frequency).sample(DT, seconds)[0]

    def target(self, seconds: float, stage: mh.Stage) -> Samples:
        """Return what the hysteresis must do: the reference through the inverse dynamics."""
        return mh.control.invert_dynamics(self.reference(seconds), DT, dynamics=stage.dynamics)

    def period_of_target(self, stage: mh.Stage) -> Samples:
        """Return one period of the target, away from the ends of the record."""
        target = self.target(3.0 * self.samples * DT, stage)
        return target[self.samples : 2 * self.samples]


TRIANGLE = Motion("1 Hz triangle", RATE, "triangle")


def sine(frequency: float) -> Motion:
    """Return a sine of exactly this frequency."""
    return Motion(f"{frequency:g} Hz", RATE / frequency)


def whole_sine(frequency: float) -> Motion:
    """Return the sine closest to this frequency whose period is a whole number of samples."""
    return Motion(f"{frequency:g} Hz", float(round(RATE / frequency)))


@dataclass(frozen=True)
class Assumption:
    """The stage that a controller assumes."""

    name: str
    stage: mh.Stage


@cache
def a1() -> mh.Stage:
    """Return the stage of plant A1."""
    actuator = mh.paper.table_1_recovered()
    return mh.Stage(actuator, limits=LIMITS, dynamics=DYNAMICS, noise=NOISE)


@cache
def assumptions() -> dict[str, Assumption]:
    """Return the assumptions by name: exact, or wrong in model, dynamics or both."""
    wrong = mh.Stage(mismatched(), limits=LIMITS, dynamics=DYNAMICS, noise=NOISE)
    off = mh.plant.SecondOrder(1.05 * DYNAMICS.frequency, 0.8 * DYNAMICS.damping)
    named = (
        Assumption("exact", a1()),
        Assumption("wrong model", wrong),
        Assumption("wrong dynamics", a1().replace(dynamics=off)),
        Assumption("wrong model and dynamics", wrong.replace(dynamics=off)),
    )
    return {assumption.name: assumption for assumption in named}


def mismatched() -> mh.ModifiedPrandtlIshlinskii:
    """Return the actuator with its weights times 1.5 and 0.5 in turn; the first is kept."""
    actuator = mh.paper.table_1_recovered()
    factors = np.where(np.arange(actuator.operators) % 2 == 0, 1.5, 0.5)
    factors[0] = 1.0
    return mh.ModifiedPrandtlIshlinskii(
        factors * actuator.weights, actuator.r, actuator.ra, actuator.rb, actuator.rc
    )


def mismatch_percent() -> float:
    """Return the largest open-loop error of the wrong model, in % of the triangle's range."""
    target = TRIANGLE.reference(3.0)
    drive = assumptions()["wrong model"].stage.inverse(DT).run(target)
    position = a1().replace(dynamics=None).forward(DT).run(drive)
    return float(100.0 * np.abs(position - target).max() / np.ptp(target))


def same_weights() -> mh.PrandtlIshlinskii:
    """Return the conventional model with the weights and thresholds r of the actuator."""
    actuator = mh.paper.table_1_recovered()
    return mh.PrandtlIshlinskii(actuator.weights, actuator.r)


def controller(
    feedforward: FeedForward, gains: tuple[float, float], **options: Any
) -> mh.control.HybridController:
    """Return the hybrid controller, equation (8) of the paper, with the limits of the plants."""
    kp, ki = gains
    return mh.control.HybridController(
        feedforward, **{"kp": kp, "ki": ki, "dt": DT, "limits": LIMITS, **options}
    )


def part(run: mh.plant.Run, start: int, end: int | None = None) -> mh.plant.Metrics:
    """Return the errors of a part of a run."""
    arrays = (run.reference, run.measured, run.position, run.drive)
    return mh.plant.Run(*(array[start:end] for array in arrays)).metrics


def median(values: list[float]) -> float:
    """Return the median over the seeds."""
    return float(np.median(values))
