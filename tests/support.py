"""A model and its plain Python twin from one draw, and what tolerances are relative to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt
import reference
import strategies as own
from hypothesis import strategies as st

Array = npt.NDArray[np.float64]
AnyModel = mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii
AnyTwin = (
    reference.PrandtlIshlinskii
    | reference.ModifiedPrandtlIshlinskii
    | reference.SplitModifiedPrandtlIshlinskii
)

BAD = [math.nan, math.inf, -math.inf, 1e300, -1e300]
"""Samples that every stream refuses: not finite, or beyond 1e100."""


@dataclass(frozen=True)
class Drawn:
    """The arguments of a model."""

    keywords: own.ModelDict

    @property
    def _thresholds(self) -> list[str]:
        return [name for name in ("thresholds", "r", "ra", "rb", "rc") if name in self.keywords]

    def model(self) -> AnyModel:
        if "thresholds" in self.keywords:
            return mh.PrandtlIshlinskii(**self.keywords)
        return mh.ModifiedPrandtlIshlinskii(**self.keywords)

    def twin(self) -> AnyTwin:
        if "thresholds" in self.keywords:
            return reference.PrandtlIshlinskii(**self.keywords)
        if "weights_negative" in self.keywords:
            return reference.SplitModifiedPrandtlIshlinskii(**self.keywords)
        return reference.ModifiedPrandtlIshlinskii(**self.keywords)

    def zeros(self) -> list[float]:
        return [0.0] * len(self.weights)

    @property
    def weights(self) -> list[float]:
        return list(self.keywords["weights"])

    @property
    def weights_negative(self) -> list[float]:
        return list(self.keywords.get("weights_negative", self.weights))

    @property
    def slopes(self) -> tuple[float, float]:
        """The least and the most that the slope can be: no weight is negative."""
        pairs = zip(self.weights, self.weights_negative, strict=True)
        return min(self.weights[0], self.weights_negative[0]), sum(max(pair) for pair in pairs)

    def with_gaps_of_at_least(self, gap: float) -> Drawn:
        """The model, not split, with so much larger thresholds r and ra but for the identity."""
        keywords: Any = {k: v for k, v in self.keywords.items() if k != "weights_negative"}
        for name in {"thresholds", "r", "ra"} & keywords.keys():
            first, *others = keywords[name]
            keywords[name] = [first, *(threshold + gap for threshold in others)]
        return Drawn(keywords)

    @property
    def rest(self) -> float:
        """The input at which the model rests."""
        return float(self.keywords["input_offset"])

    @property
    def largest_threshold(self) -> float:
        return float(max(max(self.keywords[name]) for name in self._thresholds))

    def input_scale(self, xs: Sequence[float] | Array) -> float:
        """The largest number that the operators handle on this history; 1.0 if all are denormal."""
        return max(1.0, float(np.abs(xs).max()) + abs(self.rest) + self.largest_threshold)

    def output_scale(self, xs: Sequence[float] | Array) -> float:
        """The largest partial sum of the output on this history: one rounding is 1e-16 of it."""
        offset = abs(float(self.keywords["output_offset"]))
        pairs = zip(self.weights, self.weights_negative, strict=True)
        return sum(max(abs(w), abs(v)) for w, v in pairs) * self.input_scale(xs) + offset

    def drive_scale(self, xs: Sequence[float] | Array) -> float:
        """How far the drive moves for an error as large as the output: the slope is >= w_0."""
        return max(self.input_scale(xs), self.output_scale(xs) / self.slopes[0])

    def reordered(self, order: list[int], weights: list[float], below: list[float]) -> Drawn:
        """The same operators in another order and with other weights, split if they are."""
        columns = {n: [self.keywords[n][i] for i in order] for n in self._thresholds}
        given = {"weights": weights, "weights_negative": below}
        return Drawn({n: columns.get(n, given.get(n, v)) for n, v in self.keywords.items()})


def invertible_models(max_operators: int = 8) -> st.SearchStrategy[Drawn]:
    """Nested, w_0 > 0 on the identity, no negative weight."""
    modified = own.split_or_not(own.modified_models(max_operators))
    return (modified | own.conventional_models(max_operators)).map(Drawn)


@st.composite
def any_nested_models(draw: st.DrawFn, max_operators: int = 8) -> Drawn:
    """Nested, with weights of either sign and the operators in any order."""
    drawn = draw(invertible_models(max_operators))
    n = len(drawn.weights)
    weights = st.lists(st.floats(-10.0, 10.0), min_size=n, max_size=n)
    return drawn.reordered(draw(st.permutations(range(n))), draw(weights), draw(weights))


def unnested_models() -> st.SearchStrategy[Drawn]:
    """Invertible, split or not, and no order of the operators nests r and rb."""
    return own.split_or_not(_unnested_models()).map(Drawn)


def not_nested_models() -> st.SearchStrategy[Drawn]:
    """Invertible, split or not, r falling at least once."""
    return own.split_or_not(own.not_nested_models()).map(Drawn)


@st.composite
def _unnested_models(draw: st.DrawFn) -> own.ModelDict:
    """Invertible, and no order of the operators nests r and rb: the larger r has the smaller rb."""
    r, grow = draw(st.floats(1.0, 200.0)), draw(st.floats(1.1, 2.0))
    ra = draw(st.floats(1.0, 400.0))
    rb = draw(st.floats(0.1, 1.0))
    rows = [(0.0, 0.0, 0.0, 0.0), (r, ra, rb, 0.0), (r * grow, ra, rb / grow, r)]
    names = ("r", "ra", "rb", "rc")
    columns = (list(column) for column in zip(*rows, strict=True))
    offset = st.just(0.0) | st.floats(-100.0, 100.0)
    return {
        "weights": draw(own.weights(3)),
        **dict(zip(names, columns, strict=True)),
        "input_offset": draw(offset),
        "output_offset": draw(offset),
    }


def any_models() -> st.SearchStrategy[Drawn]:
    """Nested or not, invertible or not."""
    return any_nested_models() | unnested_models() | not_nested_models()


def any_invertible_models() -> st.SearchStrategy[Drawn]:
    """Nested or not."""
    return invertible_models() | unnested_models() | not_nested_models()


@st.composite
def with_history(
    draw: st.DrawFn, models: st.SearchStrategy[Drawn], histories: int = 1, max_moves: int = 20
) -> tuple[Any, ...]:
    """A model and one or more input histories that also land exactly on its thresholds."""
    drawn = draw(models)
    history = own.input_histories(drawn.keywords, max_moves=max_moves)
    return drawn, *(draw(history) for _ in range(histories))


@st.composite
def with_oscillations(draw: st.DrawFn, models: st.SearchStrategy[Drawn]) -> tuple[Any, ...]:
    """A model and a history of moves or of swings that grow or decay: many turning points."""
    drawn = draw(models)
    history = own.input_histories(drawn.keywords, max_moves=40) | own.oscillations()
    return drawn, draw(history)


def bits(values: float | Sequence[float] | Array) -> bytes:
    """Equal only if every bit is: tells +0 from -0."""
    return np.asarray(values, dtype=float).tobytes()


def steps(stream: mh.Forward | mh.Inverse, xs: Sequence[float] | Array) -> Array:
    return np.array([stream.step(float(x)) for x in xs])


def walk(points: Sequence[float], parts: int) -> Array:
    """Straight moves through the points, each in equal parts, the points themselves exact."""
    moves = [np.array([points[0]])]
    for a, b in pairwise(points):
        between = np.clip(a + (b - a) * (np.arange(1, parts) / parts), min(a, b), max(a, b))
        moves.append(np.append(between, b))
    return np.concatenate(moves)


# Streams of one simple model, as users make them.

Stream = mh.Forward | mh.Inverse

WALK = [10.0, -4.0, 5.5, 0.5, 3.0]
THRESHOLDS = np.arange(8.0)


def model(operators: int = 8) -> mh.PrandtlIshlinskii:
    return mh.PrandtlIshlinskii(np.ones(operators), THRESHOLDS[:operators])


def turning_points(operators: int = 8) -> list[Stream]:
    made = model(operators)
    return [made.forward(), made.inverse(), made.inverse((-20.0, 20.0))]


def banks(operators: int = 8) -> list[Stream]:
    made, zeros = model(operators), np.zeros(operators)
    return [made.forward(zeros), made.inverse(initial=zeros), made.inverse((-20.0, 20.0), zeros)]


def used(streams: list[Stream]) -> list[Stream]:
    for stream in streams:
        stream.run(WALK)
    return streams


def parameter_of(error: BaseException) -> str | None:
    """The argument that an error names; no class of Python declares the attribute."""
    found: str | None = getattr(error, "parameter", None)
    return found
