"""Several axes with hysteresis in front of or inside their dynamics, in plain Python.

x+ = A x + B u + Bw w, q = Cq x + Dq u, w_i = H_i[q_i], y = C x + D u + offset. A play of
threshold r: z = max(q - r, min(q + r, z)).
"""

from __future__ import annotations

from collections.abc import Sequence

from reference.duhem import Duhem

Matrix = Sequence[Sequence[float]]


class Plays:
    """A sum of plays."""

    def __init__(self, thresholds: Sequence[float], weights: Sequence[float]) -> None:
        self.thresholds, self.weights = thresholds, weights
        self.outputs = [0.0] * len(thresholds)

    def step(self, q: float) -> float:
        pairs = zip(self.thresholds, self.outputs, strict=True)
        self.outputs = [max(q - r, min(q + r, z)) for r, z in pairs]
        return sum(w * z for w, z in zip(self.weights, self.outputs, strict=True))


def product(matrix: Matrix, vector: Sequence[float]) -> list[float]:
    return [sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix]


def positions(
    matrices: dict[str, Matrix],
    operators: Sequence[Plays | Duhem],
    offset: Sequence[float],
    u: Matrix,
) -> list[list[float]]:
    """The positions y(k) of a stage that begins at rest."""
    x = [0.0] * len(matrices["a"])
    found = []
    for drives in u:
        seen, fed = product(matrices["c"], x), product(matrices["d"], drives)
        found.append([a + b + c for a, b, c in zip(seen, fed, offset, strict=True)])
        queries = [
            a + b
            for a, b in zip(
                product(matrices["cq"], x), product(matrices["dq"], drives), strict=True
            )
        ]
        w = [operator.step(q) for operator, q in zip(operators, queries, strict=True)]
        parts = (
            product(matrices["a"], x),
            product(matrices["b"], drives),
            product(matrices["bw"], w),
        )
        x = [sum(terms) for terms in zip(*parts, strict=True)]
    return found
