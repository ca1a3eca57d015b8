"""Figures of the demo alone: the walk of Fig. 5, the turning-point memory, the tracking errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

import mpi_hyst as mh
from mpi_hyst import _plots
from mpi_hyst._records import Samples

WALK = (0.0, 20.0, -20.0, 15.0, 6.0, 25.0, -15.0, -5.0)
WALK_THRESHOLDS = (10.0, 8.0, 3.0, 4.0)  # r, ra, rb, rc
STAIRCASE = (
    *(0.0, 450.0, 40.0, 400.0, 90.0, 350.0, 140.0, 300.0, 190.0),  # every move inside the last
    *(265.0, 165.0, 325.0, 115.0, 375.0, 65.0, 425.0, 15.0, 480.0),  # every move beyond the last
)


@dataclass(frozen=True)
class Tracking:
    """How one scheme follows the target."""

    name: str
    colour: str
    error: Samples


def moves(corners: Sequence[float], step: float) -> tuple[Samples, Samples]:
    """Sample the straight moves between corners; return the way travelled and the positions."""
    travelled = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(corners)))))
    way = np.union1d(np.arange(0.0, travelled[-1], step), travelled)
    return way, np.interp(way, travelled, corners)


def walk() -> Figure:
    """Draw the operator's walk of Fig. 5 beside its input and output over the way travelled."""
    figure = _plots.new_figure(4.3)
    plane, course = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    way, x = moves(WALK, 0.05)
    z = mh.CoupledPlay(*WALK_THRESHOLDS).run(x)
    corners = mh.CoupledPlay(*WALK_THRESHOLDS).run(WALK)
    _branches(plane)
    plane.plot(x, z, color=_plots.BLUE, linewidth=2.0)
    for at in _arrow_places(way):
        plane.annotate(
            "",
            (x[at + 8], z[at + 8]),
            (x[at], z[at]),
            arrowprops={"arrowstyle": "-|>", "color": _plots.BLUE, "mutation_scale": 15},
        )
    for number, (corner, value) in enumerate(zip(WALK, corners, strict=True)):
        _mark(plane, number, corner, float(value))
    plane.set(xlim=(-34, 40), ylim=(-17, 20))
    _plots.dress(plane, "output z over input x", "x (V)", "z (V)")
    course.plot(way, x, color=_plots.MEASURED, linewidth=1.8, label="input x")
    course.plot(way, z, color=_plots.BLUE, linewidth=2.0, label="output z")
    _plots.dress(course, "the same over the way travelled", "sum of |Δx| (V)", "x, z (V)")
    _plots.legend(course, loc="upper right", ncols=2)
    course.set_ylim(-24, 33)
    return figure


def _branches(axes: Axes) -> None:
    """Draw and name the four lines that z can follow, and the zero at which it sticks."""
    r, ra, rb, rc = WALK_THRESHOLDS
    for shift, low, high, name, at, side in (
        (-r, 0.0, 22.0, "rising: z = x − r", (22.0, 7.5), "left"),
        (-rc, -22.0, 0.0, "rising: z = x − rc", (-4.0, -14.0), "left"),
        (rb, 0.0, 22.0, "falling: z = x + rb", (8.5, 17.0), "right"),
        (ra, -22.0, 0.0, "falling: z = x + ra", (-15.0, -2.6), "right"),
    ):
        axes.plot(
            [low - shift, high - shift],
            [low, high],
            color=_plots.SOFT,
            linewidth=0.9,
            linestyle=(0, (4, 3)),
        )
        axes.text(*at, name, fontsize=9, color=_plots.SOFT, ha=side, va="center")
    axes.annotate(
        "z sticks at zero",
        (-5.6, 0.0),
        xytext=(-7.5, 6.5),
        fontsize=9,
        color=_plots.SOFT,
        ha="right",
        arrowprops={"arrowstyle": "-", "color": _plots.SOFT, "linewidth": 0.7},
    )


def _arrow_places(way: Samples) -> list[int]:
    """Return where arrows go: in the middle of every move."""
    travelled = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(WALK)))))
    return [int(np.searchsorted(way, middle)) for middle in (travelled[1:] + travelled[:-1]) / 2]


def _mark(axes: Axes, number: int, x: float, z: float) -> None:
    """Put the number of a corner of the walk where it lies."""
    axes.plot(x, z, "o", color="white", markeredgecolor=_plots.BLUE, markersize=13, zorder=4)
    axes.text(
        x, z, str(number), color=_plots.INK, fontsize=9, ha="center", va="center_baseline", zorder=5
    )


