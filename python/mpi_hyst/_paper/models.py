"""Tables I and II and Fig. 1, 4, 5, 8, 9, 10 of the paper: operators, models, identification.

The records of Fig. 1 and 8 to 10 are not published. Here the actuator is Table I with the digits
recovered from Table II. The record is a decaying triangle with the sensor noise of plant A1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper import published
from mpi_hyst._paper.benchmark import NOISE, same_weights
from mpi_hyst._paper.published import Comparison, single
from mpi_hyst._types import Samples

WALK_INPUT = (0.0, 20.0, -20.0, 15.0, 6.0, 25.0, -15.0, -5.0)
WALK_THRESHOLDS = (10.0, 8.0, 3.0, 4.0)  # r, ra, rb, rc
RECORD_RATE = 1000  # Hz
_DRIVE = 500.0  # V
_SEED = 2017
_COLUMNS = ("weights", "r", "ra", "rb", "rc")


@dataclass(frozen=True)
class Fit:
    """A model, its prediction of the record, and the record."""

    name: str
    figure: str
    predicted: Samples
    wanted: Samples
    position: Samples
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii

    @property
    def measured_error(self) -> Samples:
        """Record minus prediction, um."""
        return self.wanted - self.predicted

    @property
    def max_percent(self) -> float:
        """Largest error against the record, in % of its range."""
        return float(100.0 * np.abs(self.measured_error).max() / np.ptp(self.wanted))

    @property
    def mse(self) -> float:
        """Mean square error against the record, um^2."""
        return float(np.mean(self.measured_error**2))

    @property
    def true_max_percent(self) -> float:
        """Largest error against the position without noise, in % of its range."""
        error = np.abs(self.position - self.predicted).max()
        return float(100.0 * error / np.ptp(self.position))


@dataclass(frozen=True)
class Models:
    """Tables, record and fitted models, with comparisons."""

    printed: tuple[mh.ModifiedPrandtlIshlinskii, mh.ModifiedPrandtlIshlinskii]
    computed: tuple[mh.ModifiedPrandtlIshlinskii, mh.ModifiedPrandtlIshlinskii]
    drive: Samples
    position: Samples
    fits: Sequence[Fit]
    comparisons: Sequence[Comparison]

    @property
    def walk(self) -> list[float]:
        """The output of the coupled play at the corners of the walk of Fig. 5."""
        stream = mh.CoupledPlay(*WALK_THRESHOLDS)
        return [stream.step(x) for x in WALK_INPUT]


def compute() -> Models:
    """Compute both tables, identify both models from the same record, and compare."""
    actuator = mh.paper.table_1_recovered()
    drive = mh.signals.decaying_triangle(_DRIVE, 1.0, cycles=10, rate=RECORD_RATE)
    position = actuator.forward().run(drive)
    measured = position + np.random.default_rng(_SEED).normal(0.0, NOISE, drive.size)
    fits = _fits(drive, measured, position)
    printed = (mh.paper.table_1(), mh.paper.table_2())
    computed = (actuator, actuator.parametric_inverse())
    comparisons = [*_of_tables(printed, computed), *_of_operator(), *_of_fits(fits)]
    return Models(printed, computed, drive, position, fits, comparisons)


def _fits(drive: Samples, measured: Samples, position: Samples) -> list[Fit]:
    modified = mh.identify(drive, measured, input_offset=0.0, dead_time=0.0)
    conventional = mh.identify(
        drive, measured, model="conventional", input_offset=0.0, dead_time=0.0
    )
    unfitted = same_weights()
    found = (
        ("modified, identified", "Fig. 8", modified.predict(drive), modified.model),
        ("conventional, identified", "Fig. 9, 10", conventional.predict(drive), conventional.model),
        ("conventional, weights of Table I", "Fig. 9, 10", unfitted.forward().run(drive), unfitted),
    )
    return [
        Fit(name, figure, predicted, measured, position, model)
        for name, figure, predicted, model in found
    ]


def _of_tables(
    printed: Sequence[mh.ModifiedPrandtlIshlinskii],
    computed: Sequence[mh.ModifiedPrandtlIshlinskii],
) -> list[Comparison]:
    return [
        Comparison(
            table,
            f"{20 * len(columns)} numbers, {what}: largest difference",
            "V/µm, V" if table == "Table II" else "µm/V",
            None,
            _largest_difference(one, other, columns),
            note="rounding to four printed decimals gives up to 5e-5",
        )
        for table, what, columns, one, other in (
            ("Table I", "recovered from Table II", _COLUMNS[:1], printed[0], computed[0]),
            ("Table II", "computed from Table I recovered", _COLUMNS, printed[1], computed[1]),
        )
    ]


def _largest_difference(
    one: mh.ModifiedPrandtlIshlinskii, other: mh.ModifiedPrandtlIshlinskii, columns: Sequence[str]
) -> float:
    return max(
        float(np.abs(getattr(one, column) - getattr(other, column)).max()) for column in columns
    )


def _of_operator() -> list[Comparison]:
    stream = mh.CoupledPlay(*WALK_THRESHOLDS)
    return [
        Comparison("Fig. 5", f"output at x = {x:g} V", "V", single(z), stream.step(x))
        for x, z in zip(WALK_INPUT, published.WALK_OUTPUT, strict=True)
    ]


def _of_fits(fits: Sequence[Fit]) -> list[Comparison]:
    modified, conventional, unfitted = fits
    numbers = {
        "Fig. 8": (published.MODIFIED_MAX, published.MODIFIED_MSE),
        "Fig. 9, 10": (published.CONVENTIONAL_MAX, published.CONVENTIONAL_MSE),
    }
    made = []
    for fit in (modified, conventional, unfitted):
        largest, mse = numbers[fit.figure]
        note = "another record: the published one is not available"
        made += [
            Comparison(
                fit.figure,
                f"{fit.name}: largest error",
                "% of range",
                single(largest),
                fit.max_percent,
                note=note,
            ),
            Comparison(
                fit.figure, f"{fit.name}: mean square", "µm²", single(mse), fit.mse, note=note
            ),
        ]
    return made
