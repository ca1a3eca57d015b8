"""Figures on matplotlib axes: what they show, and their errors."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from matplotlib.figure import Figure
from test_entry_point import python
from test_tuning import DT, FLEXURE, MODEL


@pytest.fixture(scope="module")
def tuning() -> mh.control.Tuning:
    return mh.control.tune(MODEL, dt=DT, **FLEXURE)


def lines(axes: Any) -> dict[str, Any]:
    return {line.get_label(): line for line in axes.get_lines()}


def test_the_figure_shows_the_loops(tuning: mh.control.Tuning) -> None:
    figure = mh.plot.tuning(tuning)
    magnitude, phase, sensitivity = figure.axes
    least, greatest = magnitude.get_lines()[0], magnitude.get_lines()[2]
    for line, margins in ((least, tuning.at_min_slope), (greatest, tuning.at_max_slope)):
        frequencies = line.get_xdata()
        np.testing.assert_array_equal(
            line.get_ydata(), np.abs(tuning.open_loop(frequencies, margins.slope))
        )
    assert np.asarray(phase.get_lines()[0].get_ydata())[0] == pytest.approx(-90.0, abs=3.0)
    shown = lines(sensitivity)
    worst = shown["worst of all slopes and modes"].get_ydata()
    assert tuning.peak_sensitivity >= worst.max() > 0.99 * tuning.peak_sensitivity
    assert shown["allowed: 1.7"].get_ydata()[0] == 1.7
    assert [axes.get_xscale() for axes in figure.axes] == ["log"] * 3


def test_axes_of_ones_own_are_drawn_on(tuning: mh.control.Tuning) -> None:
    figure = Figure()
    panels = figure.add_subfigure(figure.add_gridspec(1, 1)[0]).subplots(3, 1)
    assert mh.plot.tuning(tuning, panels) is figure
    assert [len(axes.get_lines()) for axes in panels] == [5, 3, 5]
    assert panels[2].get_legend() is not None


def test_wrong_arguments_are_named(tuning: mh.control.Tuning) -> None:
    with pytest.raises(TypeError, match=r"^tuning: expected a Tuning, got 3$"):
        mh.plot.tuning(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^axes: expected three matplotlib axes, got 5$"):
        mh.plot.tuning(tuning, 5)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^axes\[1\]: expected matplotlib axes, got 7$"):
        mh.plot.tuning(tuning, [Figure().subplots(), 7, 8])  # type: ignore[list-item]
    with pytest.raises(ValueError, match=r"^axes: expected three axes, got 2$"):
        mh.plot.tuning(tuning, Figure().subplots(2, 1))


def test_a_missing_package_is_named() -> None:
    ended = python(
        "import sys; sys.modules['matplotlib'] = None; import mpi_hyst as mh",
        "mh.plot.tuning(mh.control.tune(mh.paper.plant('A1')))",
    )
    said = "ImportError: a plot needs matplotlib: pip install 'mpi_hyst[report]'\n"
    assert ended.stderr.endswith(said)
