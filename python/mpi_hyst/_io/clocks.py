"""What the numbers of a clock tell: whether their steps are equal, and whether seconds are likely.

A record of hysteresis is sampled at a round rate or in round steps, a hundred thousand times a
second to twice a second. What is round in hours, and in seconds is not, is hardly in seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from mpi_hyst._quantity import SECONDS
from mpi_hyst._text import digits
from mpi_hyst._types import Samples

SHORTEST, LONGEST = 5e-6, 0.5  # seconds between samples
# Numbers of days, as Excel and MATLAB count them, from 1970 on.
_ERAS = (25_569.0, 62_000.0), (719_529.0, 770_000.0)
_SHORT = 1e-3  # steps that a longer unit may have
_LONG = ("min", "h", "d")
_ROUND = (1.0, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0)
_NEAR = 2e-3  # share of a round number
_OVER, _HEAD = 50, 10_000  # samples: times are rounded, and the first ones tell it
_SAME, _ROUNDED = 1e-6, 0.05  # of a step: exact, and written with a few digits
_RUNS = 10  # samples that make a clock
_FEW_BEFORE = 5  # rows that may stand above it
_LEAP = 3.0  # steps


def even_step(values: Sequence[float], same: float = _SAME) -> float:
    """Return the step of numbers that run like a clock; 0 if they do not."""
    steps = [b - a for a, b in pairwise(values)]
    if not steps or steps[0] <= 0.0 or max(steps) - min(steps) > same * max(steps):
        return 0.0
    return steps[0]


def rows_before(values: Sequence[float]) -> int | None:
    """Return how many first numbers do not lead to the clock behind them; None without a clock."""
    for first in range(min(_FEW_BEFORE, len(values) - _RUNS) + 1):
        if step := even_step(values[first : first + _RUNS], _ROUNDED):
            leap = values[first] - values[first - 1] if first else step
            return 0 if 0.0 < leap <= _LEAP * step else first
    return None


def usual_step(times: Samples) -> float:
    """Return the usual step of at least two times.

    It is the median of mean steps over many samples, which neither gaps nor rounded times move.
    """
    over = min(_OVER, times.size - 1)
    return float(np.median(times[over:] - times[:-over])) / over


def hardly_seconds(times: Samples) -> str:
    """Return why times without a unit are hardly seconds, and the option; empty if they may be."""
    first = times[:_HEAD][np.isfinite(times[:_HEAD])]
    if first.size < 2:
        return ""
    step = usual_step(first)
    begins, said = float(first[0]), f"has no unit and steps of {digits(step)}"
    if step <= 0.0:
        return ""
    if any(low <= begins < high for low, high in _ERAS) and step < _SHORT:
        day = f"and begins at {digits(begins)}, as numbers of days do"
        return f"{said} {day}, hardly seconds: --time-unit d"
    units = [unit for unit in _LONG if _is_round(step * SECONDS[unit]) and step < _SHORT]
    if units and not (_is_round(step) or _is_round(1.0 / step)):
        every = f"{digits(step * SECONDS[units[0]])} s if that is in {units[0]}"
        return f"{said}, {every}, hardly seconds: --time-unit {units[0]}"
    if SHORTEST <= step < LONGEST:
        return ""
    return f"{said}, hardly seconds: --time-unit{' ms' if step >= LONGEST else ''}"


def _is_round(value: float) -> bool:
    leading = value / 10.0 ** np.floor(np.log10(value))
    return any(abs(leading - one) <= _NEAR * one for one in _ROUND)
