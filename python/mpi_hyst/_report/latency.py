"""How late and how long the samples of a loop in real time were."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpi_hyst._core import LoopReport, LoopTimes
from mpi_hyst._report import canvas
from mpi_hyst._text import in_unit

_MICROSECONDS = 1e6


def figure(report: LoopReport) -> Figure:
    """Draw the histograms of latency, computing time and period."""
    made = canvas.new_figure(3.6)
    draw(report, list(made.subplots(1, 3)))
    return made


def draw(report: LoopReport, panels: Sequence[Axes]) -> None:
    """Draw into three panels: latency, computing time and period."""
    shown = [
        ("latency", report.latency, canvas.BLUE),
        ("compute", report.compute, canvas.GREEN),
        ("period", report.period, canvas.SOFT),
    ]
    for axes, (name, times, colour) in zip(panels, shown, strict=True):
        _histogram(axes, times, colour)
        axes.axvline(_MICROSECONDS * times.p999, color=canvas.ORANGE, linewidth=1.0, linestyle="--")
        axes.set_xscale("log")
        axes.set_yscale("log")
        title = f"{name}: p99.9 {in_unit(_MICROSECONDS * times.p999, 'µs', 3)}"
        canvas.dress(axes, title, f"{name} (µs)", "samples")


def _histogram(axes: Axes, times: LoopTimes, colour: str) -> None:
    classes = times.histogram
    ends = _MICROSECONDS * np.array([end for end, _ in classes])
    counts = np.array([count for _, count in classes])
    # A class is a fifth of its upper end wide.
    axes.bar(ends, counts, width=-0.2 * ends, align="edge", color=colour)
