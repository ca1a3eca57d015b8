"""What is shown of a loop: its tuning over frequency, its course, and its times on a clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpi_hyst._core import LoopReport, LoopTimes, Run, Tuning
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._text import in_unit
from mpi_hyst._types import Flags, Samples

_POINTS = 3000
_BELOW = 100.0  # how far below the rejection bandwidth the figure begins
_LEAST = 1e-3  # of magnitudes: what is below says nothing about the loop


def tuning_figure(tuning: Tuning) -> canvas.Figure:
    """Draw magnitude and phase of the open loop, and the sensitivity, one below the other."""
    made = canvas.new_figure(8.4)
    panels = made.subplots(3, 1, sharex=True, height_ratios=(1.0, 0.75, 1.0))
    draw_tuning(list(panels), tuning)
    canvas.top_legend(made, panels[2])
    return made


def draw_tuning(panels: Sequence[canvas.Axes], tuning: Tuning) -> None:
    """Draw into three panels: magnitude and phase of the open loop, and the sensitivity."""
    from matplotlib.ticker import MultipleLocator

    magnitude, phase, sensitivity = panels
    frequencies = _frequencies(tuning)
    looks = [
        (tuning.at_min_slope, canvas.GREEN, "smallest slope of the hysteresis"),
        (tuning.at_max_slope, canvas.BLUE, "largest slope"),
    ]
    for margins, colour, name in looks:
        loop = tuning.open_loop(frequencies, margins.slope)
        look: dict[str, Any] = {"color": colour, "linewidth": 1.2}
        magnitude.plot(frequencies, np.abs(loop), **look)
        phase.plot(frequencies, np.degrees(np.unwrap(np.angle(loop))), **look)
        left = np.abs(tuning.sensitivity(frequencies, margins.slope))
        sensitivity.plot(frequencies, left, label=name, **look)
        if margins.crossover > 0.0:
            magnitude.plot([margins.crossover], [1.0], "o", color=colour, markersize=4.5)
    worst = tuning.worst_sensitivity(frequencies)
    orange = canvas.ORANGE
    sensitivity.plot(
        frequencies, worst, color=orange, linewidth=1.4, label="worst of all slopes and modes"
    )
    limit = tuning.peak_sensitivity_limit
    sensitivity.axhline(
        limit, color=canvas.INK, linewidth=1.0, linestyle="--", label=f"allowed: {limit:g}"
    )
    sensitivity.axvline(tuning.rejection_bandwidth, color=canvas.SOFT, linewidth=0.8, linestyle=":")
    magnitude.axhline(1.0, color=canvas.SOFT, linewidth=0.8)
    phase.axhline(-180.0, color=canvas.SOFT, linewidth=0.8)
    canvas.dress(magnitude, "open loop: magnitude", "", "|L|")
    canvas.dress(phase, "open loop: phase", "", "degrees")
    canvas.dress(sensitivity, "sensitivity 1 / (1 + L)", "frequency (Hz)", "|S|")
    phase.yaxis.set_major_locator(MultipleLocator(90.0))
    for axes in panels:
        axes.set_xscale("log")
        axes.set_xlim(frequencies[0], frequencies[-1])
    for axes in (magnitude, sensitivity):
        axes.set_yscale("log")
    magnitude.set_ylim(bottom=max(magnitude.get_ylim()[0], _LEAST))


def _frequencies(tuning: Tuning) -> Samples:
    """Return frequencies up to half of the sampling rate, evenly on a logarithmic axis.

    At half of the rate itself L is real, and its phase may be one turn more or less.
    """
    highest = 0.5 / tuning.dt * 0.995
    bandwidth = min(max(tuning.rejection_bandwidth, 1e-4 * highest), highest)
    # The peaks that the margins name are among them, however narrow.
    peaks = [tuning.at_min_slope.peak_frequency, tuning.at_max_slope.peak_frequency]
    even = np.geomspace(bandwidth / _BELOW, highest, _POINTS)
    return np.unique(np.clip([*even, *peaks], even[0], highest))


_MARKS = 400  # events drawn at most of each kind: their number is in the title


@dataclass(frozen=True)
class Course:
    """A run with its time. `limits` are those of the drive; without `noise` the error is one."""

    run: Run
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


def is_noisy(run: Run) -> bool:
    """Return whether something else was measured than the position."""
    return bool(np.any((run.measured != run.position) & np.isfinite(run.measured)))


def course_figure(course: Course) -> canvas.Figure:
    """Draw reference and position, error and drive, one below the other."""
    made = canvas.new_figure(7.2)
    panels = made.subplots(3, 1, sharex=True)
    draw_course(list(panels), course)
    canvas.top_legend(made, *panels)
    return made


def draw_course(panels: Sequence[canvas.Axes], course: Course) -> None:
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


def _line(axes: canvas.Axes, course: Course, values: Samples, **look: Any) -> None:
    """Draw what is known, with every spike."""
    known = np.isfinite(values)
    canvas.line(axes, course.time[known], values[known], **look)


def _mark(axes: canvas.Axes, course: Course, at: Flags, values: Samples, name: str) -> None:
    """Mark the samples at which something happened, with their number."""
    samples = np.flatnonzero(at)
    if samples.size == 0:
        return
    some = samples[canvas.thinned(samples.size, _MARKS)]
    look: dict[str, Any] = {"color": canvas.ORANGE, "markersize": 4.0, "linestyle": "none"}
    axes.plot(course.time[some], values[some], "v", label=f"{name}: {samples.size}", **look)


_MICROSECONDS = 1e6


def times_figure(report: LoopReport) -> canvas.Figure:
    """Draw the histograms of latency, computing time and period."""
    made = canvas.new_figure(3.6)
    draw_times(list(made.subplots(1, 3)), report)
    return made


def draw_times(panels: Sequence[canvas.Axes], report: LoopReport) -> None:
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


def _histogram(axes: canvas.Axes, times: LoopTimes, colour: str) -> None:
    classes = times.histogram
    ends = _MICROSECONDS * np.array([end for end, _ in classes])
    counts = np.array([count for _, count in classes])
    # A class is a fifth of its upper end wide.
    axes.bar(ends, counts, width=-0.2 * ends, align="edge", color=colour)


def loop_facts(report: LoopReport) -> list[tuple[str, str]]:
    """Return how it ended, what was counted, and the machine."""
    values = report.to_dict()
    machine, counts, datagrams = values["machine"], values["counts"], values["datagrams"]
    end = report.end.replace("_", " ")
    rest = "at the rest drive" if report.at_rest else f"NOT at rest, at {report.last_drive:g}"
    sent = [] if datagrams is None else [("datagrams", _counted(datagrams))]
    return [
        ("end", f"{end}, {rest}, after {report.seconds:.3f} s"),
        ("samples", f"{report.taken}, {report.skipped} deadlines skipped"),
        ("missed deadlines", f"{report.missed}, {report.late} samples began that late"),
        ("stale measurements", f"{report.stale}"),
        ("faults", f"{counts['read_faults']} of reading, {counts['write_faults']} of writing"),
        *sent,
        ("machine", f"{machine['cpu']}, {machine['processors']} processors, {machine['system']}"),
    ]


def _counted(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def loop_times(report: LoopReport) -> tuple[list[str], list[list[str]]]:
    """Return latency, computing time and period as a table."""
    header = ["µs", "median", "p99", "p99.9", "p99.99", "max"]
    named = [("latency", report.latency), ("compute", report.compute), ("period", report.period)]
    rows = [
        [name]
        + [
            f"{1e6 * time:.2f}"
            for time in (times.median, times.p99, times.p999, times.p9999, times.max)
        ]
        for name, times in named
    ]
    return header, rows
