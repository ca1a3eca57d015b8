"""All results of `mpi-hyst reproduce`, and their form in results.json."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mpi_hyst._paper import loops, models, published, saturation, schemes
from mpi_hyst._paper.benchmark import AMPLITUDE, LIMITS, NOISE, RATE
from mpi_hyst._paper.loops import Trial
from mpi_hyst._paper.models import Models
from mpi_hyst._paper.published import Comparison
from mpi_hyst._paper.saturation import Saturation
from mpi_hyst._paper.schemes import Outcome

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
        return [*self.models.comparisons, *loops.comparisons(self.trials)]

    @property
    def not_comparable(self) -> list[Comparison]:
        """Published numbers without a definition."""
        return loops.average_hysteresis(self.trials)

    def outcome(self, name: str, assumed: str) -> Outcome:
        """Return the outcome of one scheme."""
        return next(
            outcome
            for outcome in self.outcomes
            if (outcome.name, outcome.assumed) == (name, assumed)
        )


def steps() -> int:
    """Return the number of steps of `compute`, for a progress bar."""
    return 1 + loops.trials_to_run() + schemes.outcomes_to_run() + len(saturation.cases())


def compute(seeds: int, advance: Callable[[], None]) -> Reproduction:
    """Compute all results."""
    made = models.compute()
    advance()
    return Reproduction(
        seeds,
        made,
        loops.run_trials(seeds, advance),
        schemes.outcomes(seeds, advance),
        saturation.run_cases(seeds, advance),
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
                "drive_limits_v": list(saturation.DRIVE_LIMITS),
                "first_sample_at_limit": case.first,
                "samples_at_limit": case.samples,
                "true_error_after_reentry_um": {"max": case.max_error, "rms": case.rmse},
            }
            for case in made.saturation
        ],
    }
