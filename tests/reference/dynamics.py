"""Linear dynamics from their differential equations, discretised for an input that is held.

The matrix exponential is summed as a Taylor series of the system and its held input, so nothing
here knows a closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

Matrix = list[list[float]]

TERMS = 24
"""Taylor terms at a norm below 1/2: the next is 0.5**24 / 24! = 1e-31."""


def _product(a: Matrix, b: Matrix) -> Matrix:
    return [
        [sum(x * y for x, y in zip(row, column, strict=True)) for column in zip(*b, strict=True)]
        for row in a
    ]


def matrix_exponential(a: Matrix) -> Matrix:
    """exp(a) by scaling, a Taylor series, and squaring."""
    n = len(a)
    norm = max(sum(map(abs, row)) for row in a)
    halvings = max(0, math.ceil(math.log2(norm)) + 1) if norm > 0.0 else 0
    small = [[x / 2.0**halvings for x in row] for row in a]
    identity = [[float(i == j) for j in range(n)] for i in range(n)]
    total, term = identity, identity
    for k in range(1, TERMS):
        term = [[x / k for x in row] for row in _product(term, small)]
        total = [
            [x + y for x, y in zip(p, q, strict=True)] for p, q in zip(total, term, strict=True)
        ]
    for _ in range(halvings):
        total = _product(total, total)
    return total


def held_response(a: Matrix, b: Sequence[float], u: Sequence[float], dt: float) -> list[float]:
    """The first state of x' = a x + b u from rest, as each u is put out and then held."""
    n = len(a)
    # the held input is one more state, with derivative zero
    joint = [[*(x * dt for x in row), gain * dt] for row, gain in zip(a, b, strict=True)]
    step = matrix_exponential([*joint, [0.0] * (n + 1)])
    x, outputs = [0.0] * n, []
    for level in u:
        outputs.append(x[0])
        state = [*x, level]
        x = [sum(p * q for p, q in zip(row, state, strict=True)) for row in step[:n]]
    return outputs


def second_order(frequency: float, damping: float, u: Sequence[float], dt: float) -> list[float]:
    """y'' + 2 zeta w y' + w^2 y = w^2 u; the states are y and y' / w."""
    w = 2.0 * math.pi * frequency
    return held_response([[0.0, w], [-w, -2.0 * damping * w]], [0.0, w], u, dt)


def first_order(frequency: float, u: Sequence[float], dt: float) -> list[float]:
    """y' = w (u - y)."""
    w = 2.0 * math.pi * frequency
    return held_response([[-w]], [w], u, dt)


def creep(
    amplitudes: Sequence[float], time_constants: Sequence[float], u: Sequence[float], dt: float
) -> list[float]:
    """The input and its lags: u + sum_k c_k x_k, tau_k x_k' + x_k = u."""
    lags = [held_response([[-1.0 / tau]], [1.0 / tau], u, dt) for tau in time_constants]
    return [
        level + sum(c * x for c, x in zip(amplitudes, states, strict=True))
        for level, *states in zip(u, *lags, strict=True)
    ]
