"""Laws of learning in the loop; the same names as in learning_laws.rs of hysteresis-simulate."""

from __future__ import annotations

import math
from itertools import cycle
from typing import Any

import mpi_hyst as mh
import numpy as np
from controllers import numbers
from hypothesis import given
from hypothesis import strategies as st

DT = 1e-4
NO_NUMBERS = st.sampled_from([math.nan, math.inf, -1e300, 9.9e37, -1e99])


@st.composite
def stages(draw: st.DrawFn) -> mh.Stage:
    """Some 6 um and 500 V, with or without a mode, dead time and creep."""
    weights = [4e-3, *draw(st.lists(numbers(0.0, 1e-3), min_size=3, max_size=3))]
    parts: dict[str, Any] = {"dead_time": draw(numbers(0.0, 6.0)) * DT}
    if draw(st.booleans()):
        parts["dynamics"] = mh.plant.SecondOrder(
            draw(numbers(100.0, 2000.0)), 10.0 ** draw(numbers(-2.0, 0.0))
        )
    if draw(st.booleans()):
        parts["creep"] = mh.plant.Creep([0.03], [0.1])
    hysteresis = mh.ModifiedPrandtlIshlinskii.from_ratios(
        weights, [0.0, 80.0, 180.0, 300.0], ra=0.95, rb=0.30, rc=0.35
    )
    return mh.Stage(hysteresis, **parts)


@st.composite
def references(draw: st.DrawFn) -> np.ndarray[Any, np.dtype[np.float64]]:
    """One period (um): a sine or jumps."""
    samples, turns = draw(st.integers(20, 119)), draw(st.integers(1, 3))
    wave = np.sin(2.0 * np.pi * turns * np.arange(samples) / samples)
    if draw(st.booleans()):
        wave = np.sign(wave)
    return draw(numbers(-1.0, 1.0)) + draw(numbers(0.0, 4.0)) * wave


OPTIONS = st.fixed_dictionaries(
    {
        "limits": st.tuples(numbers(-300.0, 0.0), numbers(20.0, 300.0)),
        "slew": st.none() | numbers(3.5, 6.0).map(lambda power: 10.0**power),
        "kp": numbers(0.0, 200.0),
        "ki": st.just(0.0) | numbers(10.0, 1e6),
    }
)
"""Limits and slew that hold many drives back, gains that need not be stable."""
FAULTS = st.lists(numbers(-0.02, 0.02) | numbers(-5.0, 5.0) | NO_NUMBERS, min_size=1, max_size=60)
"""What the sensor adds."""


class Bench:
    """A plant of the user that looks at every drive."""

    def __init__(self, stage: mh.Stage, faults: list[float], options: dict[str, Any]) -> None:
        self.stage, self.faults, self.options = stage.forward(DT), cycle(faults), options
        self.drives = [float(np.clip(0.0, *options["limits"]))]

    def read(self) -> float:
        return self.stage.position + next(self.faults)

    def write(self, drive: float) -> None:
        (low, high), slew = self.options["limits"], self.options["slew"]
        assert low <= drive <= high
        # Exactly: the difference of two drives, in doubles, is never above slew times dt.
        assert slew is None or abs(drive - self.drives[-1]) <= slew * DT
        self.stage.advance(drive)
        self.drives.append(drive)


def loop(
    stage: mh.Stage, truth: mh.Stage, faults: list[float], options: dict[str, Any]
) -> tuple[mh.control.HybridController, Bench]:
    source = stage.inverse(DT, options["limits"])
    return mh.control.HybridController(source, dt=DT, **options), Bench(truth, faults, options)


@given(
    st.tuples(stages(), stages()),
    OPTIONS,
    references(),
    FAULTS,
    st.fixed_dictionaries(
        {
            "bandwidth": st.sampled_from([None, 300.0]),
            "target_limits": st.sampled_from([None, (-1.5, 1.0)]),
            "settle": st.integers(0, 1),
            "on_demand": st.booleans(),
        }
    ),
)
def test_learning_never_moves_the_drive_beyond_limits_and_slew(
    pair: tuple[mh.Stage, mh.Stage],
    options: dict[str, Any],
    reference: np.ndarray[Any, np.dtype[np.float64]],
    faults: list[float],
    keywords: dict[str, Any],
) -> None:
    controller, bench = loop(*pair, faults, options)
    learning = pair[0].iterative_learning(reference, DT, kp=0.0, ki=0.0, **keywords)
    for _ in range(5):
        if keywords["on_demand"]:
            controller.reset()  # every period begins at rest
        run = mh.plant.simulate(controller, bench, reference, target=learning.target)
        error = reference - run.measured
        # A sample that was not measured, or shows the code of an overflow, teaches nothing.
        learning.update(np.where(np.abs(error) < 1e38, error, 0.0))
        low, high = keywords["target_limits"] or (-1e100, 1e100)
        assert np.all((low <= learning.target) & (learning.target <= high))
    assert len(bench.drives) == 5 * len(reference) + 1


@given(
    st.tuples(stages(), stages()),
    OPTIONS,
    references(),
    FAULTS,
    st.none() | numbers(0.0, 1.0),
    st.integers(1, 4),
)
def test_repetitive_control_never_moves_the_drive_beyond_limits_and_slew(
    pair: tuple[mh.Stage, mh.Stage],
    options: dict[str, Any],
    reference: np.ndarray[Any, np.dtype[np.float64]],
    faults: list[float],
    limit: float | None,
    cut: int,
) -> None:
    controller, bench = loop(*pair, faults, options)

    def made() -> mh.control.RepetitiveControl:
        return pair[0].repetitive_control(
            len(reference), DT, kp=0.0, ki=0.0, bandwidth=300.0, limit=limit
        )

    repetitive = made()
    for period in range(5):
        if period == cut:
            state = repetitive.state
            repetitive = made()
            repetitive.state = state
            assert repetitive.state == state
        mh.plant.simulate(controller, bench, reference, repetitive=repetitive)
    assert len(bench.drives) == 5 * len(reference) + 1
