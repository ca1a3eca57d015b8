"""Saturation: 3.3 um asked of a drive of +-500 V, which reaches 3.06 um.

Judged is where the reference is back within 2.5 um after the first time at a limit.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper.benchmark import TRIANGLE, beliefs, controller, median

DRIVE_LIMITS = (-500.0, 500.0)  # V
REACHED = 2.5  # um: within this the reference is surely within reach
_SECONDS = 3.0


@dataclass(frozen=True)
class Saturation:
    """How one law comes through, median over the seeds."""

    name: str
    law: str
    first: int
    samples: int
    max_error: float
    rms_error: float
    shown: mh.plant.Run


def cases() -> Sequence[tuple[str, str, Callable[[], mh.Forward | mh.Inverse], dict[str, Any]]]:
    """Return names, feed-forward and options of all laws."""
    table, exact = mh.paper.table_2().forward, lambda: beliefs()["right"].inverse(DRIVE_LIMITS)
    conditional = {"anti_windup": "conditional"}
    back = {"anti_windup": "back_calculation"}
    return (
        ("Table II + P-I", "positional, conditional integration", table, conditional),
        ("Table II + P-I", "positional, back-calculation", table, back),
        ("Table II + P-I", "incremental", table, {"law": "incremental"}),
        ("Table II + P-I", "as printed", table, {"law": "printed"}),
        ("exact inverse + P-I", "positional, conditional integration", exact, conditional),
        ("exact inverse + P-I", "positional, back-calculation", exact, back),
    )


def run_cases(seeds: int, advance: Callable[[], None]) -> list[Saturation]:
    """Run all laws."""
    found = []
    for name, law, feedforward, options in cases():
        runs = [_run(feedforward(), options, seed) for seed in range(seeds)]
        firsts, counts, maxima, rmses = zip(*(_judge(run) for run in runs), strict=True)
        found.append(
            Saturation(
                name,
                law,
                round(median(list(firsts))),
                round(median(list(counts))),
                median(list(maxima)),
                median(list(rmses)),
                runs[0],
            )
        )
        advance()
    return found


def _run(feedforward: mh.Forward | mh.Inverse, options: dict[str, Any], seed: int) -> mh.plant.Run:
    with warnings.catch_warnings():
        # The law as printed is what is to be shown here.
        warnings.filterwarnings("ignore", message='law="printed"', category=UserWarning)
        law = controller(feedforward, mh.paper.gains("A1"), limits=DRIVE_LIMITS, **options)
    return mh.plant.simulate(law, mh.paper.plant("A1", seed=seed), TRIANGLE.reference(_SECONDS))


def _judge(run: mh.plant.Run) -> tuple[float, float, float, float]:
    """Return the first sample at a limit, how many there are, and the errors after re-entry."""
    low, high = DRIVE_LIMITS
    at_limit = (run.drive <= low) | (run.drive >= high)
    first = int(np.argmax(at_limit))
    judged = np.abs(run.reference) <= REACHED
    judged[:first] = False
    arrays = (run.reference, run.measured, run.position, run.drive)
    metrics = mh.plant.Run(*(array[judged] for array in arrays)).metrics
    count = float(at_limit.sum())
    return float(first), count, metrics.max_position_error, metrics.position_rmse
