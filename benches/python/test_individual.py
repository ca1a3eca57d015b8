"""`step` on actuators that each have a model of their own, beside a loop over all of them."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from yardsticks import INDIVIDUAL_LOOPS, RATE, Parameters, instructions, same

OPERATORS = 20
ACTUATORS = 4096
FREQUENCY = 5.0  # Hz
AMPLITUDE = 443.0  # V, for 2.5 µm

PARAMETERS = [Parameters.individual(OPERATORS, m) for m in range(ACTUATORS)]
PARTS = ("weights", "r", "ra", "rb", "rc")
ARRAY = mh.ActuatorArray([parameters.model() for parameters in PARAMETERS])
TIME = np.arange(0.0, 1.0 / FREQUENCY, 1.0 / RATE)[:, None]  # one period
PHASES = np.random.default_rng(1).uniform(0.0, 1.0, ACTUATORS)
DRIVES = AMPLITUDE * np.sin(2.0 * np.pi * (FREQUENCY * TIME + PHASES))
POSITIONS = ARRAY.forward().run(DRIVES)


def describe(benchmark: BenchmarkFixture, case: str) -> None:
    benchmark.group = f"{ACTUATORS} models, n = {OPERATORS}, a period of {FREQUENCY} Hz"
    benchmark.extra_info.update(face="individual", case=case, n=OPERATORS, samples=DRIVES.size)
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


@pytest.mark.parametrize("loop", INDIVIDUAL_LOOPS)
def test_loop(benchmark: BenchmarkFixture, loop: str) -> None:
    describe(benchmark, loop)
    stacked = [np.stack([getattr(parameters, part) for parameters in PARAMETERS]) for part in PARTS]
    z, out = np.zeros((ACTUATORS, OPERATORS)), np.empty_like(DRIVES)

    def steps() -> None:
        z[:] = 0.0
        for row, result in zip(DRIVES, out, strict=True):
            INDIVIDUAL_LOOPS[loop](row, *stacked, z, result)

    steps()  # compiled before it is timed
    assert same(out, POSITIONS)
    benchmark(steps)
