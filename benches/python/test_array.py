"""`step` on an array of actuators, one call per instant, beside a loop over all of them."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from yardsticks import ARRAY_LOOPS, LOOPS, Array, Parameters, instructions, same

OPERATORS = 20
ACTUATORS = 1000
ROWS = 200

PARAMETERS = Parameters.of(OPERATORS)


def drives() -> Array:
    """A period of 50 Hz at 10 kHz, each actuator at a phase of its own."""
    phases = np.linspace(0.0, 1.0, ACTUATORS)
    return 500.0 * np.sin(2.0 * np.pi * (np.arange(ROWS)[:, None] / ROWS + phases))


DRIVES = drives()
ARRAY = mh.ActuatorArray([PARAMETERS.model()] * ACTUATORS)
POSITIONS = ARRAY.forward().run(DRIVES)


def describe(benchmark: BenchmarkFixture, case: str) -> None:
    benchmark.group = f"array of {ACTUATORS}, n = {OPERATORS}, {ROWS} instants"
    benchmark.extra_info.update(face="array", case=case, n=OPERATORS, samples=DRIVES.size)
    benchmark.extra_info.update(instructions=instructions())


@pytest.mark.parametrize("case", ["forward.step", "inverse.step"])
def test_steps(benchmark: BenchmarkFixture, case: str) -> None:
    describe(benchmark, case)
    stream: mh.ForwardArray | mh.InverseArray
    stream = ARRAY.forward() if case == "forward.step" else ARRAY.inverse()
    given, expected = (DRIVES, POSITIONS) if case == "forward.step" else (POSITIONS, DRIVES)
    out = np.empty_like(given)

    def steps() -> None:
        stream.reset()
        for row, result in zip(given, out, strict=True):
            stream.step(row, result)

    benchmark(steps)
    assert same(out, expected)


@pytest.mark.parametrize("threads", [1, 2])
def test_run(benchmark: BenchmarkFixture, threads: int) -> None:
    describe(benchmark, f"forward.run, threads = {threads}")
    stream, out = ARRAY.forward(), np.empty_like(DRIVES)

    def run() -> None:
        stream.reset()
        stream.run(DRIVES, out, threads=threads)

    benchmark(run)
    assert same(out, POSITIONS)


@pytest.mark.parametrize("loop", ARRAY_LOOPS)
def test_loop(benchmark: BenchmarkFixture, loop: str) -> None:
    describe(benchmark, loop)
    p, out = PARAMETERS, np.empty_like(DRIVES)
    z = np.zeros((ACTUATORS, OPERATORS))

    def steps() -> None:
        z[:] = 0.0
        for row, result in zip(DRIVES, out, strict=True):
            ARRAY_LOOPS[loop](row, p.weights, p.r, p.ra, p.rb, p.rc, z, result)

    steps()  # compiled before it is timed
    assert same(out, POSITIONS)
    benchmark(steps)


def test_one_actuator_is_the_loop() -> None:
    p, out = PARAMETERS, np.empty(ROWS)
    drive = np.ascontiguousarray(DRIVES[:, 7])
    LOOPS["numba"](drive, p.weights, p.r, p.ra, p.rb, p.rc, out)
    assert same(POSITIONS[:, 7], out)
