"""Figures of the reproduction: operators, models, the published law, schemes beyond the paper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mpi_hyst._core import CoupledPlay, Play, Run
from mpi_hyst._paper import published
from mpi_hyst._paper.benchmark import DT, TRIANGLE
from mpi_hyst._paper.reproduction import RECORD_RATE, WALK_THRESHOLDS, Fit, Models, Trial
from mpi_hyst._paper.schemes import DRIVE_LIMITS, MOTIONS, REACHED, Outcome, Saturation
from mpi_hyst._report import canvas
from mpi_hyst._report.canvas import BLUE, GREEN, INK, MEASURED, ORANGE, SOFT
from mpi_hyst._types import Samples

_COLOURS = (BLUE, GREEN, ORANGE)
_PANEL_POINTS = 1000  # for half the width of the page


def loop(models: Models) -> canvas.Figure:
    """Fig. 1: the hysteresis of the actuator, and the same minus the straight line."""
    figure = canvas.new_figure(4.0)
    whole, width = figure.subplots(1, 2)
    line = np.polynomial.Polynomial.fit(models.drive, models.position, 1)
    whole.plot(models.drive, models.position, color=BLUE, linewidth=1.0)
    width.plot(models.drive, models.position - line(models.drive), color=BLUE, linewidth=1.0)
    canvas.dress(whole, "displacement over drive", "drive (V)", "displacement (µm)")
    canvas.dress(width, "minus straight line", "drive (V)", "Δ displacement (µm)")
    return figure


def operators() -> canvas.Figure:
    """Fig. 4: a play and a coupled play under the same growing oscillation."""
    figure = canvas.new_figure(4.0)
    classical, coupled = figure.subplots(1, 2, sharey=True)
    phase = np.linspace(0.0, 3.0, 3001)
    x = 30.0 * (0.4 + 0.2 * phase) * np.sin(2.0 * np.pi * phase)
    r = WALK_THRESHOLDS[0]
    named = (
        (classical, f"play, r = {r:g} V", Play(r).run(x)),
        (
            coupled,
            "coupled play, r, ra, rb, rc = 10, 8, 3, 4 V",
            CoupledPlay(*WALK_THRESHOLDS).run(x),
        ),
    )
    for axes, title, z in named:
        axes.plot(x, z, color=BLUE, linewidth=1.5)
        canvas.dress(axes, title, "input x (V)", "output z (V)")
    return figure


def fits(models: Models) -> canvas.Figure:
    """Fig. 8, 9, 10: the record with both identified models, and their errors."""
    figure = canvas.new_figure(3.2 + 1.9 * len(models.fits))
    below = [str(index) for index in range(len(models.fits))]
    panels = figure.subplot_mosaic(
        ";".join(["LT", *(2 * name for name in below)]), height_ratios=(1.9, *(1.0 for _ in below))
    )
    time = np.arange(models.drive.size) / RECORD_RATE
    shown = (models.fits[1], models.fits[0])
    for axes, x in ((panels["L"], models.drive), (panels["T"], time)):
        axes.plot(x, models.fits[0].wanted, ".", color=MEASURED, markersize=2.5, rasterized=True)
        for fit, colour in zip(shown, (GREEN, BLUE), strict=True):
            axes.plot(x, fit.predicted, color=colour, linewidth=0.9)
    canvas.dress(panels["L"], "record and models over drive", "drive (V)", "position (µm)")
    canvas.dress(panels["T"], "record and models over time", "time (s)", "position (µm)")
    panels["T"].set_xlim(time[0], time[-1])
    extent = 1.1e3 * max(float(np.abs(fit.measured_error).max()) for fit in models.fits)
    for index, (fit, colour) in enumerate(zip(models.fits, _COLOURS, strict=True)):
        _error_panel(panels[below[index]], time, fit, colour, extent)
    panels[below[-1]].set_xlabel("time (s)", fontsize=10, color=INK)
    return figure


def _error_panel(axes: canvas.Axes, time: Samples, fit: Fit, colour: str, extent: float) -> None:
    canvas.line(axes, time, 1e3 * fit.measured_error, color=colour, linewidth=0.6)
    title = f"{fit.figure}, {fit.name}: at most {fit.max_percent:.2f} % of range"
    canvas.dress(axes, "", "", "error (nm)")
    # Longer than names of files may be.
    axes.set_title(title, loc="left", fontsize=10.5, color=INK, fontweight="bold")
    axes.set(xlim=(time[0], time[-1]), ylim=(-extent, extent))


def errors(trials: Sequence[Trial]) -> canvas.Figure:
    """Fig. 12 to 17 on one plant: the measured error and the published maximum."""
    figure = canvas.new_figure(7.6)
    panels = figure.subplots(3, 2)
    for axes, trial in zip(panels.flat, trials, strict=True):
        run = trial.shown
        error = 1e3 * (run.reference - run.measured)
        true = 1e3 * (run.reference - run.position)
        time = DT * np.arange(error.size)
        for values, colour, label in ((error, MEASURED, "measured"), (true, BLUE, "true position")):
            canvas.line(axes, time, values, _PANEL_POINTS, color=colour, linewidth=0.8, label=label)
        for sign in (-1.0, 1.0):
            axes.axhline(
                sign * 1e3 * trial.published[1],
                color=ORANGE,
                linewidth=1.1,
                linestyle="--",
                label="published maximum" if sign > 0.0 else None,
            )
        extent = 1.25e3 * max(trial.published[1], run.metrics.max_error)
        axes.set(xlim=(0.0, time[-1]), ylim=(-extent, extent))
        title = f"{trial.figure}: {trial.motion.name}, {trial.feedforward}"
        canvas.dress(axes, title, "time (s)", "error (nm)")
    canvas.top_legend(figure, panels[0][0])
    return figure


def tracks(trials: Sequence[Trial]) -> canvas.Figure:
    """Fig. 12 to 17 on one plant: reference and position."""
    figure = canvas.new_figure(5.6)
    panels = figure.subplots(2, 3, sharey=True)
    for axes, trial in zip(panels.flat, trials, strict=True):
        run = trial.shown
        time = DT * np.arange(run.reference.size)
        kept = canvas.envelope(run.position, _PANEL_POINTS)
        axes.plot(time[kept], run.reference[kept], color=SOFT, linewidth=1.8, label="reference")
        axes.plot(time[kept], run.position[kept], color=BLUE, linewidth=1.0, label="position")
        axes.set_xlim(0.0, time[-1])
        title = f"{trial.figure}: {trial.motion.name}"
        canvas.dress(axes, title, "time (s)", "" if axes is not panels.flat[0] else "position (µm)")
    panels[1][0].set_ylabel("position (µm)", fontsize=10, color=INK)
    canvas.top_legend(figure, panels[0][0])
    return figure


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


def over_frequency(outcomes: Sequence[Outcome]) -> canvas.Figure:
    """Draw the largest true error over frequency for selected schemes."""
    from matplotlib.ticker import FixedLocator, NullLocator, ScalarFormatter

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


def in_time(runs: Sequence[tuple[str, Run]], name: str) -> canvas.Figure:
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


def saturated_laws(cases: Sequence[Saturation]) -> canvas.Figure:
    """Draw position, drive and error of the laws with Table II."""
    figure = canvas.new_figure(7.4)
    positions, drives, errors = figure.subplots(3, 1, sharex=True)
    shown = [case for case in cases if case.name == "Table II + P-I"]
    colours = (BLUE, GREEN, _PURPLE, ORANGE)
    time = DT * np.arange(shown[0].shown.reference.size)
    reference = shown[0].shown.reference
    canvas.line(positions, time, reference, color=INK, linewidth=1.6, label="reference")
    left = []
    for case, colour in zip(shown, colours, strict=True):
        run = case.shown
        printed = case.law == "as printed"
        canvas.line(positions, time, run.position, color=colour, linewidth=1.1, label=case.law)
        canvas.line(drives, time, run.drive, color=colour, linewidth=1.0)
        if not printed:
            error = 1e3 * (run.reference - run.position)
            left.append(error)
            canvas.line(errors, time, error, color=colour, linewidth=1.0)
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
