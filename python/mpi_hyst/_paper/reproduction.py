"""What `mpi-hyst reproduce` computes: the tables and figures of the paper, and results.json.

The records of Fig. 1 and 8 to 10 are not published. Here the actuator is Table I with the digits
recovered from Table II. The record is a decaying triangle with the sensor noise of plant A1.
Fig. 12 to 17 are the published law on the benchmark plants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper import published, schemes
from mpi_hyst._paper.benchmark import (
    AMPLITUDE,
    DT,
    LIMITS,
    NOISE,
    PLANTS,
    RATE,
    TRIANGLE,
    Motion,
    PlantName,
    controller,
    median,
    same_weights,
    sine,
)
from mpi_hyst._paper.published import Comparison, single
from mpi_hyst._paper.schemes import Outcome, Saturation
from mpi_hyst._types import Model, Samples

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


def compute_models() -> Models:
    """Compute both tables, identify both models from the same record, and compare."""
    actuator = mh.paper.table_1_recovered()
    drive = mh.signals.decaying_triangle(_DRIVE, 1.0, cycles=10, rate=RECORD_RATE)
    position = actuator.forward().run(drive)
    measured = position + np.random.default_rng(_SEED).normal(0.0, NOISE, drive.size)
    fits = _fits(drive, measured, position)
    printed = (mh.paper.table_1(), mh.paper.table_2())
    computed = (actuator, actuator.parametric_inverse())
    comparisons = [*_compare_tables(printed, computed), *_compare_operator(), *_compare_fits(fits)]
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


def _compare_tables(
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


def _compare_operator() -> list[Comparison]:
    stream = mh.CoupledPlay(*WALK_THRESHOLDS)
    return [
        Comparison("Fig. 5", f"output at x = {x:g} V", "V", single(z), stream.step(x))
        for x, z in zip(WALK_INPUT, published.WALK_OUTPUT, strict=True)
    ]


def _compare_fits(fits: Sequence[Fit]) -> list[Comparison]:
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


_PERIODS = 3


@dataclass(frozen=True)
class Trial:
    """The runs of one figure on one plant, one for each seed."""

    figure: str
    feedforward: str
    motion: Motion
    plant: PlantName
    published: tuple[float, float]
    runs: Sequence[mh.plant.Run]

    @property
    def maxima(self) -> list[float]:
        """The largest measured error of each run, um."""
        return [run.metrics.max_error for run in self.runs]

    @property
    def shown(self) -> mh.plant.Run:
        """The run whose largest error is closest to the median."""
        middle = median(self.maxima)
        return min(self.runs, key=lambda run: abs(run.metrics.max_error - middle))


def trials_to_run() -> int:
    """Return the number of trials, for a progress bar."""
    return len(PLANTS) * (2 + len(published.SINES))


def run_trials(seeds: int, advance: Callable[[], None]) -> list[Trial]:
    """Simulate all figures on both plants."""
    conventional, modified = same_weights().closed_form_inverse(), mh.paper.table_2()
    figures: list[tuple[str, str, Model, Motion, tuple[float, float]]] = [
        ("Fig. 12", "CPI inverse", conventional, TRIANGLE, published.TRIANGLE_CONVENTIONAL),
        ("Fig. 13", "Table II", modified, TRIANGLE, published.TRIANGLE_MODIFIED),
        *(
            (f"Fig. {14 + index}", "Table II", modified, sine(frequency), single(value))
            for index, (frequency, value) in enumerate(published.SINES.items())
        ),
    ]
    trials = []
    for plant in PLANTS:
        for figure, name, bank, motion, numbers in figures:
            runs = [_run_trial(plant, bank, motion, seed) for seed in range(seeds)]
            trials.append(Trial(figure, name, motion, plant, numbers, runs))
            advance()
    return trials


def _run_trial(plant: PlantName, bank: Model, motion: Motion, seed: int) -> mh.plant.Run:
    law = controller(bank.forward(), mh.paper.gains(plant))
    reference = motion.reference(_PERIODS * motion.period * DT)
    return mh.plant.simulate(law, mh.paper.plant(plant, seed=seed), reference, period=motion.period)


def compare_trials(trials: Sequence[Trial]) -> list[Comparison]:
    """Compare the largest errors, and the hysteresis as the paper defines it."""
    made = []
    for trial in trials:
        what = f"{trial.motion.name}, {trial.feedforward} + P-I"
        made.append(
            Comparison(
                trial.figure,
                f"{what}: largest measured error",
                "µm",
                trial.published,
                median(trial.maxima),
                trial.plant,
            )
        )
        if trial.motion is TRIANGLE:
            conventional = trial.feedforward != "Table II"
            value = (
                published.HYSTERESIS_CONVENTIONAL if conventional else published.HYSTERESIS_MODIFIED
            )
            percents = [run.metrics.hysteresis_percent or 0.0 for run in trial.runs]
            made.append(
                Comparison(
                    trial.figure,
                    f"{what}: hysteresis",
                    "% of range",
                    single(value),
                    median(percents),
                    trial.plant,
                )
            )
    return made


def average_hysteresis(trials: Sequence[Trial]) -> list[Comparison]:
    """Give the rms error beside the average hysteresis of the sines, which is not defined."""
    return [
        Comparison(
            trial.figure,
            f"{trial.motion.name}: rms measured error; the paper prints "
            f"{published.AVERAGE_HYSTERESIS[frequency]:g} % average hysteresis without a base",
            "% of range",
            None,
            median([100.0 * run.metrics.rmse / run.metrics.range for run in trial.runs]),
            trial.plant,
            note="not comparable: no base or definition is printed",
        )
        for trial in trials
        for frequency in published.AVERAGE_HYSTERESIS
        if trial.motion.name == sine(frequency).name
    ]


SCHEMA = "mpi_hyst/reproduce/1"


@dataclass(frozen=True)
class Reproduction:
    """All results."""

    seeds: int
    models: Models
    trials: Sequence[Trial]
    outcomes: Sequence[Outcome]
    saturation: Sequence[Saturation]

    @property
    def comparisons(self) -> list[Comparison]:
        """All published numbers with ours."""
        return [*self.models.comparisons, *compare_trials(self.trials)]

    @property
    def not_comparable(self) -> list[Comparison]:
        """Published numbers without a definition."""
        return average_hysteresis(self.trials)

    def outcome(self, name: str, assumed: str) -> Outcome:
        """Return the outcome of one scheme."""
        return next(
            outcome
            for outcome in self.outcomes
            if (outcome.name, outcome.assumed) == (name, assumed)
        )


def steps() -> int:
    """Return the number of steps of `compute`, for a progress bar."""
    return 1 + trials_to_run() + schemes.outcomes_to_run() + len(schemes.cases())


def compute(seeds: int, advance: Callable[[], None]) -> Reproduction:
    """Compute all results."""
    made = compute_models()
    advance()
    return Reproduction(
        seeds,
        made,
        run_trials(seeds, advance),
        schemes.outcomes(seeds, advance),
        schemes.run_cases(seeds, advance),
    )


def as_json(made: Reproduction) -> dict[str, Any]:
    """Return the content of results.json; lengths in um, drives in V."""
    return {
        "schema": SCHEMA,
        "paper": published.PAPER,
        "caveats": list(published.CAVEATS),
        "conditions": {
            "seeds": made.seeds,
            "rate_hz": RATE,
            "amplitude_um": AMPLITUDE,
            "plant_limits_v": list(LIMITS),
            "noise_um_rms": NOISE,
        },
        "comparisons": [one.as_json() for one in made.comparisons],
        "not_comparable": [one.as_json() for one in made.not_comparable],
        "closed_loop": [
            {
                "figure": trial.figure,
                "plant": trial.plant,
                "motion": trial.motion.name,
                "feedforward": trial.feedforward,
                "max_measured_error_um": trial.maxima,
            }
            for trial in made.trials
        ],
        "beyond": [
            {
                "scheme": outcome.name,
                "assumed": outcome.assumed,
                "true_error_um": {
                    motion: {"max": error.max, "rms": error.rms}
                    for motion, error in outcome.errors.items()
                },
            }
            for outcome in made.outcomes
        ],
        "saturation": [
            {
                "feedforward": case.name,
                "law": case.law,
                "drive_limits_v": list(schemes.DRIVE_LIMITS),
                "first_sample_at_limit": case.first,
                "samples_at_limit": case.samples,
                "true_error_after_reentry_um": {"max": case.max_error, "rms": case.rmse},
            }
            for case in made.saturation
        ],
    }
