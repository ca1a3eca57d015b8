"""Figures of models, stages, streams and what was identified: what they show, and their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from matplotlib.figure import Figure
from mpi_hyst._report.models import Memory, contributions
from support import Array

MODEL = mh.paper.table_1_recovered()
PLAIN = mh.PrandtlIshlinskii([1.0, 0.5, 0.25], [0.0, 2.0, 4.0], input_offset=1.0, output_offset=3.0)
SPLIT = mh.ModifiedPrandtlIshlinskii(
    [1.0, 0.5], [0.0, 2.0], [0.0, 1.5], [0.0, 1.0], [0.0, 1.2], weights_negative=[1.0, 0.8]
)
UNITS = ("V", "um")


@pytest.fixture(scope="module")
def record() -> tuple[Array, Array]:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=200.0)
    y = MODEL.forward().run(u) + np.random.default_rng(1).normal(0.0, 0.01, u.size)
    return u, y


@pytest.fixture(scope="module")
def found(record: tuple[Array, Array]) -> mh.results.Identification:
    return mh.identify(*record, dt=5e-3, operators=6, dead_time=0.0, weights="free")


def drawn(axes: Any) -> dict[str, tuple[Array, Array]]:
    """The lines of a panel that have a name, by it."""
    lines = {line.get_label(): line.get_data() for line in axes.get_lines()}
    return {name: xy for name, xy in lines.items() if not name.startswith("_")}


@pytest.mark.parametrize("model", [MODEL, PLAIN, SPLIT])
def test_loops_are_those_of_the_model(model: Any) -> None:
    whole, width = mh.plot.loops(model).axes
    u, y = drawn(whole)["model"]
    np.testing.assert_array_equal(y, model.forward().run(u))
    reach = max(1.25 * np.max(getattr(model, "ra", getattr(model, "r", [4.0]))), 1.0)
    assert u.min() <= model.input_offset - reach < model.input_offset + reach <= u.max()
    # Without the line a loop is narrower, and no line fits what is left.
    left = drawn(width)["model"][1]
    assert np.ptp(left) < np.ptp(y) and abs(np.polyfit(u, left, 1)[0]) < 1e-9 * np.ptp(y)


def test_loops_of_a_stage_have_time_only_if_it_is_given() -> None:
    stage = mh.paper.plant("A1").stage.replace(input_map=([-600.0, 600.0], [-500.0, 550.0]))
    u = mh.signals.sine(400.0, 20.0, seconds=0.2, rate=1e4)
    slow, _ = mh.plot.loops(stage, u).axes
    bent = np.interp(u, [-600.0, 600.0], [-500.0, 550.0])
    hysteresis = stage.hysteresis.forward().run(bent)
    np.testing.assert_allclose(drawn(slow)["model"][1], hysteresis, atol=1e-12)
    fast, _ = stage.plot(u, dt=1e-4).axes
    np.testing.assert_array_equal(drawn(fast)["model"][1], stage.forward(1e-4).run(u))
    assert slow.get_xlabel() == "drive (V)" and slow.get_ylabel() == "position (µm)"


def test_loops_of_a_fit_show_the_record(
    record: tuple[Array, Array], found: mh.results.Identification
) -> None:
    u, y = record
    whole, _ = found.plot(u, y, record=0, skip=100).axes
    shown = drawn(whole)
    np.testing.assert_array_equal(shown["measured"][1], y[100:])
    rms = np.sqrt(np.mean((shown["measured"][1] - shown["model"][1]) ** 2))
    assert rms == pytest.approx(found.fit.rmse, rel=0.1)


def test_few_outliers_do_not_flatten_a_figure(
    record: tuple[Array, Array], found: mh.results.Identification
) -> None:
    u, y = record
    spiked = y.copy()
    spiked[[300, 500]] += [40.0, -25.0]
    for figure in (
        mh.plot.residuals(found, u, spiked, record=0),
        mh.plot.loops(found, u, spiked, record=0),
    ):
        below = figure.axes[-1]
        assert max(map(abs, below.get_ylim())) < 2.0
        said = [text.get_text() for text in below.texts]
        assert len(said) == 1 and said[0].startswith(f"2 of {u.size} points outside, to 40")
    # The axes of a record without outliers hold all of it, and nothing is said.
    plain = mh.plot.residuals(found, u, y, record=0).axes
    left = found.residuals(u, y, record=0)
    assert not any(axes.texts for axes in plain)
    assert max(plain[2].get_ylim()) > np.abs(left).max()


def test_residuals_are_those_of_the_result(
    record: tuple[Array, Array], found: mh.results.Identification
) -> None:
    u, y = record
    over_drive, over_rate, over_time = mh.plot.residuals(found, u, y, record=0, units=UNITS).axes
    left = found.residuals(u, y, record=0)
    line = over_drive.get_lines()[0]
    np.testing.assert_allclose(np.asarray(line.get_ydata(), float), left, atol=1e-12)
    np.testing.assert_array_equal(line.get_xdata(), u)
    assert over_time.get_xlabel() == "time (s)" and over_time.get_xlim()[1] == (u.size - 1) * 5e-3
    assert over_rate.get_xlabel() == "rate of change of drive (V/s)"


@pytest.mark.parametrize("model", [MODEL, PLAIN, SPLIT])
def test_operators_add_up_to_the_model(model: Any) -> None:
    u = np.linspace(0.0, 3.0, 301)
    u = (model.input_offset + 8.0 * u) * np.sin(9.0 * u)
    total = sum(contributions(model, u)) + model.output_offset
    np.testing.assert_allclose(total, model.forward().run(u), atol=1e-12)
    single, summed = mh.plot.operators(model, u).axes
    last = f"operators 0 to {model.operators - 1}"
    np.testing.assert_allclose(drawn(summed)[last][1], total, atol=1e-12)
    assert 1 <= len(drawn(single)) <= 7 and "operator 0" not in drawn(single)


def test_weights_have_the_standard_errors_of_the_fit(found: mh.results.Identification) -> None:
    panels: Any = mh.plot.weights(found, units=UNITS).axes
    single, total, thresholds = panels
    bars = single.containers[0].lines[2][0].get_segments()
    half = [0.5 * (bar[1, 1] - bar[0, 1]) for bar in bars]
    np.testing.assert_allclose(half, 1.96 * np.nan_to_num(found.weights_std[1:]), rtol=1e-9)
    # The last sum is of all weights: its variance is that of their sum.
    places = [i for i, name in enumerate(found.parameters) if name.startswith("weights[")]
    variance = found.covariance[np.ix_(places, places)].sum()
    assert isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    band = np.asarray(total.collections[0].get_paths()[0].vertices)
    last = band[np.isclose(band[:, 0], found.model.r[-1]), 1]
    assert 0.5 * np.ptp(last) == pytest.approx(1.96 * np.sqrt(variance))
    assert len(thresholds.collections) == sum(std > 0.0 for std in found.ratios_std)
    assert not mh.plot.weights(found.model).axes[0].containers


def test_the_band_is_that_of_the_prediction(
    record: tuple[Array, Array], found: mh.results.Identification
) -> None:
    u, _ = record
    course, plane = mh.plot.uncertainty(found, u, skip=10).axes
    std = found.predict(u, return_std=True)[1]
    _, low, high = found.predict(u, interval=0.95)
    halves = (0.5 * (high - low)[10:], 1.96 * std[10:])
    for line, bands, half in zip(plane.get_lines(), course.collections, halves, strict=True):
        np.testing.assert_allclose(np.asarray(line.get_ydata(), dtype=float), half, rtol=1e-9)
        vertices = np.asarray(bands.get_paths()[0].vertices)
        assert vertices[:, 1].max() == pytest.approx(half.max())


@pytest.mark.parametrize(
    ("reversals", "now", "corners"),
    [
        ((), 5.0, [(5.0, 5.0), (-5.0, 5.0)]),
        ((), -5.0, [(-5.0, -5.0), (-5.0, 5.0)]),
        ((9.0,), 2.0, [(2.0, 2.0), (2.0, 9.0), (-9.0, 9.0)]),
        ((9.0, -6.0), 1.0, [(1.0, 1.0), (-6.0, 1.0), (-6.0, 9.0), (-9.0, 9.0)]),
        # Nothing remembers the loading before: the oldest link goes on to the edge.
        ((-3.0, 8.0), 1.0, [(1.0, 1.0), (1.0, 8.0), (-3.0, 8.0), (-3.0, 9.2)]),
    ],
)
def test_the_staircase_has_the_reversals_as_corners(
    reversals: tuple[float, ...], now: float, corners: list[tuple[float, float]]
) -> None:
    memory = Memory(reversals, now)
    far = memory.extent
    np.testing.assert_allclose(memory.staircase()[:-1], corners, rtol=1e-12)
    assert memory.staircase()[-1] == (-far, far)
    assert memory.maxima == [value > 0.0 for value in reversals]


@pytest.mark.parametrize("make", ["forward", "inverse", "stage"])
def test_the_memory_is_that_of_the_stream(make: str) -> None:
    drive = [400.0, -300.0, 200.0, -100.0, 50.0]
    stream: Any = MODEL.forward()
    if make == "forward":
        stream.run(drive)
    else:
        stage = mh.Stage(MODEL, limits=(-500.0, 500.0))
        stream = MODEL.inverse() if make == "inverse" else stage.inverse(1e-3)
        stream.follow(drive)
    plane, zigzag = stream.plot(units=UNITS).axes
    dots = next(line for line in zigzag.get_lines() if line.get_marker() == "o")
    np.testing.assert_array_equal(dots.get_ydata(), stream.memory)
    assert stream.memory.size == 3
    now = next(line for line in plane.get_lines() if line.get_marker() == "o")
    assert now.get_xdata()[0] == pytest.approx(50.0)
    assert zigzag.texts[-1].get_text() == "now: 50"


def test_a_bank_has_no_reversals_to_show() -> None:
    stream = MODEL.forward(np.zeros(MODEL.operators))
    with pytest.raises(ValueError, match=r"^stream: expected one that remembers reversals, got a"):
        mh.plot.memory(stream)


CALLS: dict[str, tuple[int, Callable[..., Figure]]] = {
    "loops": (2, lambda axes: mh.plot.loops(MODEL, axes=axes)),
    "operators": (2, lambda axes: mh.plot.operators(MODEL, axes=axes)),
    "weights": (3, lambda axes: mh.plot.weights(MODEL, axes=axes)),
    "memory": (2, lambda axes: mh.plot.memory(MODEL.forward(), axes=axes)),
    "residuals": (3, lambda axes: mh.plot.residuals(MODEL, [0, 1], [0, 1], axes=axes)),
}


@pytest.mark.parametrize("name", CALLS)
def test_axes_of_ones_own_are_drawn_on(name: str) -> None:
    count, call = CALLS[name]
    figure = Figure()
    panels = figure.subplots(1, count)
    assert call(panels) is figure
    assert all(axes.get_title(loc="left") for axes in panels)
    with pytest.raises(ValueError, match=rf"^axes: expected (two|three) axes, got {count + 1}$"):
        call(Figure().subplots(1, count + 1))


# Wrong arguments, which no type checker would let pass.
PLOT: Any = mh.plot


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: PLOT.loops(3), "model: expected a Stage, PrandtlIshlinskii, Modified"),
        (lambda: PLOT.loops(MODEL, [0, 1], skip=1.5), "skip: expected a number of samples, got"),
        (lambda: PLOT.loops(MODEL, y=[0, 1]), "u: expected the drive at which y was measured"),
        (lambda: PLOT.loops(MODEL, "ab"), "u: expected an array of numbers, got 'ab'"),
        (
            lambda: PLOT.loops(MODEL, units="V"),
            "units: expected the names of two units",
        ),
        (lambda: PLOT.loops(MODEL, [0, 1], dt="1"), "dt: expected a number of seconds, got '1'"),
        (lambda: PLOT.memory(MODEL), "stream: expected a Forward, Inverse or StageInverse, got"),
        (lambda: PLOT.uncertainty(MODEL, [0, 1]), "found: expected an Identification, got <Mod"),
        (lambda: PLOT.run(4), "run: expected a Run, got 4"),
    ],
)
def test_wrong_kinds_are_named(call: Callable[[], Figure], said: str) -> None:
    with pytest.raises(TypeError) as caught:
        call()
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: PLOT.loops(MODEL, [0, np.nan]),
            "u: expected finite numbers, got nan",
        ),
        (lambda: PLOT.loops(MODEL, [[0, 1]]), "u: expected at least 2 samples in one row, got"),
        (
            lambda: PLOT.residuals(MODEL, [0, 1], [1, 2, 3]),
            "y: expected 2 samples as in u",
        ),
        (lambda: PLOT.loops(MODEL, [0, 1], skip=1), "skip: expected 0 to 0, got 1"),
        (lambda: PLOT.loops(MODEL, [0, 1], dt=0.0), "dt: expected a finite number above 0, got"),
    ],
)
def test_wrong_values_are_named(call: Callable[[], Figure], said: str) -> None:
    with pytest.raises(ValueError) as caught:
        call()
    assert str(caught.value).startswith(said)
