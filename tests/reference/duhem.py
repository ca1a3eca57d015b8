"""The free Duhem operator, and an oscillator with it inside, in plain Python.

z' = f+(z) x' where x rises, z' = f-(z) x' where it falls; f+ and f- are straight between knots.
Beyond them a line that grows outwards goes on, and f stays where the line falls. On a straight
stretch f = f0 + g (z - z0), so z = z0 + f0 (exp(g h) - 1) / g after a move by h.
Where f is below 0 all this holds for -z, but that f stays beyond the outer knots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

Line = tuple[float, float, float, float, float]  # from z, to z, reference z, f there, gradient


def lines(knots: Sequence[float], f: Sequence[float], stays: bool) -> list[Line]:
    gradients = [(f[i + 1] - f[i]) / (knots[i + 1] - knots[i]) for i in range(len(knots) - 1)]
    beyond = (0.0, 0.0) if stays else (min(gradients[0], 0.0), max(gradients[-1], 0.0))
    first = (-math.inf, knots[0], knots[0], f[0], beyond[0])
    last = (knots[-1], math.inf, knots[-1], f[-1], beyond[1])
    inner = [(knots[i], knots[i + 1], knots[i], f[i], g) for i, g in enumerate(gradients)]
    return [first, *inner, last]


class Duhem:
    """One move after the other, each from where z is: no anchor is remembered."""

    def __init__(
        self, knots: Sequence[float], rising: Sequence[float], falling: Sequence[float]
    ) -> None:
        falls = rising[0] < 0.0
        self.sign = -1.0 if falls else 1.0
        if falls:
            knots = [-z for z in reversed(knots)]
            rising, falling = ([-f for f in reversed(one)] for one in (rising, falling))
        self.rising = lines(knots, rising, falls)
        # A falling branch is a rising one of -z over -x.
        self.falling = lines([-z for z in reversed(knots)], list(reversed(falling)), falls)
        self.x = self.z = 0.0

    def step(self, x: float) -> float:
        sign = 1.0 if x >= self.x else -1.0
        left, z = sign * (x - self.x), sign * self.sign * self.z
        for start, end, reference, at_reference, gradient in (
            self.rising if sign > 0 else self.falling
        ):
            if not start <= z < end:
                continue
            f = at_reference + gradient * (z - reference)
            there = z + (
                f * left if gradient == 0.0 else f * math.expm1(gradient * left) / gradient
            )
            if there < end:
                z, left = there, 0.0
                break
            rise = end - z
            left -= rise / f if gradient == 0.0 else math.log1p(gradient * rise / f) / gradient
            z, left = end, max(left, 0.0)
        self.x, self.z = x, sign * self.sign * z
        return self.z


def oscillator(
    parameters: tuple[float, float, float],
    slope: Callable[[float, bool], float],
    u: Sequence[float],
    dt: float,
    parts: int,
) -> list[float]:
    """y'' + c y' + k y + z = b u by the midpoint rule in small steps, u held: the positions."""
    b, c, k = parameters
    y = v = z = 0.0
    h, found = dt / parts, []
    for drive in u:
        found.append(y)
        for _ in range(parts):
            y1 = y + 0.5 * h * v
            v1 = v + 0.5 * h * (b * drive - c * v - k * y - z)
            z1 = z + 0.5 * h * slope(z, v > 0.0) * v
            y, v, z = (
                y + h * v1,
                v + h * (b * drive - c * v1 - k * y1 - z1),
                z + h * slope(z1, v1 > 0.0) * v1,
            )
    return found
