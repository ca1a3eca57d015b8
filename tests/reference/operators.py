"""Hysteresis operators, one float at a time, written from the paper's equations.

Inputs, outputs, states and thresholds share one unit (volts for the actuator model,
micrometres for its inverse). Inputs are expected to be finite.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Numbers = Sequence[float] | Array


def _check(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


class Operator:
    """z(k) = max(lo(x), min(hi(x), z(k-1))) with lo <= hi, both non-decreasing in x.

    ``state`` is z (0.0 at first). The first sample projects it onto [lo(x), hi(x)], as
    every sample does, so no special start is needed (erratum 6). ``is_identity``: z = x in
    any state.
    """

    state: float = 0.0
    is_identity: bool = False

    def lo(self, x: float) -> float:
        """Least output the operator may have at input x (followed when rising)."""
        raise NotImplementedError

    def hi(self, x: float) -> float:
        """Greatest output the operator may have at input x (followed when falling)."""
        raise NotImplementedError

    def kinks(self) -> tuple[float, ...]:
        """Inputs at which the slope of ``peek`` can change in the present state."""
        raise NotImplementedError

    def peek(self, x: float) -> float:
        """The output ``step(x)`` would give; changes nothing. Non-decreasing in x."""
        return max(self.lo(x), min(self.hi(x), self.state))

    def step(self, x: float) -> float:
        """Advance by one sample and return z(k)."""
        self.state = self.peek(x)
        return self.state

    def run(self, xs: Iterable[float] | Array) -> Array:
        """``step`` over every sample; returns float64, shape (samples,)."""
        return np.array([self.step(float(x)) for x in xs], dtype=float)

    def reset(self) -> None:
        """Back to the virgin state z = 0."""
        self.state = 0.0


class Play(Operator):
    """Play operator with threshold r >= 0, equations (1)-(3).

    z(k) = max(x - r, min(x + r, z(k-1)))
    """

    def __init__(self, r: float) -> None:
        _check(math.isfinite(r) and r >= 0, f"threshold: expected finite r >= 0, got {r}")
        self.r = float(r)
        self.is_identity = self.r == 0

    def lo(self, x: float) -> float:
        """x - r"""
        return x - self.r

    def hi(self, x: float) -> float:
        """x + r"""
        return x + self.r

    def kinks(self) -> tuple[float, ...]:
        """Where x - r and x + r meet z."""
        return (self.state - self.r, self.state + self.r)


class CoupledPlay(Operator):
    """Coupled-play operator, equation (5) with errata 1-6: r >= rc >= 0, ra >= rb >= 0.

    lo(x) = max(x - r, min(0, x - rc))       rising: sticks at zero from x = rc to x = r
    hi(x) = min(x + ra, max(0, x + rb))      falling: sticks at zero from x = -rb to x = -ra
    z(k) = max(lo, min(hi, z(k-1)))
    """

    def __init__(self, r: float, ra: float, rb: float, rc: float) -> None:
        finite = all(map(math.isfinite, (r, ra, rb, rc)))
        _check(finite and r >= rc >= 0, f"rising: expected r >= rc >= 0, got r={r}, rc={rc}")
        _check(finite and ra >= rb >= 0, f"falling: expected ra >= rb >= 0, got ra={ra}, rb={rb}")
        self.r, self.ra, self.rb, self.rc = float(r), float(ra), float(rb), float(rc)
        self.is_identity = self.r == self.ra == 0

    def lo(self, x: float) -> float:
        """max(x - r, min(0, x - rc))"""
        return max(x - self.r, min(0.0, x - self.rc))

    def hi(self, x: float) -> float:
        """min(x + ra, max(0, x + rb))"""
        return min(x + self.ra, max(0.0, x + self.rb))

    def kinks(self) -> tuple[float, ...]:
        """Where lo and hi bend, and where each of their straight pieces meets z."""
        z, r, ra, rb, rc = self.state, self.r, self.ra, self.rb, self.rc
        return (-ra, -rb, rc, r, z - ra, z - rb, z + rc, z + r)


class OneSidedPlay(Operator):
    """One-sided play with a, b >= 0, never negative (item 1 of the engine page).

    p(k) = max(0, x - a, min(x + b, p(k-1)))

    A coupled play is p(x; a=r, b=rb) - p(-x; a=ra, b=rc).
    """

    def __init__(self, a: float, b: float) -> None:
        finite = math.isfinite(a) and math.isfinite(b)
        _check(finite and a >= 0 and b >= 0, f"expected finite a, b >= 0, got a={a}, b={b}")
        self.a, self.b = float(a), float(b)

    def lo(self, x: float) -> float:
        """max(0, x - a)"""
        return max(0.0, x - self.a)

    def hi(self, x: float) -> float:
        """max(0, x + b)"""
        return max(0.0, x + self.b)

    def kinks(self) -> tuple[float, ...]:
        """Where lo and hi leave zero, and where each of them meets the output."""
        return (self.a, -self.b, self.state + self.a, self.state - self.b)


class Mirrored(Operator):
    """-p(-x) of a one-sided play p: what a coupled play is below zero, never positive."""

    def __init__(self, play: OneSidedPlay) -> None:
        self.play = play

    def lo(self, x: float) -> float:
        """-hi(-x) of the play."""
        return -self.play.hi(-x)

    def hi(self, x: float) -> float:
        """-lo(-x) of the play."""
        return -self.play.lo(-x)

    def kinks(self) -> tuple[float, ...]:
        """Where lo and hi leave zero, and where each of them meets the output."""
        a, b, z = self.play.a, self.play.b, self.state
        return (-a, b, z - a, z + b)


def printed_coupled_play(
    xs: Iterable[float] | Array,
    r: float,
    ra: float,
    rb: float,
    rc: float,
    *,
    errata: Sequence[int] = (),
) -> Array:
    """Equation (5) as printed, for comparison only; returns z, shape (samples,).

    Reconstructed from the errata list, not transcribed: which comparisons are strict is a
    choice, and so is taking each z(k-1) condition as "the move carries z further".

    rising,  x(k) >= x(k-1):  x(k) < rc  and x(k) - rc >= z(k-1):  z(k) = x(k) - rc
                              x(k) >= rc and x(k) - r  >= z(k-1):  z(k) = x(k) - r
    falling, x(k) < x(k-1):   x(k) > -rb and x(k) + rb <= z(k-1):  z(k) = x(k) - rb
                              x(k) <= -rb and x(k) + ra <= z(k-1): z(k) = x(k) - ra
    others:                                                        z(k) = x(k-1)
    start:                                                         x = 0, z = 0

    ``errata`` names the corrections to apply: 1 puts + in the two falling outputs; 3 makes
    "others" hold z(k-1); 2 is the sign in the remark "ra != -r or rb != -rc", which changes
    no number. With (1, 2, 3) what is left is erratum 4: when a sample jumps over x = rc or
    x = -rb, z stays off zero by the part of the move not taken, so the result depends on
    the sampling. ``CoupledPlay`` is the form without that error.
    """
    _check(set(errata) <= {1, 2, 3}, f"errata: expected a subset of 1, 2, 3, got {errata}")
    sign = 1.0 if 1 in errata else -1.0
    x_old, z = 0.0, 0.0
    out = []
    for x in map(float, xs):
        others = z if 3 in errata else x_old
        if x >= x_old:
            target = x - rc if x < rc else x - r
            z = target if target >= z else others
        else:
            shift = rb if x > -rb else ra
            z = x + sign * shift if x + shift <= z else others
        x_old = x
        out.append(z)
    return np.array(out, dtype=float)
