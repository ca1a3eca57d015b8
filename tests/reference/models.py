"""Weighted sums of operators, evaluated by the plain loop: equations (4) and (6).

y = output_offset + sum_i w_i H_i[x - input_offset]

For the actuator: x and thresholds in volts, y in micrometres, weights in um/V. For an
inverse model (7) the units swap. Every operator sees every sample; the sum is correctly
rounded (``math.fsum``), so ``peek`` is monotone in x for non-negative weights to the bit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from .operators import Array, CoupledPlay, Mirrored, Numbers, OneSidedPlay, Operator, Play


class Model:
    """A bank of operators with weights and two offsets; the common part of both models."""

    def __init__(
        self,
        weights: Numbers,
        operators: Iterable[Operator],
        input_offset: float,
        output_offset: float,
    ) -> None:
        self.weights = [float(w) for w in weights]
        self.operators = list(operators)
        self.input_offset = float(input_offset)
        self.output_offset = float(output_offset)
        if not self.weights or len(self.weights) != len(self.operators):
            raise ValueError(
                f"weights: expected one per operator and at least one, "
                f"got {len(self.weights)} for {len(self.operators)} operators"
            )
        if not all(map(math.isfinite, (*self.weights, self.input_offset, self.output_offset))):
            raise ValueError("weights and offsets: expected finite numbers")

    def _sum(self, z: Iterable[float]) -> float:
        return math.fsum(
            [self.output_offset, *(w * v for w, v in zip(self.weights, z, strict=True))]
        )

    @property
    def outputs(self) -> list[float]:
        """The operator states z_i, length n. Assign a list to start from any z0."""
        return [op.state for op in self.operators]

    @outputs.setter
    def outputs(self, z: Numbers) -> None:
        if len(z) != len(self.operators):
            raise ValueError(f"outputs: expected {len(self.operators)} values, got {len(z)}")
        for op, value in zip(self.operators, z, strict=True):
            op.state = float(value)

    def step(self, x: float) -> float:
        """Advance every operator by one sample and return y(k)."""
        u = float(x) - self.input_offset
        return self._sum([op.step(u) for op in self.operators])

    def peek(self, x: float) -> float:
        """The output ``step(x)`` would give; changes nothing."""
        u = float(x) - self.input_offset
        return self._sum([op.peek(u) for op in self.operators])

    def run(self, xs: Iterable[float] | Array) -> Array:
        """``step`` over every sample; returns float64, shape (samples,)."""
        return np.array([self.step(x) for x in xs], dtype=float)

    def reset(self) -> None:
        """Back to the virgin state, all z_i = 0."""
        for op in self.operators:
            op.reset()

    @property
    def outer_slopes(self) -> tuple[float, float]:
        """The slope below the lowest and above the highest kink, where every operator slides."""
        return sum(self.weights), sum(self.weights)

    @property
    def least_slope(self) -> float:
        """The weight of the identity if no weight is negative, else 0: no slope is below it."""
        pairs = zip(self.weights, self.operators, strict=True)
        return sum(w for w, op in pairs if op.is_identity) if min(self.weights) >= 0 else 0.0

    def kinks(self) -> list[float]:
        """All inputs, sorted, where the slope of ``peek`` can change in the present state."""
        points = {u + self.input_offset for op in self.operators for u in op.kinks()}
        return sorted(points)


class PrandtlIshlinskii(Model):
    """Conventional model, equation (4): y = output_offset + sum_i w_i z_i with plays (3).

    ``weights`` and ``thresholds``: sequences of equal length n >= 1, thresholds >= 0.
    """

    def __init__(
        self,
        weights: Numbers,
        thresholds: Numbers,
        *,
        input_offset: float = 0.0,
        output_offset: float = 0.0,
    ) -> None:
        plays = [Play(float(r)) for r in thresholds]
        super().__init__(weights, plays, input_offset, output_offset)


class ModifiedPrandtlIshlinskii(Model):
    """Modified model, equation (6): y = output_offset + sum_i w_i z_i with coupled plays (5).

    ``weights``, ``r``, ``ra``, ``rb``, ``rc``: sequences of equal length n >= 1 with
    r >= rc >= 0 and ra >= rb >= 0. An operator with all thresholds zero is the identity.
    """

    def __init__(
        self,
        weights: Numbers,
        r: Numbers,
        ra: Numbers,
        rb: Numbers,
        rc: Numbers,
        *,
        input_offset: float = 0.0,
        output_offset: float = 0.0,
    ) -> None:
        plays = [CoupledPlay(*map(float, t)) for t in zip(r, ra, rb, rc, strict=True)]
        super().__init__(weights, plays, input_offset, output_offset)


class SplitModifiedPrandtlIshlinskii(Model):
    """Modified model with weights v of its own below zero.

    y = output_offset + sum_i w_i p(x; r_i, rb_i) - v_i p(-x; ra_i, rc_i)

    with one-sided plays p, every one an operator of this bank: first those above zero, then
    the mirrored ones below. ``outputs`` are the n coupled plays, each the sum of its two.
    """

    def __init__(
        self,
        weights: Numbers,
        r: Numbers,
        ra: Numbers,
        rb: Numbers,
        rc: Numbers,
        *,
        weights_negative: Numbers,
        input_offset: float = 0.0,
        output_offset: float = 0.0,
    ) -> None:
        above = [OneSidedPlay(a, b) for a, b in zip(r, rb, strict=True)]
        below = [Mirrored(OneSidedPlay(a, b)) for a, b in zip(ra, rc, strict=True)]
        self.n = len(above)
        both = [*map(float, weights), *map(float, weights_negative)]
        super().__init__(both, [*above, *below], input_offset, output_offset)
        self._identities = [z.a == 0 == n.play.a for z, n in zip(above, below, strict=True)]

    @property
    def outputs(self) -> list[float]:
        """The coupled plays z_i, length n. Assign a list to start from any z0."""
        z = [op.state for op in self.operators]
        return [p + q for p, q in zip(z[: self.n], z[self.n :], strict=True)]

    @outputs.setter
    def outputs(self, z: Numbers) -> None:
        if len(z) != self.n:
            raise ValueError(f"outputs: expected {self.n} values, got {len(z)}")
        halves = [*(max(v, 0.0) for v in z), *(min(v, 0.0) for v in z)]
        for op, value in zip(self.operators, halves, strict=True):
            op.state = float(value)

    @property
    def outer_slopes(self) -> tuple[float, float]:
        """Below all kinks the plays of the family below zero slide, above them the others."""
        return sum(self.weights[self.n :]), sum(self.weights[: self.n])

    @property
    def least_slope(self) -> float:
        """The smaller weight of every identity if no weight is negative, else 0."""
        if min(self.weights) < 0:
            return 0.0
        pairs = zip(self.weights[: self.n], self.weights[self.n :], self._identities, strict=True)
        return sum(min(w, v) for w, v, identity in pairs if identity)