def memory(model: mh.ModifiedPrandtlIshlinskii, unit: str) -> Figure:
    """Draw which reversals a model remembers while the drive moves in a staircase."""
    figure = _plots.new_figure(5.4)
    drive_axes, depth_axes = figure.subplots(2, 1, sharex=True, height_ratios=(2.4, 1.0))
    way, drive = moves(STAIRCASE, 1.0)
    lives, depth = _lives(model, drive)
    for value, born, died in lives:
        drive_axes.plot(way[[born, died]], [value, value], color=_plots.ORANGE, linewidth=1.4)
        drive_axes.plot(way[born], value, "o", color=_plots.ORANGE, markersize=5, zorder=4)
        drive_axes.plot(
            way[died], value, "x", color=_plots.INK, markersize=5, markeredgewidth=1.3, zorder=4
        )
    drive_axes.plot(way, drive, color=_plots.BLUE, linewidth=1.6, label="drive")
    drive_axes.plot([], [], "-o", color=_plots.ORANGE, markersize=5, label="reversal remembered")
    drive_axes.plot([], [], "x", color=_plots.INK, markersize=5, label="wiped out")
    depth_axes.step(way, depth, where="post", color=_plots.BLUE, linewidth=1.6)
    depth_axes.fill_between(way, depth, step="post", color=_plots.BLUE, alpha=0.12, linewidth=0)
    _plots.dress(drive_axes, "drive and the reversals that still count", "", f"drive ({unit})")
    _plots.dress(
        depth_axes, "how many are remembered", f"way travelled by the drive ({unit})", "reversals"
    )
    depth_axes.yaxis.set_major_locator(MultipleLocator(3))
    _plots.top_legend(figure, drive_axes)
    return figure


def _lives(
    model: mh.ModifiedPrandtlIshlinskii, drive: Samples
) -> tuple[list[tuple[float, int, int]], list[int]]:
    """Return every reversal with the samples where it entered and left the memory."""
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
    """Draw the target and, to one scale, how far from it each scheme leaves the actuator."""
    figure = _plots.new_figure(1.5 + 1.35 * len(schemes))
    panels = figure.subplots(
        len(schemes) + 1, 1, sharex=True, height_ratios=(1.3, *(1.0 for _ in schemes))
    )
    kept = _plots.envelope(target)
    panels[0].plot(time[kept], target[kept], color=_plots.INK, linewidth=1.4)
    _plots.dress(panels[0], "target", "", f"position ({unit})")
    extent = 1.12e3 * max(float(np.abs(scheme.error).max()) for scheme in schemes)
    for axes, scheme in zip(panels[1:], schemes, strict=True):
        axes.axhline(0.0, color=_plots.SOFT, linewidth=0.8)
        error = 1e3 * scheme.error
        kept = _plots.envelope(error)
        axes.plot(time[kept], error[kept], color=scheme.colour, linewidth=1.4)
        axes.set_ylim(-extent, extent)
        largest = float(np.abs(error).max())
        said = f"at most {largest:.1f} nm" if largest >= 0.05 else "rounding only"
        _plots.dress(axes, f"{scheme.name}: {said}", "", "error (nm)")
    panels[-1].set_xlim(time[0], time[-1])
    panels[-1].set_xlabel("time (s)", fontsize=10, color=_plots.INK)
    return figure


def side_by_side(trace: _plots.Trace) -> Figure:
    """Draw loop, time course and error of each model in a row, as Fig. 8 to 10 of the paper do."""
    figure = _plots.new_figure(2.9 * len(trace.curves) + 0.4)
    panels = figure.subplots(len(trace.curves), 3, sharey="col", squeeze=False)
    time, unit = trace.time, trace.output_quantity.shown_unit
    cloud = _plots.thinned(time.size, _plots.CLOUD_POINTS)
    dots: dict[str, Any] = {"color": _plots.MEASURED, "markersize": 3.5, "markeredgewidth": 0}
    dots |= {"rasterized": True, "label": "measured"}
    for (loop, course, error), curve in zip(panels, trace.curves, strict=True):
        line: dict[str, Any] = {"color": curve.colour, "linewidth": 1.0, "label": curve.name}
        for axes, x in ((loop, trace.input), (course, time)):
            axes.plot(x[cloud], trace.measured[cloud], ".", **dots)
            axes.plot(x, curve.output, rasterized=True, **line)
        left = 1e3 * (trace.measured - curve.output)
        kept = _plots.envelope(left)
        error.plot(time[kept], left[kept], color=curve.colour, linewidth=0.7)
        error.axhline(0.0, color=_plots.SOFT, linewidth=0.8)
        _plots.dress(loop, curve.name, trace.input_quantity.label, trace.output_quantity.label)
        _plots.dress(course, "time course", trace.time_label, f"position ({unit})")
        _plots.dress(error, "error: measured − model", trace.time_label, "error (nm)")
        for axes in (course, error):
            axes.set_xlim(time[0], time[-1])
    return figure
