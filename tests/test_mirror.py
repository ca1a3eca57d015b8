"""A deformable mirror of 1024 different actuators: records, shapes, response matrix, closed loop.

The actuators are sums of plays in numpy, with thresholds and weights of their own that the models
of the library do not have.
"""

from __future__ import annotations

import copy

import mpi_hyst as mh
import numpy as np
import pytest
import scipy.linalg
from support import Array

SIDE = 32
M = SIDE * SIDE
LIMITS = (0.0, 100.0)  # V
X, Y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1.0, 1.0, SIDE)]))


class Physics:
    """1024 actuators: a straight line and 40 plays each, all different."""

    def __init__(self, seed: int = 1) -> None:
        random = np.random.default_rng(seed)
        self.r = np.sort(random.uniform(0.5, 60.0, (M, 40)), axis=1)  # V
        density = np.exp(-self.r / random.uniform(15.0, 40.0, (M, 1)))
        gain = random.uniform(0.04, 0.06, (M, 1))  # um/V
        share = random.uniform(0.41, 0.65, (M, 1))
        self.line = (gain * (1.0 - share))[:, 0]
        self.weights = gain * share * density / density.sum(axis=1, keepdims=True)
        self.plays = np.zeros((M, 40))

    def step(self, drives: Array) -> Array:
        x = drives[:, None]
        self.plays = np.clip(self.plays, x - self.r, x + self.r)
        positions: Array = self.line * drives + np.einsum("mn,mn->m", self.weights, self.plays)
        return positions

    def run(self, drives: Array) -> Array:
        return np.array([self.step(row) for row in drives])


class Bench:
    """The mirror after its record, what was identified, and straight lines through it."""

    def __init__(self) -> None:
        made = mh.signals.excitation(*LIMITS, slew=620.0, rate=500.0, cycles=20)
        self.drive, random = made.drive, np.random.default_rng(2)
        self.physics = Physics()
        clean = self.physics.run(np.repeat(self.drive[:, None], M, axis=1))
        self.stroke = np.ptp(clean, axis=0)
        record = clean + 0.01 * self.stroke * random.normal(size=clean.shape)  # 1 % sensor noise
        found = mh.identify_many(
            self.drive, record, dt=2e-3, operators=20, model="conventional", input_offset=0.0,
            dead_time=0.0, threads=2,
        )  # fmt: skip
        self.array = found.actuator_array()
        self.slope, self.offset = np.polyfit(self.drive, record, 1)

    def loop_width(self) -> Array:
        """The widest place of the full loop over the stroke."""
        fresh, up = Physics(), np.linspace(*LIMITS, 101)
        y = fresh.run(np.repeat(np.r_[up, up[::-1], up][:, None], M, axis=1))
        width: Array = (y[101:202][::-1] - y[202:]).max(axis=0) / np.ptp(y[202:], axis=0)
        return width

    def straight(self, target: Array) -> Array:
        drives: Array = np.clip((target - self.offset) / self.slope, *LIMITS)
        return drives

    def controller(self, **options: object) -> mh.control.ArrayController:
        """A controller that knows what was driven before."""
        made = self.array.controller(1e-3, LIMITS, bumpless_time=0.0, **options)  # type: ignore[arg-type]
        made.follow(np.repeat(self.drive[:, None], M, axis=1))
        return made


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


def shapes(count: int, seed: int) -> Array:
    """Random smooth shapes, between -1 and 1."""
    random = np.random.default_rng(seed)
    waves = [(a, b) for a in range(4) for b in range(4)]
    made = []
    for _ in range(count):
        phases, sizes = random.uniform(0.0, 2.0 * np.pi, 16), random.normal(size=16)
        each = [
            size / (1 + a * a + b * b) * np.cos(0.5 * np.pi * (a * X + b * Y) + phase)
            for (a, b), size, phase in zip(waves, sizes, phases, strict=True)
        ]
        shape = np.sum(each, axis=0)
        made.append(shape / np.abs(shape).max())
    return np.array(made)


def rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def test_the_actuators_have_about_15_percent_hysteresis(bench: Bench) -> None:
    width = bench.loop_width()
    assert 0.14 < np.median(width) < 0.16 and width.min() > 0.07 and width.max() < 0.3


