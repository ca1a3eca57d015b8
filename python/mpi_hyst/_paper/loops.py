"""Fig. 12 to 17 of the paper: the published law on the benchmark plants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mpi_hyst as mh
from mpi_hyst._paper import published
from mpi_hyst._paper.benchmark import (
    DT,
    PLANTS,
    TRIANGLE,
    Motion,
    PlantName,
    controller,
    median,
    same_weights,
    sine,
)
from mpi_hyst._paper.published import Comparison, single
from mpi_hyst._types import Model

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
            runs = [_run(plant, bank, motion, seed) for seed in range(seeds)]
            trials.append(Trial(figure, name, motion, plant, numbers, runs))
            advance()
    return trials


def _run(
    plant: PlantName,
    bank: Model,
    motion: Motion,
    seed: int,
) -> mh.plant.Run:
    law = controller(bank.forward(), mh.paper.gains(plant))
    reference = motion.reference(_PERIODS * motion.period * DT)
    return mh.plant.simulate(law, mh.paper.plant(plant, seed=seed), reference, period=motion.period)


def comparisons(trials: Sequence[Trial]) -> list[Comparison]:
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
