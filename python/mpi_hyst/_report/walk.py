"""The walk of Fig. 5 of the paper: one coupled play along straight moves between corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._paper.models import WALK_INPUT as WALK
from mpi_hyst._paper.models import WALK_THRESHOLDS
from mpi_hyst._report import canvas
from mpi_hyst._types import Samples


def moves(corners: Sequence[float], step: float) -> tuple[Samples, Samples]:
    """Sample straight moves between corners; return the distance travelled and the positions."""
    travelled = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(corners)))))
    way = np.union1d(np.arange(0.0, travelled[-1], step), travelled)
    return way, np.interp(way, travelled, corners)


def walk() -> Figure:
    """Draw the walk of Fig. 5: output over input, and both over the distance travelled."""
    figure = canvas.new_figure(4.3)
    plane, course = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    way, x = moves(WALK, 0.05)
    z = mh.CoupledPlay(*WALK_THRESHOLDS).run(x)
    corners = mh.CoupledPlay(*WALK_THRESHOLDS).run(WALK)
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


def _branches(axes: Axes) -> None:
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


def _mark(axes: Axes, number: int, x: float, z: float) -> None:
    """Draw the number of a corner."""
    axes.plot(x, z, "o", color="white", markeredgecolor=canvas.BLUE, markersize=13, zorder=4)
    axes.text(
        x, z, str(number), color=canvas.INK, fontsize=9, ha="center", va="center_baseline", zorder=5
    )
