"""The course of a closed loop: reference and position, error, drive and what happened to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._types import Flags, Samples

_MARKS = 400  # events drawn at most of each kind: their number is in the title


@dataclass(frozen=True)
class Course:
    """A run with its time. `limits` are those of the drive; without `noise` the error is one."""

    run: mh.plant.Run
    time: Samples
    time_label: str
    quantity: Quantity
    drive_label: str
    limits: tuple[float, float] | None
    noise: bool

    @property
    def saturated(self) -> Flags:
        """At which samples the drive was at a limit."""
        if self.limits is None:
            return np.zeros(len(self.run), dtype=bool)
        return np.isin(self.run.drive, self.limits)

    @property
    def missing(self) -> Flags:
        """At which samples there was no reading."""
        return np.isnan(self.run.measured)


def is_noisy(run: mh.plant.Run) -> bool:
    """Return whether something else was measured than the position."""
    return bool(np.any((run.measured != run.position) & np.isfinite(run.measured)))


def figure(course: Course) -> Figure:
    """Draw reference and position, error and drive, one below the other."""
    made = canvas.new_figure(7.2)
    panels = made.subplots(3, 1, sharex=True)
    draw(course, list(panels))
    canvas.top_legend(made, *panels)
    return made


def draw(course: Course, panels: Sequence[Axes]) -> None:
    """Draw into three panels: reference and position, error, drive."""
    positions, errors, drives = panels
    run, soft, blue = course.run, canvas.SOFT, canvas.BLUE
    _line(positions, course, run.reference, color=soft, linewidth=2.0, label="reference")
    _line(positions, course, run.position, color=blue, linewidth=1.0, label="true position")
    drawn = [np.asarray(run.reference - run.position)]
    if course.noise:
        drawn.insert(0, np.asarray(run.reference - run.measured))
        look: dict[str, Any] = {"color": canvas.MEASURED, "linewidth": 0.6, "label": "measured"}
        _line(errors, course, drawn[0], **look)
    _line(errors, course, drawn[-1], color=blue, linewidth=1.0)
    _line(drives, course, run.drive, color=canvas.GREEN, linewidth=1.0, label="drive")
    for limit in course.limits or ():
        drives.axhline(limit, color=soft, linewidth=0.8, linestyle="--")
    _mark(drives, course, course.saturated, run.drive, "saturated")
    _mark(positions, course, course.missing, run.reference, "no reading")
    quantity = course.quantity
    canvas.dress(positions, "reference and position", "", quantity.label)
    label = f"error{quantity.in_parentheses}"
    canvas.dress(errors, "error: reference − position", "", label)
    title = "drive" if course.limits is None else "drive and its limits"
    canvas.dress(drives, title, course.time_label, course.drive_label)
    low, high = canvas.shown(np.concatenate(drawn)) if drawn else (0.0, 0.0)
    margin = 0.06 * (high - low) or 1e-12
    errors.set_ylim(low - margin, high + margin)
    canvas.note_outside(errors, *drawn)
    end = course.time[-1] if len(run) > 1 else course.time[0] + 1.0
    drives.set_xlim(course.time[0], end)


def _line(axes: Axes, course: Course, values: Samples, **look: Any) -> None:
    """Draw what is known, with every spike."""
    known = np.flatnonzero(np.isfinite(values))
    kept = known[canvas.envelope(values[known])] if known.size else known
    axes.plot(course.time[kept], values[kept], **look)


def _mark(axes: Axes, course: Course, at: Flags, values: Samples, name: str) -> None:
    """Mark the samples at which something happened, with their number."""
    samples = np.flatnonzero(at)
    if samples.size == 0:
        return
    some = samples[canvas.thinned(samples.size, _MARKS)]
    look: dict[str, Any] = {"color": canvas.ORANGE, "markersize": 4.0, "linestyle": "none"}
    axes.plot(course.time[some], values[some], "v", label=f"{name}: {samples.size}", **look)
