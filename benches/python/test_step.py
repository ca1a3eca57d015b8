"""`step`, one call per sample, beside the cheapest calls that Python knows."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from yardsticks import Parameters, same

CALLS = 1000
OPERATORS = 20

DRIVE = 250.0 - 250.0 * np.cos(2.0 * np.pi * np.arange(CALLS) / CALLS)  # V; square roots exist


class Empty:
    """What any method costs that is written in Python."""

    def step(self, sample: float) -> float:
        return sample


def call_each(function: Callable[[float], float], samples: list[float]) -> None:
    for sample in samples:
        function(sample)


FORWARD = Parameters.of(OPERATORS).model().forward()
INVERSE = Parameters.of(OPERATORS).model().inverse()
POSITION = Parameters.of(OPERATORS).model().forward().run(DRIVE)

CASES: dict[str, tuple[Callable[[float], float], list[float]]] = {
    "math.sqrt": (math.sqrt, DRIVE.tolist()),
    "empty Python method": (Empty().step, DRIVE.tolist()),
    "forward.step": (FORWARD.step, DRIVE.tolist()),
    "inverse.step": (INVERSE.step, POSITION.tolist()),
}


@pytest.mark.parametrize("case", CASES)
def test_call(benchmark: BenchmarkFixture, case: str) -> None:
    benchmark.group = f"step, {CALLS} calls"
    benchmark.extra_info.update(face="step", case=case, n=OPERATORS, samples=CALLS)
    benchmark(call_each, *CASES[case])


def test_steps_are_those_of_run() -> None:
    model = Parameters.of(OPERATORS).model()
    forward, inverse = model.forward(), model.inverse()
    assert same(np.array([forward.step(x) for x in DRIVE.tolist()]), POSITION)
    assert same(np.array([inverse.step(y) for y in POSITION.tolist()]), DRIVE)
