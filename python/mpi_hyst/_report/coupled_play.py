"""Figures that explain the coupled play: the walk of Fig. 5 of the paper, and its memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mpi_hyst._core import CoupledPlay, ModifiedPrandtlIshlinskii
from mpi_hyst._paper.reproduction import WALK_INPUT as WALK
from mpi_hyst._paper.reproduction import WALK_THRESHOLDS
from mpi_hyst._report import canvas
from mpi_hyst._types import Samples


def moves(corners: Sequence[float], step: float) -> tuple[Samples, Samples]:
    """Sample straight moves between corners; return the distance travelled and the positions."""
    travelled = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(corners)))))
    way = np.union1d(np.arange(0.0, travelled[-1], step), travelled)
    return way, np.interp(way, travelled, corners)


def walk() -> canvas.Figure:
    """Draw the walk of Fig. 5: output over input, and both over the distance travelled."""
    figure = canvas.new_figure(4.3)
    plane, course = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    way, x = moves(WALK, 0.05)
    z = CoupledPlay(*WALK_THRESHOLDS).run(x)
    corners = CoupledPlay(*WALK_THRESHOLDS).run(WALK)
    _branches(plane)
    plane.plot(x, z, color=canvas.BLUE, linewidth=2.0)
    for at in _arrow_places(way):
        plane.annotate(
            "",
            (x[at + 8], z[at + 8]),
            (x[at], z[at]),
            arrowprops={"arrowstyle": "-|>", "color": canvas.BLUE, "mutation_scale": 15},
        )
    for number, (corner, value) in enumerate(zip(WALK, corners, strict=True)):
        _mark(plane, number, corner, float(value))
    plane.set(xlim=(-34, 40), ylim=(-17, 20))
    canvas.dress(plane, "output z over input x", "x (V)", "z (V)")
    course.plot(way, x, color=canvas.MEASURED, linewidth=1.8, label="input x")
    course.plot(way, z, color=canvas.BLUE, linewidth=2.0, label="output z")
    canvas.dress(course, "input and output over distance", "sum of |Δx| (V)", "x, z (V)")
    canvas.legend(course, loc="upper right", ncols=2)
    course.set_ylim(-24, 33)
    return figure


def _branches(axes: canvas.Axes) -> None:
    """Draw and label the four lines that z can follow, and the section at zero."""
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
            color=canvas.SOFT,
            linewidth=0.9,
            linestyle=(0, (4, 3)),
        )
        axes.text(*at, name, fontsize=9, color=canvas.SOFT, ha=side, va="center")
    axes.annotate(
        "z stays at zero",
        (-5.6, 0.0),
        xytext=(-7.5, 6.5),
        fontsize=9,
        color=canvas.SOFT,
        ha="right",
        arrowprops={"arrowstyle": "-", "color": canvas.SOFT, "linewidth": 0.7},
    )


def _arrow_places(way: Samples) -> list[int]:
    """Return the samples of the arrows: the middle of every move."""
    travelled = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(WALK)))))
    return [int(np.searchsorted(way, middle)) for middle in (travelled[1:] + travelled[:-1]) / 2]


def _mark(axes: canvas.Axes, number: int, x: float, z: float) -> None:
    """Draw the number of a corner."""
    axes.plot(x, z, "o", color="white", markeredgecolor=canvas.BLUE, markersize=13, zorder=4)
    axes.text(
        x, z, str(number), color=canvas.INK, fontsize=9, ha="center", va="center_baseline", zorder=5
    )


STAIRCASE = (
    *(0.0, 450.0, 40.0, 400.0, 90.0, 350.0, 140.0, 300.0, 190.0),  # each step inside the last one
    *(265.0, 165.0, 325.0, 115.0, 375.0, 65.0, 425.0, 15.0, 480.0),  # each step beyond the last one
)


def memory_course(model: ModifiedPrandtlIshlinskii, unit: str) -> canvas.Figure:
    """Draw the reversals that a model remembers while the drive moves in growing steps."""
    from matplotlib.ticker import MultipleLocator

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
    model: ModifiedPrandtlIshlinskii, drive: Samples
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
