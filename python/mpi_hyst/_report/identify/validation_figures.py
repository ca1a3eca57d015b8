"""Figures on validation: loops left out, standard deviation of a prediction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.weights import TWO_SIDED
from mpi_hyst._types import Samples


def left_out(loops: Sequence[mh.results.LeftOutLoop], output_quantity: Quantity) -> Figure:
    """Draw the rms error of every loop in the order of the records, fitted and predicted."""
    figure = canvas.new_figure(3.2)
    axes = figure.subplots()
    number = np.arange(1, len(loops) + 1)
    fitted = [row.fitted.rmse for row in loops]
    left = [row.left_out.rmse for row in loops]
    axes.vlines(number, fitted, left, color=canvas.MEASURED, linewidth=1.0)
    axes.plot(number, fitted, "o", color=canvas.BLUE, markersize=4.5, label="fitted")
    axes.plot(
        number, left, "D", color=canvas.ORANGE, markersize=4.0, label="predicted from the others"
    )
    axes.set_ylim(0.0, 1.12 * max(*fitted, *left) or 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    canvas.dress(
        axes, "rms error of every loop", "loop", f"rms error{output_quantity.in_parentheses}"
    )
    canvas.top_legend(figure, axes)
    return figure


def deviation(trace: plots.Trace, std: Samples) -> Figure:
    """Draw the 95 % band of the prediction over time, and its deviation over the input."""
    figure = canvas.new_figure(3.4)
    draw_deviation(trace, std, list(figure.subplots(1, 2, width_ratios=(1.6, 1.0))))
    return figure


def draw_deviation(trace: plots.Trace, std: Samples, panels: Sequence[Axes]) -> None:
    """Draw into two panels: the 95 % band over time, and the standard deviation over the input."""
    course, plane = panels
    fitted = slice(trace.skip, None)
    time, judged = trace.time[fitted], std[fitted]
    kept = np.union1d(canvas.envelope(judged), [0, judged.size - 1])
    course.fill_between(
        time[kept],
        -TWO_SIDED * judged[kept],
        TWO_SIDED * judged[kept],
        color=canvas.BLUE,
        alpha=0.3,
        linewidth=0,
    )
    course.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
    course.set_xlim(time[0], time[-1])
    every = canvas.thinned(judged.size, plots.LOOP_POINTS)
    plane.plot(
        trace.input[fitted][every],
        judged[every],
        ".",
        color=canvas.BLUE,
        markersize=2.4,
        markeredgewidth=0,
        rasterized=True,
    )
    plane.set_ylim(bottom=0.0)
    of_unit = trace.output_quantity.in_parentheses
    canvas.dress(course, "95 % band of the prediction over time", trace.time_label, f"Δ{of_unit}")
    canvas.dress(
        plane, "standard deviation over input", trace.input_quantity.label, f"std{of_unit}"
    )
