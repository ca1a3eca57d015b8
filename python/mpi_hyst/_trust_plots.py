"""Figures that say how far to trust a model: loops left out, deviation of a prediction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst import _plots
from mpi_hyst._records import Quantity, Samples

_BAND = 1.96  # standard deviations: 95 % of a normal distribution


def left_out(
    loops: Sequence[mh.LeftOutLoop], input_quantity: Quantity, output_quantity: Quantity
) -> Figure:
    """Draw the rms error of every loop over its amplitude, fitted and left out."""
    figure = _plots.new_figure(3.4)
    axes = figure.subplots()
    amplitude = [row.amplitude for row in loops]
    fitted = [row.fitted.rmse for row in loops]
    left = [row.left_out.rmse for row in loops]
    axes.vlines(amplitude, fitted, left, color=_plots.MEASURED, linewidth=1.0)
    axes.plot(amplitude, fitted, "o", color=_plots.BLUE, markersize=4.5, label="fitted")
    axes.plot(amplitude, left, "D", color=_plots.ORANGE, markersize=4.5, label="left out")
    axes.set_ylim(bottom=0.0)
    x_unit, y_unit = input_quantity.shown_unit, output_quantity.shown_unit
    _plots.dress(
        axes,
        "rms error of every loop",
        f"amplitude of the loop{f' ({x_unit})' if x_unit else ''}",
        f"rms error{f' ({y_unit})' if y_unit else ''}",
    )
    _plots.top_legend(figure, axes)
    return figure


def deviation(trace: _plots.Trace, std: Samples) -> Figure:
    """Draw the band of the prediction over time, and its standard deviation over the input."""
    figure = _plots.new_figure(3.4)
    course, plane = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    time, unit = trace.time, trace.output_quantity.shown_unit
    kept = np.union1d(_plots.envelope(std), [0, std.size - 1])
    course.axvspan(time[0], time[trace.skip], color=_plots.GRID, linewidth=0, zorder=0)
    course.fill_between(
        time[kept],
        -_BAND * std[kept],
        _BAND * std[kept],
        color=_plots.BLUE,
        alpha=0.25,
        linewidth=0,
        label=f"± {_BAND} standard deviations of the prediction",
    )
    course.axhline(0.0, color=_plots.SOFT, linewidth=0.8)
    course.set_xlim(time[0], time[-1])
    fitted = slice(trace.skip, None)
    every = _plots.thinned(std[fitted].size, _plots.CLOUD_POINTS)
    plane.plot(
        trace.input[fitted][every],
        std[fitted][every],
        ".",
        color=_plots.BLUE,
        markersize=2.4,
        markeredgewidth=0,
        rasterized=True,
    )
    plane.set_ylim(bottom=0.0)
    of_unit = f" ({unit})" if unit else ""
    _plots.dress(course, "band of the prediction over time", trace.time_label, f"Δ{of_unit}")
    _plots.dress(
        plane, "standard deviation over input", trace.input_quantity.label, f"std{of_unit}"
    )
    return figure
