"""Figures of the demo alone: the turning-point memory, the tracking errors, Fig. 8 to 10."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.walk import moves
from mpi_hyst._types import Samples

STAIRCASE = (
    *(0.0, 450.0, 40.0, 400.0, 90.0, 350.0, 140.0, 300.0, 190.0),  # each step inside the last one
    *(265.0, 165.0, 325.0, 115.0, 375.0, 65.0, 425.0, 15.0, 480.0),  # each step beyond the last one
)


@dataclass(frozen=True)
class Tracking:
    """The tracking error of one scheme."""

    name: str
    colour: str
    error: Samples


def memory(model: mh.ModifiedPrandtlIshlinskii, unit: str) -> Figure:
    """Draw the reversals that a model remembers while the drive moves in growing steps."""
    figure = canvas.new_figure(5.4)
    drive_axes, depth_axes = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    way, drive = moves(STAIRCASE, 1.0)
    lives, depth = _lives(model, drive)
    for value, born, died in lives:
        drive_axes.plot(way[[born, died]], [value, value], color=canvas.ORANGE, linewidth=1.4)
        drive_axes.plot(way[born], value, "o", color=canvas.ORANGE, markersize=5, zorder=4)
        drive_axes.plot(
            way[died], value, "x", color=canvas.INK, markersize=5, markeredgewidth=1.3, zorder=4
        )
    drive_axes.plot(way, drive, color=canvas.BLUE, linewidth=1.6, label="drive")
    drive_axes.plot([], [], "-o", color=canvas.ORANGE, markersize=5, label="remembered reversal")
    drive_axes.plot([], [], "x", color=canvas.INK, markersize=5, label="erased")
    depth_axes.step(way, depth, where="post", color=canvas.BLUE, linewidth=1.6)
    depth_axes.fill_between(way, depth, step="post", color=canvas.BLUE, alpha=0.12, linewidth=0)
    canvas.dress(drive_axes, "drive and remembered reversals", "", f"drive ({unit})")
    canvas.dress(
        depth_axes,
        "number of remembered reversals",
        f"distance travelled by the drive ({unit})",
        "reversals",
    )
    depth_axes.yaxis.set_major_locator(MultipleLocator(3))
    canvas.top_legend(figure, drive_axes)
    return figure


def _lives(
    model: mh.ModifiedPrandtlIshlinskii, drive: Samples
) -> tuple[list[tuple[float, int, int]], list[int]]:
    """Return each reversal with the samples at which it enters and leaves the memory."""
    stream = model.forward()
    lives: list[tuple[float, int, int]] = []
    stack: list[tuple[float, int]] = []
    depth = []
    for sample, value in enumerate(drive.tolist()):
        stream.step(value)
        remembered = stream.memory.tolist()
        while stack and [entry for entry, _ in stack] != remembered[: len(stack)]:
            entry, born = stack.pop()
            lives.append((entry, born, sample))
        stack += [(entry, max(0, sample - 1)) for entry in remembered[len(stack) :]]
        depth.append(len(remembered))
    return lives + [(entry, born, drive.size - 1) for entry, born in stack], depth


def tracking(time: Samples, target: Samples, schemes: Sequence[Tracking], unit: str) -> Figure:
    """Draw the target, and the tracking errors of all schemes to one scale."""
    figure = canvas.new_figure(1.5 + 1.35 * len(schemes))
    panels = figure.subplots(
        len(schemes) + 1, 1, sharex=True, height_ratios=(1.3, *(1.0 for _ in schemes))
    )
    kept = canvas.envelope(target)
    panels[0].plot(time[kept], target[kept], color=canvas.INK, linewidth=1.4)
    canvas.dress(panels[0], "target", "", f"position ({unit})")
    extent = 1.12e3 * max(float(np.abs(scheme.error).max()) for scheme in schemes)
    for axes, scheme in zip(panels[1:], schemes, strict=True):
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        error = 1e3 * scheme.error
        kept = canvas.envelope(error)
        axes.plot(time[kept], error[kept], color=scheme.colour, linewidth=1.4)
        axes.set_ylim(-extent, extent)
        largest = float(np.abs(error).max())
        said = f"at most {largest:.1f} nm" if largest >= 0.05 else "rounding errors"
        canvas.dress(axes, f"{scheme.name}: {said}", "", "error (nm)")
    panels[-1].set_xlim(time[0], time[-1])
    panels[-1].set_xlabel("time (s)", fontsize=10, color=canvas.INK)
    return figure


def side_by_side(trace: plots.Trace) -> Figure:
    """Draw loop, time course and error of each model in a row, as in Fig. 8 to 10 of the paper."""
    figure = canvas.new_figure(2.9 * len(trace.curves) + 0.4)
    panels = figure.subplots(len(trace.curves), 3, sharey="col", squeeze=False)
    time, unit = trace.time, trace.output_quantity.unit
    cloud = canvas.thinned(time.size, plots.CLOUD_POINTS)
    dots: dict[str, Any] = {"color": canvas.MEASURED, "markersize": 3.5, "markeredgewidth": 0}
    dots |= {"rasterized": True, "label": "measured"}
    for (loop, course, error), curve in zip(panels, trace.curves, strict=True):
        line: dict[str, Any] = {"color": curve.colour, "linewidth": 1.0, "label": curve.name}
        for axes, x in ((loop, trace.input), (course, time)):
            axes.plot(x[cloud], trace.measured[cloud], ".", **dots)
            axes.plot(x, curve.output, rasterized=True, **line)
        left = 1e3 * (trace.measured - curve.output)
        kept = canvas.envelope(left)
        error.plot(time[kept], left[kept], color=curve.colour, linewidth=0.7)
        error.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        canvas.dress(loop, curve.name, trace.input_quantity.label, trace.output_quantity.label)
        canvas.dress(course, "time course", trace.time_label, f"position ({unit})")
        canvas.dress(error, "error: measured − model", trace.time_label, "error (nm)")
        for axes in (course, error):
            axes.set_xlim(time[0], time[-1])
    return figure
