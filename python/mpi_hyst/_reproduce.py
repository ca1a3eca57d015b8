"""`mpi-hyst reproduce`: every table and figure of the paper, and what goes beyond it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mpi_hyst import _published as published
from mpi_hyst import _reproduce_loops as loops
from mpi_hyst import _reproduce_models as models
from mpi_hyst import _reproduce_tables as tables
from mpi_hyst import _saturation as saturation
from mpi_hyst import _schemes as schemes
from mpi_hyst._benchmark import AMPLITUDE, LIMITS, NOISE, RATE
from mpi_hyst._outputs import Output, check_directory, check_outputs, write_outputs
from mpi_hyst._progress import step_bar
from mpi_hyst._report import require
from mpi_hyst._reproduce_tables import Reproduction
from mpi_hyst._tables import text_table

SCHEMA = "mpi_hyst/reproduce/1"
SEEDS, QUICK_SEEDS = 10, 3


def run(directory: Path, *, quick: bool = False) -> str:
    """Compute everything, write it into the directory, and return the main tables."""
    report, results = directory / "report.html", directory / "results.json"
    check_directory(directory)
    if directory.exists():
        check_outputs([report, results])
    require("the reproduction")
    from mpi_hyst import _reproduce_report

    made = compute(QUICK_SEEDS if quick else SEEDS)
    outputs = [
        Output.of_text(report, _reproduce_report.report(made)),
        Output.of_text(results, json.dumps(as_json(made), indent=1) + "\n"),
    ]
    directory.mkdir(parents=True, exist_ok=True)
    write_outputs(outputs)
    return "\n\n".join(
        [
            "paper and ours\n\n" + text_table(*tables.compared(_but_the_walk(made))),
            "Fig. 5, the walk\n\n" + text_table(*tables.walk(made.models)),
            "published, reproduced, beaten: largest errors in nm (paper, A1, P3: measured; then "
            "true position on A1)\n\n" + text_table(*tables.summary(made)),
            "beyond the paper, on A1 with 16 nm of noise: true error in nm, max (rms)\n\n"
            + text_table(*tables.beyond(made.outcomes)),
            "3.3 um asked of ±500 V: true error after re-entry\n\n"
            + text_table(*tables.saturated(made.saturation)),
            *published.CAVEATS,
            f"medians over {made.seeds} seeds\nreport   {report}\nresults  {results}",
        ]
    )


def _but_the_walk(made: Reproduction) -> list[published.Comparison]:
    return [one for one in made.comparisons if one.figure != "Fig. 5"]


def compute(seeds: int) -> Reproduction:
    """Run everything."""
    steps = 1 + loops.trials_to_run() + schemes.outcomes_to_run() + len(saturation.cases())
    with step_bar("reproduce", steps) as advance:
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
    """Return what results.json holds; lengths in um, drives in V."""
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
                "believes": outcome.believes,
                "true_error_um": {
                    motion: {"max": floor.max, "rms": floor.rms}
                    for motion, floor in outcome.errors.items()
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
                "true_error_after_reentry_um": {"max": case.max_error, "rms": case.rms_error},
            }
            for case in made.saturation
        ],
    }