def test_open_loop_shapes_are_ten_times_better_than_without_compensation(bench: Bench) -> None:
    targets = 0.5 * np.median(bench.stroke) + 0.25 * np.median(bench.stroke) * shapes(60, 3)
    controller = bench.controller()
    plain, compensated = copy.deepcopy(bench.physics), copy.deepcopy(bench.physics)
    without = plain.run(np.array([bench.straight(target) for target in targets])) - targets
    drives = controller.run(np.vstack([targets[:1], targets]))[1:]
    with_inverse = compensated.run(drives) - targets
    ratio = rms(without) / rms(with_inverse)
    assert rms(without) > 0.02 * np.median(bench.stroke)
    assert ratio > 10.0, (rms(without), rms(with_inverse))


def test_a_hadamard_response_matrix_is_within_one_percent(bench: Bench) -> None:
    random, sensors = np.random.default_rng(5), 200
    at = random.uniform(-1.0, 1.0, (sensors, 2))
    distance = (X - at[:, :1]) ** 2 + (Y - at[:, 1:]) ** 2
    truth = np.exp(-distance / 0.02)
    patterns = scipy.linalg.hadamard(M).astype(float)
    middle, poke = 0.5 * np.median(bench.stroke), 0.15 * np.median(bench.stroke)

    noise = 0.01 * poke * np.std(truth @ patterns[1])  # 1 % of a signal

    def response(compensate: bool) -> float:
        physics, controller = copy.deepcopy(bench.physics), bench.controller()
        controller.step(np.full(M, middle))
        gathered = np.zeros((sensors, M))
        for pattern in patterns:
            pair = []
            for sign in (1.0, -1.0):
                target = middle + sign * poke * pattern
                inverted = controller.step(target)
                signal = truth @ physics.step(inverted if compensate else bench.straight(target))
                pair.append(signal + noise * random.normal(size=sensors))
            gathered += np.outer(pair[0] - pair[1], pattern)
        found = gathered / (2.0 * poke * M)
        return float(np.linalg.norm(found - truth) / np.linalg.norm(truth))

    compensated, without = response(True), response(False)
    assert compensated < 0.01 < without, (compensated, without)


def test_a_loop_through_a_reconstruction_matrix_flattens_the_wavefront(bench: Bench) -> None:
    random, sensors = np.random.default_rng(6), 1500
    at = random.uniform(-1.0, 1.0, (sensors, 2))
    influence = np.exp(-((X - at[:, :1]) ** 2 + (Y - at[:, 1:]) ** 2) / 0.005)
    squares = influence.T @ influence
    squares[np.diag_indices(M)] += 1e-3 * np.linalg.norm(squares, 1)
    matrix = np.linalg.solve(squares, influence.T)
    neighbours = [(i, i + 1) for i in range(M) if (i + 1) % SIDE]
    neighbours += [(i, i + SIDE) for i in range(M - SIDE)]
    slew, most = 2e4, 0.8
    controller = bench.controller(
        ki=300.0, leak=0.1, slew=slew, reconstruction=matrix, neighbours=neighbours,
        max_difference=most,
    )  # fmt: skip
    physics = copy.deepcopy(bench.physics)
    middle = np.full(M, 0.5 * np.median(bench.stroke))
    aberration = influence @ (0.2 * np.median(bench.stroke) * shapes(1, 7)[0])
    first, second = np.array(neighbours).T
    drive, wavefront, sizes = controller.drive, aberration, []
    apart = np.abs(controller.position[first] - controller.position[second])
    for _ in range(80):
        last, drive = drive, controller.step(middle, wavefront)
        wavefront = influence @ (physics.step(drive) - middle) + aberration
        wavefront += 1e-3 * np.std(aberration) * random.normal(size=sensors)
        sizes.append(rms(wavefront))
        assert np.all((drive >= LIMITS[0]) & (drive <= LIMITS[1]))
        assert np.abs(drive - last).max() <= slew * 1e-3
        before, apart = apart, np.abs(controller.position[first] - controller.position[second])
        assert np.all(apart <= np.maximum(most, before + 1e-12))
    assert controller.pair_limited_count > 0
    assert sizes[-1] < 0.02 * rms(aberration), (sizes[-1], rms(aberration))
