"""`run` on an array of samples, forward and inverse, beside loops over all operators."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from yardsticks import LOOPS, OPERATORS, SAMPLES, SIGNALS, Array, Parameters, instructions, same

EVERY_SIGNAL = pytest.mark.parametrize("signal", SIGNALS)
EVERY_SIZE = pytest.mark.parametrize("n", OPERATORS)


def describe(benchmark: BenchmarkFixture, case: str, n: int, signal: str) -> None:
    benchmark.group = f"run, {SAMPLES} samples, n = {n}, {signal}"
    benchmark.extra_info.update(face="run", case=case, n=n, signal=signal, samples=SAMPLES)
    benchmark.extra_info.update(instructions=instructions())


def made(n: int, signal: str) -> tuple[Parameters, Array, Array]:
    """Parameters, drive and the position that belongs to it."""
    parameters, drive = Parameters.of(n), SIGNALS[signal]
    return parameters, drive, parameters.model().forward().run(drive)


METHODS: dict[str, Literal["turning_points", "bank"]] = {
    "forward": "turning_points",
    "bank": "bank",
}


@EVERY_SIGNAL
@EVERY_SIZE
@pytest.mark.parametrize("case", METHODS)
def test_forward(benchmark: BenchmarkFixture, case: str, n: int, signal: str) -> None:
    describe(benchmark, case, n, signal)
    parameters, drive, position = made(n, signal)
    stream, out = parameters.model().forward(method=METHODS[case]), np.empty(SAMPLES)

    def run() -> None:
        stream.reset()
        stream.run(drive, out)

    benchmark(run)
    assert same(out, position)


@EVERY_SIGNAL
@EVERY_SIZE
def test_inverse(benchmark: BenchmarkFixture, n: int, signal: str) -> None:
    describe(benchmark, "inverse", n, signal)
    parameters, drive, position = made(n, signal)
    stream, out = parameters.model().inverse(), np.empty(SAMPLES)

    def run() -> None:
        stream.reset()
        stream.run(position, out)

    benchmark(run)
    assert same(out, drive)


@EVERY_SIGNAL
@EVERY_SIZE
@pytest.mark.parametrize("loop", LOOPS)
def test_loop(benchmark: BenchmarkFixture, loop: str, n: int, signal: str) -> None:
    describe(benchmark, loop, n, signal)
    p, drive, position = made(n, signal)
    out = np.empty(SAMPLES)
    arguments = (drive, p.weights, p.r, p.ra, p.rb, p.rc, out)
    LOOPS[loop](*arguments)  # compiled before it is timed
    assert same(out, position)
    benchmark(LOOPS[loop], *arguments)
