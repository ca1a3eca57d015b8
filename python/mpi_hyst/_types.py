"""Types that several signatures of the compiled core share, and those of the private packages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol, SupportsFloat, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mpi_hyst._core import (
    Antiresonance,
    Biquad,
    FirstOrder,
    Forward,
    Inverse,
    Lead,
    LowPass,
    Modes,
    ModifiedPrandtlIshlinskii,
    Notch,
    PointToPoint,
    PrandtlIshlinskii,
    RoundedTriangle,
    ScanAxis,
    SecondOrder,
    Sine,
    StageInverse,
    StateSpace,
)

Samples: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]
Vector: TypeAlias = NDArray[np.float64]
Matrix: TypeAlias = NDArray[np.float64]
ComplexVector: TypeAlias = NDArray[np.complex128]

Units: TypeAlias = tuple[str, str] | None
LearningPhase: TypeAlias = Literal["learning", "fading", "stopped"]
Structure: TypeAlias = Literal["proportional-integral", "low-pass", "active damping", "notch"]

Model: TypeAlias = PrandtlIshlinskii | ModifiedPrandtlIshlinskii
AnyFilter: TypeAlias = Notch | LowPass | Lead | Biquad
FeedForward: TypeAlias = Forward | Inverse | StageInverse | Literal["given"] | None
Trajectory: TypeAlias = Sine | RoundedTriangle | PointToPoint | ScanAxis
Lag: TypeAlias = SecondOrder | FirstOrder
Section: TypeAlias = SecondOrder | FirstOrder | Antiresonance | Modes | StateSpace
Dynamics: TypeAlias = Section | Sequence[Section]
MapPoints: TypeAlias = tuple[ArrayLike, ArrayLike]
Points: TypeAlias = tuple[list[float], list[float]]

Records: TypeAlias = ArrayLike | Sequence[tuple[ArrayLike, ArrayLike]]
Skip: TypeAlias = int | str
Counted: TypeAlias = tuple[ArrayLike, ArrayLike] | tuple[ArrayLike, ArrayLike, int]
HeldOut: TypeAlias = Counted | tuple[ArrayLike, ArrayLike, str]


class AnyController(Protocol):
    """A controller of one axis."""

    def step(self, reference: float, measurement: float, /) -> SupportsFloat:
        """Return the drive."""


class AnyPlant(Protocol):
    """What one axis drives."""

    def read(self) -> SupportsFloat:
        """Return the measurement."""

    def write(self, drive: float, /) -> object:
        """Put out the drive."""


class AnyAxesController(Protocol):
    """A controller of several axes."""

    def step(self, references: Vector, measurements: Vector, /) -> Vector | Sequence[float]:
        """Return the drives."""


class AnyAxesPlant(Protocol):
    """What several axes drive."""

    def read(self) -> Vector | Sequence[float]:
        """Return the measurements."""

    def write(self, drives: Vector, /) -> object:
        """Put out the drives."""


class InputOutput(Protocol):
    """What a loop on the clock reads from and writes to."""

    def read(self) -> SupportsFloat | None:
        """Return the measurement, or None where there is none."""

    def write(self, drive: float, /) -> object:
        """Put out the drive."""
