"""Inverses: closed form for plays, the Table II construction, and the exact one.

Item numbers are those under "What the tables contain" in the paper digest.
"""

from __future__ import annotations

import copy
import math
from bisect import bisect_right
from collections.abc import Iterable

import numpy as np

from .models import Model
from .operators import Array, Numbers


def closed_form_inverse(weights: Numbers, thresholds: Numbers) -> tuple[Array, Array]:
    """Weights and thresholds (w', r'), shape (n,), of the exact inverse of model (4). Item 1.

    S_i  = sum_{j<=i} w_j
    w'_0 = 1 / w_0,  w'_i = -w_i / (S_i S_{i-1})
    r'_i = sum_{j<=i} w_j (r_i - r_j)

    Needs 0 = r_0 <= r_1 <= ... and every S_i > 0. With w in um/V and r in volts, w' is in
    V/um and r' in um. Offsets, if the model has any, swap their roles.
    """
    w, r = np.array(weights, dtype=float), np.array(thresholds, dtype=float)
    if w.shape != r.shape or w.ndim != 1 or w.size == 0:
        raise ValueError(f"expected two sequences of equal length, got {w.shape}, {r.shape}")
    total = np.cumsum(w)
    if r[0] != 0 or np.any(np.diff(r) < 0) or np.any(total <= 0):
        raise ValueError("expected 0 = r_0 <= r_1 <= ... and every sum of leading weights > 0")
    w_prime = np.concatenate([1 / w[:1], -w[1:] / (total[1:] * total[:-1])])
    r_prime = np.array([np.sum(w[: i + 1] * (r[i] - r[: i + 1])) for i in range(w.size)])
    return w_prime, r_prime


def recovered_weights(w_prime: Numbers) -> Array:
    """The forward weights behind inverse weights w', shape (n,). Item 2.

    w_i = 1 / sum_{j<=i} w'_j - 1 / sum_{j<i} w'_j,  w_0 = 1 / w'_0

    From Table II (V/um) this gives um/V with four more digits than Table I prints.
    """
    leading = 1 / np.cumsum(np.array(w_prime, dtype=float))
    return np.diff(leading, prepend=0.0)


def parametric_inverse(
    weights: Numbers,
    r: Numbers,
    ra: float = 0.90,
    rb: float = 0.35,
    rc: float = 0.35,
) -> tuple[Array, Array, Array, Array, Array]:
    """(w', r', ra', rb', rc') of model (7), each shape (n,): how Table II was made. Item 1.

    (w', r') is the closed-form inverse of (weights, r); then ra' = ra r', rb' = rb r',
    rc' = rc r' with the given ratios. Only an approximate inverse of model (6) (erratum 8).
    """
    w_prime, r_prime = closed_form_inverse(weights, r)
    return w_prime, r_prime, ra * r_prime, rb * r_prime, rc * r_prime


class ExactInverse:
    """Sample-by-sample inverse of a model: desired output y in, drive x out.

    x(k) solves model.peek(x) = y(k) in the state left by x(k-1), and then drives an own
    copy of the model. In any state peek is a rising polyline in x whose kinks are known
    (``Model.kinks``): bisect them for the piece that holds y, interpolate on it, and
    beyond the outermost kinks, where every operator slides, go on with the sum of weights.

    Needs every w_i >= 0 and a positive weight on an operator without any threshold (the
    identity), so that no piece is flat.

    ``limits`` = (low, high) of the drive. A target out of reach gives the limit, sets
    ``saturated`` for that step, and the memory advances to the limit.

    The copy starts in the state the model has now; ``reset`` makes it virgin.
    """

    def __init__(self, model: Model, limits: tuple[float, float] | None = None) -> None:
        if model.least_slope <= 0:
            raise ValueError("not invertible: expected weights >= 0 and an identity with w > 0")
        if limits is not None and not -math.inf < limits[0] < limits[1] < math.inf:
            raise ValueError(f"limits: expected finite low < high, got {limits}")
        self.model = copy.deepcopy(model)
        self.limits = limits
        self.saturated = False

    def _solve(self, y: float) -> tuple[float, bool]:
        peek, kinks = self.model.peek, self.model.kinks()
        if self.limits is not None:
            low, high = map(float, self.limits)
            if y < peek(low):
                return low, True
            if y > peek(high):
                return high, True
            kinks = [low, *(x for x in kinks if low < x < high), high]
        above = bisect_right(kinks, y, key=peek)  # first kink whose output exceeds y
        if above in (0, len(kinks)):
            end = kinks[max(above - 1, 0)]
            x = end + (y - peek(end)) / self.model.outer_slopes[above > 0]
            return (x if self.limits is None else end), False
        x0, x1 = kinks[above - 1], kinks[above]
        y0, y1 = peek(x0), peek(x1)
        return min(x0 + (x1 - x0) * ((y - y0) / (y1 - y0)), x1), False

    def step(self, y: float) -> float:
        """Drive x(k) that gives output y, or the nearest limit; advances the memory."""
        x, self.saturated = self._solve(float(y))
        self.model.step(x)
        return x

    def peek(self, y: float) -> float:
        """The drive ``step(y)`` would give; changes nothing."""
        return self._solve(float(y))[0]

    def run(self, ys: Iterable[float] | Array) -> Array:
        """``step`` over every sample; returns float64, shape (samples,)."""
        return np.array([self.step(y) for y in ys], dtype=float)

    def reset(self) -> None:
        """Back to the virgin state."""
        self.model.reset()
        self.saturated = False
