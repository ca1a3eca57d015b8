"""Saturation: a reference of 3.3 um with a drive limited to +-500 V, which reaches 3.06 um.

The errors are those after the first saturation, wherever the reference is within 2.5 um.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper.benchmark import DT, TRIANGLE, FeedForward, a1, controller, median

DRIVE_LIMITS = (-500.0, 500.0)  # V
REACHED = 2.5  # um: the actuator reaches this within its limits
_SECONDS = 3.0


@dataclass(frozen=True)
class Saturation:
    """The result of one control law, medians over the seeds."""

    name: str
    law: str
    first: int
    samples: int
    max_error: float
    rmse: float
    shown: mh.plant.Run


def cases() -> Sequence[tuple[str, str, Callable[[], FeedForward], dict[str, Any]]]:
    """Return name, feed-forward and options of every law."""
    table, exact = mh.paper.table_2().forward, lambda: a1().inverse(DT, DRIVE_LIMITS)
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
    """Simulate all laws."""
    found = []
    for name, law, feedforward, options in cases():
        runs = [_run(feedforward(), options, seed) for seed in range(seeds)]
        firsts, counts, maxima, rmse_values = zip(*(_errors(run) for run in runs), strict=True)
        found.append(
            Saturation(
                name,
                law,
                round(median(list(firsts))),
                round(median(list(counts))),
                median(list(maxima)),
                median(list(rmse_values)),
                runs[0],
            )
        )
        advance()
    return found


class PrintedLaw:
    """Equation (8) as printed: it adds the whole feed-forward to the drive at every sample.

    u(k) = u(k-1) + H^-1[r(k)] + kp (e(k) - e(k-1)) + ki dt e(k), kept within the limits.
    """

    def __init__(self, feedforward: FeedForward) -> None:
        self._feedforward = feedforward
        self._drive, self._error = 0.0, 0.0

    def step(self, reference: float, measurement: float) -> float:
        """Take a sample and return the drive."""
        kp, ki = mh.paper.gains("A1")
        error = reference - measurement
        change = self._feedforward.step(reference) + kp * (error - self._error) + ki * DT * error
        low, high = DRIVE_LIMITS
        self._drive, self._error = min(max(self._drive + change, low), high), error
        return self._drive


def _run(feedforward: FeedForward, options: dict[str, Any], seed: int) -> mh.plant.Run:
    law: mh.control.HybridController | PrintedLaw
    if options.get("law") == "printed":
        law = PrintedLaw(feedforward)
    else:
        law = controller(feedforward, mh.paper.gains("A1"), limits=DRIVE_LIMITS, **options)
    return mh.plant.simulate(law, a1().plant(DT, seed), TRIANGLE.reference(_SECONDS))


def _errors(run: mh.plant.Run) -> tuple[float, float, float, float]:
    """Return the first sample at a limit, the number of them, and the errors after that."""
    low, high = DRIVE_LIMITS
    at_limit = (run.drive <= low) | (run.drive >= high)
    first = int(np.argmax(at_limit))
    counted = np.abs(run.reference) <= REACHED
    counted[:first] = False
    arrays = (run.reference, run.measured, run.position, run.drive)
    metrics = mh.plant.Run(*(array[counted] for array in arrays)).metrics
    count = float(at_limit.sum())
    return float(first), count, metrics.max_position_error, metrics.position_rmse
