"""What the paper's tables and figures say, through the public interface."""

from __future__ import annotations

from itertools import pairwise

import mpi_hyst as mh
import numpy as np
import pytest
import reference
from support import Array, walk

FIG_5_INPUT = [0.0, 20.0, -20.0, 15.0, 6.0, 25.0, -15.0, -5.0]
FIG_5_OUTPUT = [0.0, 10.0, -12.0, 5.0, 5.0, 15.0, -7.0, -7.0]


@pytest.fixture
def actuator() -> mh.ModifiedPrandtlIshlinskii:
    return mh.paper.table_1_recovered()


def columns(model: mh.ModifiedPrandtlIshlinskii) -> list[Array]:
    return [model.weights, model.r, model.ra, model.rb, model.rc]


@pytest.mark.parametrize("parts", [1, 2, 3, 8, 64, 1000])
def test_fig_5_walk_is_exact_at_any_sampling(parts: int) -> None:
    z = mh.CoupledPlay(10, 8, 3, 4)
    model = mh.ModifiedPrandtlIshlinskii([1], [10], [8], [3], [4])
    streams = (z, model.forward(), model.forward(initial=[0]))
    for stream in streams:
        moves = pairwise([0.0, *FIG_5_INPUT])
        # max and min of exact inputs: no tolerance
        assert [stream.run(walk([a, b], parts))[-1] for a, b in moves] == FIG_5_OUTPUT


def test_tables_are_as_printed() -> None:
    for got, printed in zip(columns(mh.paper.table_1()), reference.TABLE_1.values(), strict=True):
        np.testing.assert_allclose(got, printed, rtol=1e-15)  # 0.95 x 25 i: one rounding
    for got, printed in zip(columns(mh.paper.table_2()), reference.TABLE_2.values(), strict=True):
        assert np.array_equal(got, printed)


def test_recovered_weights_round_to_table_1(actuator: mh.ModifiedPrandtlIshlinskii) -> None:
    assert np.array_equal(np.round(actuator.weights, 4), mh.paper.table_1().weights)
    # the twin subtracts the same reciprocals of 1e-2: a few roundings of those
    expected = reference.paper_actuator().weights
    np.testing.assert_allclose(actuator.weights, expected, rtol=0, atol=1e-17)
    thresholds = zip(columns(actuator)[1:], columns(mh.paper.table_1())[1:], strict=True)
    assert all(np.array_equal(one, other) for one, other in thresholds)


def test_parametric_inverse_agrees_with_all_100_numbers_of_table_2(
    actuator: mh.ModifiedPrandtlIshlinskii,
) -> None:
    computed, printed = columns(actuator.parametric_inverse()), columns(mh.paper.table_2())
    # printed to 1e-4; the 1e-6 on top is what w', itself rounded, does to r'
    np.testing.assert_allclose(computed, printed, rtol=0, atol=5.1e-5)
    assert np.size(printed) == 100


@pytest.mark.parametrize(("drive", "reach"), [(500.0, 3.0624), (-500.0, -3.1072)])
def test_reach_from_the_virgin_state(
    actuator: mh.ModifiedPrandtlIshlinskii, drive: float, reach: float
) -> None:
    assert actuator.forward().step(drive) == pytest.approx(reach, abs=5e-5)  # half a digit


def residual_percent(
    actuator: mh.ModifiedPrandtlIshlinskii, inverse: mh.Forward | mh.Inverse
) -> tuple[float, float]:
    """Largest and rms error on 0, +A, -A, +A, -A, A the reach at +500 V, in % of 2 A."""
    amplitude = actuator.forward().step(500.0)
    # the peak to peak in twice as many parts as the first rise: equal steps, so rms is fair
    strokes = walk([amplitude, -amplitude, amplitude, -amplitude], 2000)
    target = np.concatenate([walk([0.0, amplitude], 1000)[:-1], strokes])
    drive = inverse.run(target)
    error = 100 * (actuator.forward().run(drive) - target) / (2 * amplitude)
    return float(np.abs(error).max()), float(np.sqrt(np.mean(error**2)))


def test_table_2_leaves_0_732_percent(actuator: mh.ModifiedPrandtlIshlinskii) -> None:
    largest, rms = residual_percent(actuator, mh.paper.table_2().forward())
    assert largest == pytest.approx(0.732, abs=5e-4)  # half of the last digit stated
    assert rms == pytest.approx(0.321, abs=5e-4)
    computed = residual_percent(actuator, actuator.parametric_inverse().forward())
    assert computed == pytest.approx((largest, rms), abs=1e-3)  # Table II is rounded to 1e-4


def test_the_other_inverses_leave_what_the_digest_says(
    actuator: mh.ModifiedPrandtlIshlinskii,
) -> None:
    conventional = mh.PrandtlIshlinskii(actuator.weights, actuator.r).closed_form_inverse()
    largest, rms = residual_percent(actuator, conventional.forward())
    assert (largest, rms) == pytest.approx((3.52, 1.80), abs=5e-3)
    same_ratios = actuator.parametric_inverse(0.95, 0.30, 0.35)
    largest, rms = residual_percent(actuator, same_ratios.forward())
    assert (largest, rms) == pytest.approx((0.254, 0.051), abs=5e-4)


def test_the_exact_inverse_leaves_nothing(actuator: mh.ModifiedPrandtlIshlinskii) -> None:
    largest, _ = residual_percent(actuator, actuator.inverse())
    assert largest < 1e-12  # percent; rounding of sums near 6 um


def test_3_3_um_need_about_530_volts(actuator: mh.ModifiedPrandtlIshlinskii) -> None:
    assert actuator.inverse().step(3.3) == pytest.approx(530.0, abs=5.0)


def test_a_full_stroke_makes_an_unknown_memory_known(
    actuator: mh.ModifiedPrandtlIshlinskii,
) -> None:
    rest = [abs(actuator.forward().run([u, 0.0])[-1]) for u in (500.0, -500.0)]
    base = actuator.forward().step(500.0) - actuator.forward().step(-500.0)
    assert 100 * max(rest) / base == pytest.approx(3.9, abs=0.05)
    after = {actuator.forward().run([*before, 500.0, 100.0])[-1] for before in ([], [-500], [70])}
    assert len(after) == 1


def test_a_long_random_walk_comes_back_within_1e_11_of_the_range(
    actuator: mh.ModifiedPrandtlIshlinskii,
) -> None:
    rng = np.random.default_rng(0)
    walks = np.clip(np.cumsum(rng.normal(0.0, 20.0, 40_000)), -500.0, 500.0)
    jumps = rng.uniform(-500.0, 500.0, 10_000)
    x = np.concatenate([walks, jumps, 1e-3 * jumps])
    back = actuator.inverse().run(actuator.forward().run(x))
    assert np.abs(back - x).max() <= 1e-11 * 1000.0
