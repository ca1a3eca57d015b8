"""The interface of the twin's models, and what the constructors refuse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from reference import (
    TABLE_1,
    CoupledPlay,
    ExactInverse,
    ModifiedPrandtlIshlinskii,
    OneSidedPlay,
    Play,
    PrandtlIshlinskii,
    SplitModifiedPrandtlIshlinskii,
    closed_form_inverse,
    paper_actuator,
    printed_coupled_play,
)


def test_model_interface() -> None:
    actuator = paper_actuator()
    xs = [0.0, 100.0, -50.0]
    ys = actuator.run(xs)
    thresholds = [TABLE_1[name] for name in ("r", "ra", "rb", "rc")]
    saved = actuator.outputs
    z = [CoupledPlay(*t).run(xs)[-1] for t in zip(*thresholds, strict=True)]
    assert saved == z and ys[-1] == pytest.approx(np.dot(actuator.weights, z), rel=1e-14)
    other = paper_actuator()
    other.outputs = saved
    assert other.step(70.0) == actuator.step(70.0)
    actuator.reset()
    assert [actuator.step(x) for x in xs] == list(ys)
    moved = ModifiedPrandtlIshlinskii(
        actuator.weights, *thresholds, input_offset=25.0, output_offset=-1.0
    )
    np.testing.assert_allclose(moved.run(np.add(xs, 25.0)), ys - 1.0, rtol=0, atol=1e-15)


def test_a_split_twin_with_equal_weights_is_the_plain_twin() -> None:
    thresholds = [TABLE_1[name] for name in ("r", "ra", "rb", "rc")]
    plain = paper_actuator()
    split = SplitModifiedPrandtlIshlinskii(
        plain.weights, *thresholds, weights_negative=plain.weights
    )
    for x in (300.0, -200.0, 40.0, -420.0, 7.0, 12.0):
        assert split.step(x) == pytest.approx(plain.step(x), rel=1e-14)
        assert split.outputs == plain.outputs
    for y in (1.0, 3.0, -2.0):
        assert ExactInverse(split).step(y) == pytest.approx(ExactInverse(plain).step(y), rel=1e-12)


@pytest.mark.parametrize(
    "build",
    [
        lambda: Play(-1.0),
        lambda: Play(float("nan")),
        lambda: CoupledPlay(1.0, 1.0, 1.0, 2.0),
        lambda: CoupledPlay(1.0, 1.0, 2.0, 1.0),
        lambda: OneSidedPlay(1.0, -1.0),
        lambda: PrandtlIshlinskii([1.0], [0.0, 1.0]),
        lambda: PrandtlIshlinskii([], []),
        lambda: ModifiedPrandtlIshlinskii([1.0], [0.0], [0.0], [0.0], []),
        lambda: ExactInverse(PrandtlIshlinskii([1.0, 1.0, -1.5], [0.0, 1.0, 2.0])),
        lambda: ExactInverse(PrandtlIshlinskii([0.0, 1.0], [0.0, 1.0])),
        lambda: ExactInverse(PrandtlIshlinskii([1.0], [0.0]), (1.0, 1.0)),
        lambda: closed_form_inverse([1.0, -1.0], [0.0, 1.0]),
        lambda: printed_coupled_play([0.0], 1.0, 1.0, 1.0, 1.0, errata=(4,)),
    ],
)
def test_refuses(build: Callable[[], object]) -> None:
    with pytest.raises(ValueError):
        build()


@pytest.mark.parametrize(
    "operator, z, bends",
    [
        (CoupledPlay(10.0, 8.0, 3.0, 4.0), 5.0, {-8, -3, 2, 15}),  # -ra, -rb, z - rb, z + r
        (CoupledPlay(10.0, 8.0, 3.0, 4.0), -5.0, {-13, -1, 4, 10}),  # z - ra, z + rc, rc, r
        (CoupledPlay(10.0, 8.0, 3.0, 4.0), 0.0, {-8, 10}),  # -ra, r
        (Play(10.0), 5.0, {-5, 15}),
    ],
)
def test_kinks_hold_every_bend(operator: CoupledPlay | Play, z: float, bends: set[int]) -> None:
    operator.state = z
    x = range(-40, 41)
    second = np.diff([operator.peek(v) for v in x], n=2)
    assert {v for v, bend in zip(x[1:-1], second, strict=True) if bend != 0} == bends
    assert bends <= set(operator.kinks())
