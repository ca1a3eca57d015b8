"""Figures beyond the paper: errors of schemes over frequency and time, and saturation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

import mpi_hyst as mh
from mpi_hyst._paper import published
from mpi_hyst._paper.benchmark import DT, TRIANGLE
from mpi_hyst._paper.saturation import DRIVE_LIMITS, REACHED, Saturation
from mpi_hyst._paper.schemes import MOTIONS, Outcome
from mpi_hyst._report import canvas
from mpi_hyst._report.canvas import BLUE, GREEN, INK, MEASURED, ORANGE, SOFT

_PURPLE, _YELLOW, _SKY = "#cc79a7", "#b38600", "#56b4e9"
_SHOWN = {
    ("published law: Table II + P-I", "-"): ("published law", ORANGE, "o"),
    ("exact inverse + same P-I", "exact"): ("exact inverse + same P-I", SOFT, "x"),
    ("exact inverse, inverse dynamics + same P-I", "exact"): ("inverse dynamics, exact", BLUE, "o"),
    ("exact inverse, inverse dynamics + same P-I", "wrong model and dynamics"): (
        "inverse dynamics, wrong",
        _SKY,
        "s",
    ),
    ("iterative learning, 3 periods", "wrong model and dynamics"): (
        "wrong, iterative learning",
        GREEN,
        "^",
    ),
    ("repetitive control, 3 s", "wrong model and dynamics"): (
        "wrong, repetitive control",
        _PURPLE,
        "v",
    ),
    ("adaptation, 3 s", "wrong model and dynamics"): ("wrong, adaptation", _YELLOW, "D"),
}


def over_frequency(outcomes: Sequence[Outcome]) -> Figure:
    """Draw the largest true error over frequency for selected schemes."""
    figure = canvas.new_figure(4.6)
    axes = figure.subplots()
    sines = [motion for motion in MOTIONS if motion is not TRIANGLE]
    frequencies = [1.0 / (motion.period * DT) for motion in sines]
    for outcome in outcomes:
        look = _SHOWN.get((outcome.name, outcome.assumed))
        if look is None:
            continue
        label, colour, marker = look
        largest = [1e3 * outcome.errors[motion.name].max for motion in sines]
        axes.loglog(
            frequencies,
            largest,
            color=colour,
            marker=marker,
            markersize=5,
            label=label,
            linewidth=1.5,
        )
    values = {frequency: 1e3 * largest for frequency, largest in published.SINES.items()}
    axes.loglog(
        list(values),
        list(values.values()),
        "*",
        color=INK,
        markersize=9,
        label="published, measured error",
    )
    axes.xaxis.set_major_locator(FixedLocator([5.0, 10.0, 15.0, 20.0, 50.0, 100.0]))
    axes.xaxis.set_minor_locator(NullLocator())
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(ScalarFormatter())
    canvas.dress(axes, "largest error over frequency", "frequency (Hz)", "error (nm)")
    canvas.legend(axes, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def in_time(runs: Sequence[tuple[str, mh.plant.Run]], name: str) -> Figure:
    """Draw the measured and the true error of each run over time."""
    figure = canvas.new_figure(5.4)
    panels = figure.subplots(len(runs), 1, sharex=True)
    for axes, (title, run), colour in zip(panels, runs, (ORANGE, BLUE), strict=True):
        measured = 1e3 * (run.reference - run.measured)
        true = 1e3 * (run.reference - run.position)
        time = 1e3 * DT * np.arange(true.size)
        shown = slice(0, round(0.2 / DT))
        axes.plot(
            time[shown],
            measured[shown],
            color=MEASURED,
            linewidth=0.5,
            label="measured, with noise",
        )
        axes.plot(time[shown], true[shown], color=colour, linewidth=1.3, label="true position")
        canvas.dress(axes, f"{name}: {title}", "", "error (nm)")
        axes.set_xlim(0.0, time[shown][-1])
        canvas.legend(axes, loc="upper right", ncols=2)
        axes.set_ylim(bottom=axes.get_ylim()[0], top=1.35 * axes.get_ylim()[1])
    panels[-1].set_xlabel("time (ms)", fontsize=10, color=INK)
    return figure


def saturation(cases: Sequence[Saturation]) -> Figure:
    """Draw position, drive and error of the laws with Table II."""
    figure = canvas.new_figure(7.4)
    positions, drives, errors = figure.subplots(3, 1, sharex=True)
    shown = [case for case in cases if case.name == "Table II + P-I"]
    colours = (BLUE, GREEN, _PURPLE, ORANGE)
    time = DT * np.arange(shown[0].shown.reference.size)
    reference = shown[0].shown.reference
    kept = canvas.envelope(reference)
    positions.plot(time[kept], reference[kept], color=INK, linewidth=1.6, label="reference")
    left = []
    for case, colour in zip(shown, colours, strict=True):
        run = case.shown
        printed = case.law == "as printed"
        kept = canvas.envelope(run.position)
        positions.plot(time[kept], run.position[kept], color=colour, linewidth=1.1, label=case.law)
        kept = canvas.envelope(run.drive)
        drives.plot(time[kept], run.drive[kept], color=colour, linewidth=1.0)
        if not printed:
            error = 1e3 * (run.reference - run.position)
            left.append(error)
            kept = canvas.envelope(error)
            errors.plot(time[kept], error[kept], color=colour, linewidth=1.0)
    for limit in DRIVE_LIMITS:
        drives.axhline(limit, color=SOFT, linewidth=0.8, linestyle="--")
    beyond = np.abs(reference) > REACHED
    for axes in (positions, drives, errors):
        axes.fill_between(
            time,
            0.0,
            1.0,
            where=beyond,
            transform=axes.get_xaxis_transform(),
            color=canvas.GRID,
            linewidth=0,
            zorder=0,
        )
    canvas.dress(positions, "position", "", "position (µm)")
    canvas.dress(drives, "drive", "", "drive (V)")
    canvas.dress(errors, "true error (law as printed omitted)", "time (s)", "error (nm)")
    errors.set_ylim(-160, 160)
    canvas.note_outside(errors, *left)
    errors.set_xlim(0.0, time[-1])
    canvas.top_legend(figure, positions)
    return figure
