"""`step` on an array of actuators, one call per instant, beside a loop over all of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mpi_hyst as mh
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from yardsticks import (
    ARRAY_LOOPS,
    INDIVIDUAL_LOOPS,
    LOOPS,
    RATE,
    Array,
    Parameters,
    instructions,
    same,
)

OPERATORS = 20
PARTS = ("weights", "r", "ra", "rb", "rc")


@dataclass(frozen=True)
class Actuators:
    """Actuators with parameters of their own, or all with the same, each elsewhere in a sine."""

    parameters: list[Parameters]
    phases: Array
    amplitude: float  # V
    frequency: float  # Hz

    @cached_property
    def array(self) -> mh.ActuatorArray:
        """The package's array."""
        models = [parameters.model() for parameters in self.parameters]
        return mh.ActuatorArray(models if len(models) > 1 else models * self.phases.size)

    @cached_property
    def stacked(self) -> list[Array]:
        """The parameters as the loops take them: a row for each actuator, or one for all."""
        rows = [np.stack([getattr(one, part) for one in self.parameters]) for part in PARTS]
        return rows if len(self.parameters) > 1 else [part[0] for part in rows]

    @cached_property
    def drives(self) -> Array:
        """A period, a row for each instant."""
        periods = np.arange(0.0, 1.0, self.frequency / RATE)[:, None] + self.phases
        return self.amplitude * np.sin(2.0 * np.pi * periods)

    @cached_property
    def positions(self) -> Array:
        """What belongs to the drives."""
        return self.array.forward().run(self.drives)


LOOPS_OF = {"array": ARRAY_LOOPS, "individual": INDIVIDUAL_LOOPS}
FACES = {
    "array": Actuators(
        [Parameters.of(OPERATORS)], np.linspace(0.0, 1.0, 1000), amplitude=500.0, frequency=50.0
    ),
    # 2.5 µm at 5 Hz.
    "individual": Actuators(
        [Parameters.individual(OPERATORS, m) for m in range(4096)],
        np.random.default_rng(1).uniform(0.0, 1.0, 4096),
        amplitude=443.0,
        frequency=5.0,
    ),
}


EVERY_FACE = pytest.mark.parametrize("face", FACES)


def describe(benchmark: BenchmarkFixture, face: str, case: str) -> Actuators:
    actuators = FACES[face]
    rows, count = actuators.drives.shape
    benchmark.group = f"{face} of {count}, n = {OPERATORS}, {rows} instants"
    benchmark.extra_info.update(face=face, case=case, n=OPERATORS, samples=rows * count)
    benchmark.extra_info.update(instructions=instructions())
    return actuators


@EVERY_FACE
@pytest.mark.parametrize("case", ["forward.step", "inverse.step"])
def test_steps(benchmark: BenchmarkFixture, face: str, case: str) -> None:
    actuators = describe(benchmark, face, case)
    array, drives, positions = actuators.array, actuators.drives, actuators.positions
    stream: mh.ForwardArray | mh.InverseArray
    stream = array.forward() if case == "forward.step" else array.inverse()
    given, expected = (drives, positions) if case == "forward.step" else (positions, drives)
    out = np.empty_like(given)

    def steps() -> None:
        stream.reset()
        for row, result in zip(given, out, strict=True):
            stream.step(row, result)

    benchmark(steps)
    assert same(out, expected)


@pytest.mark.parametrize("threads", [1, 2])
def test_run(benchmark: BenchmarkFixture, threads: int) -> None:
    actuators = describe(benchmark, "array", f"forward.run, threads = {threads}")
    stream, out = actuators.array.forward(), np.empty_like(actuators.drives)

    def run() -> None:
        stream.reset()
        stream.run(actuators.drives, out, threads=threads)

    benchmark(run)
    assert same(out, actuators.positions)


@EVERY_FACE
@pytest.mark.parametrize("loop", ARRAY_LOOPS)
def test_loop(benchmark: BenchmarkFixture, face: str, loop: str) -> None:
    actuators = describe(benchmark, face, loop)
    z, out = np.zeros((len(actuators.array), OPERATORS)), np.empty_like(actuators.drives)

    def steps() -> None:
        z[:] = 0.0
        for row, result in zip(actuators.drives, out, strict=True):
            LOOPS_OF[face][loop](row, *actuators.stacked, z, result)

    steps()  # compiled before it is timed
    assert same(out, actuators.positions)
    benchmark(steps)


def test_one_actuator_is_the_loop() -> None:
    actuators = FACES["array"]
    out = np.empty(actuators.drives.shape[0])
    drive = np.ascontiguousarray(actuators.drives[:, 7])
    LOOPS["numba"](drive, *actuators.stacked, out)
    assert same(actuators.positions[:, 7], out)
