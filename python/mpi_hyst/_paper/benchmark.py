"""The benchmark: the references of the paper, its plants and its law, what a controller believes.

Plants A1 and P3 with the published law give the published maxima; so do other plants.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np

import mpi_hyst as mh
from mpi_hyst._types import Samples

RATE = 10_000  # samples per second, the loop of the paper
DT = 1.0 / RATE
AMPLITUDE = 3.3  # um
LIMITS = (-560.0, 560.0)  # V, of the plants
NOISE = 0.016  # um rms, of plant A1
STAGE = mh.plant.SecondOrder(400.0, 0.95)  # Hz, damping ratio, of plant A1

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
        """The period, where it is a whole number of samples."""
        return round(self.period)

    def reference(self, seconds: float) -> Samples:
        """Where the position should be, um."""
        frequency = RATE / self.period
        if self.shape == "triangle":
            return mh.signals.triangle(AMPLITUDE, frequency, seconds=seconds)
        return mh.trajectories.Sine(AMPLITUDE, frequency).sample(DT, seconds)[0]

    def target(self, seconds: float, dynamics: mh.plant.SecondOrder) -> Samples:
        """Return what the hysteresis has to put out: through inverse dynamics, half a sample early.

        The sine has exact derivatives; of the triangle there are samples alone.
        """
        if self.shape == "triangle":
            return mh.control.invert_dynamics(self.reference(seconds), DT, dynamics=dynamics)
        sine = mh.trajectories.Sine(AMPLITUDE, RATE / self.period)
        return mh.control.invert_dynamics(sine, DT, dynamics=dynamics, seconds=seconds)

    def period_of_target(self, dynamics: mh.plant.SecondOrder) -> Samples:
        """Return one period of the target far from the ends of the record."""
        target = self.target(3.0 * self.samples * DT, dynamics)
        return target[self.samples : 2 * self.samples]


TRIANGLE = Motion("1 Hz triangle", RATE, "triangle")


def sine(frequency: float) -> Motion:
    """Return a sine of exactly this frequency."""
    return Motion(f"{frequency:g} Hz", RATE / frequency)


def whole_sine(frequency: float) -> Motion:
    """Return the sine nearest to this frequency that repeats after a whole number of samples."""
    return Motion(f"{frequency:g} Hz", float(round(RATE / frequency)))


@dataclass(frozen=True)
class Belief:
    """What a controller takes the actuator for."""

    name: str
    model: mh.ModifiedPrandtlIshlinskii
    dynamics: mh.plant.SecondOrder

    def inverse(self, limits: tuple[float, float] = LIMITS) -> mh.Inverse:
        """Return the exact inverse of the model."""
        return self.model.inverse(limits)


@cache
def beliefs() -> dict[str, Belief]:
    """Return what may be right or wrong, by name."""
    right, wrong = mh.paper.table_1_recovered(), mismatched()
    off = mh.plant.SecondOrder(1.05 * STAGE.frequency, 0.8 * STAGE.damping)
    named = (
        Belief("right", right, STAGE),
        Belief("model wrong", wrong, STAGE),
        Belief("dynamics wrong", right, off),
        Belief("both wrong", wrong, off),
    )
    return {belief.name: belief for belief in named}


def mismatched() -> mh.ModifiedPrandtlIshlinskii:
    """Return the actuator with every other weight but the first half as large again, or half."""
    actuator = mh.paper.table_1_recovered()
    factors = np.where(np.arange(actuator.operators) % 2 == 0, 1.5, 0.5)
    factors[0] = 1.0
    return mh.ModifiedPrandtlIshlinskii(
        factors * actuator.weights, actuator.r, actuator.ra, actuator.rb, actuator.rc
    )


def mismatch_percent() -> float:
    """Return how far the wrong model leaves the actuator off in open loop, in % of the triangle."""
    believed = beliefs()
    target = TRIANGLE.reference(3.0)
    drive = believed["model wrong"].inverse().run(target)
    position = believed["right"].model.forward().run(drive)
    return float(100.0 * np.abs(position - target).max() / np.ptp(target))


def same_weights() -> mh.PrandtlIshlinskii:
    """Return the conventional model with the weights and thresholds r of the actuator."""
    actuator = mh.paper.table_1_recovered()
    return mh.PrandtlIshlinskii(actuator.weights, actuator.r)


def controller(
    feedforward: mh.Forward | mh.Inverse, gains: tuple[float, float], **options: Any
) -> mh.control.HybridController:
    """Return the hybrid controller, equation (8), within the limits of the plants."""
    kp, ki = gains
    return mh.control.HybridController(
        feedforward, **{"kp": kp, "ki": ki, "limits": LIMITS, **options}
    )


def part(run: mh.plant.Run, start: int, end: int | None = None) -> mh.plant.Metrics:
    """Return the errors of a run from a sample on, to its end or to another."""
    arrays = (run.reference, run.measured, run.position, run.drive)
    return mh.plant.Run(*(array[start:end] for array in arrays)).metrics


def median(values: list[float]) -> float:
    """Return the middle of what the seeds gave."""
    return float(np.median(values))
