"""Figures of the reproduction: operators, models, the published law on the benchmark plants."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._paper.benchmark import DT
from mpi_hyst._paper.loops import Trial
from mpi_hyst._paper.models import RECORD_RATE, WALK_THRESHOLDS, Fit, Models
from mpi_hyst._report import canvas
from mpi_hyst._report.canvas import BLUE, GREEN, INK, MEASURED, ORANGE, SOFT
from mpi_hyst._types import Samples

_COLOURS = (BLUE, GREEN, ORANGE)
_PANEL_POINTS = 1000  # for half the width of the page


def loop(models: Models) -> Figure:
    """Fig. 1: the hysteresis of the actuator, and the same minus the straight line."""
    figure = canvas.new_figure(4.0)
    whole, width = figure.subplots(1, 2)
    line = np.polynomial.Polynomial.fit(models.drive, models.position, 1)
    whole.plot(models.drive, models.position, color=BLUE, linewidth=1.0)
    width.plot(models.drive, models.position - line(models.drive), color=BLUE, linewidth=1.0)
    canvas.dress(whole, "displacement over drive", "drive (V)", "displacement (µm)")
    canvas.dress(width, "minus straight line", "drive (V)", "Δ displacement (µm)")
    return figure


def operators() -> Figure:
    """Fig. 4: a play and a coupled play under the same growing oscillation."""
    figure = canvas.new_figure(4.0)
    classical, coupled = figure.subplots(1, 2, sharey=True)
    phase = np.linspace(0.0, 3.0, 3001)
    x = 30.0 * (0.4 + 0.2 * phase) * np.sin(2.0 * np.pi * phase)
    r = WALK_THRESHOLDS[0]
    named = (
        (classical, f"play, r = {r:g} V", mh.Play(r).run(x)),
        (
            coupled,
            "coupled play, r, ra, rb, rc = 10, 8, 3, 4 V",
            mh.CoupledPlay(*WALK_THRESHOLDS).run(x),
        ),
    )
    for axes, title, z in named:
        axes.plot(x, z, color=BLUE, linewidth=1.5)
        canvas.dress(axes, title, "input x (V)", "output z (V)")
    return figure


def fits(models: Models) -> Figure:
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


def _error_panel(axes: Axes, time: Samples, fit: Fit, colour: str, extent: float) -> None:
    kept = canvas.envelope(fit.measured_error)
    axes.plot(time[kept], 1e3 * fit.measured_error[kept], color=colour, linewidth=0.6)
    title = f"{fit.figure}, {fit.name}: at most {fit.max_percent:.2f} % of range"
    canvas.dress(axes, "", "", "error (nm)")
    # Longer than names of files may be.
    axes.set_title(title, loc="left", fontsize=10.5, color=INK, fontweight="bold")
    axes.set(xlim=(time[0], time[-1]), ylim=(-extent, extent))


def errors(trials: Sequence[Trial]) -> Figure:
    """Fig. 12 to 17 on one plant: the measured error and the published maximum."""
    figure = canvas.new_figure(7.6)
    panels = figure.subplots(3, 2)
    for axes, trial in zip(panels.flat, trials, strict=True):
        run = trial.shown
        error = 1e3 * (run.reference - run.measured)
        true = 1e3 * (run.reference - run.position)
        time = DT * np.arange(error.size)
        for values, colour, label in ((error, MEASURED, "measured"), (true, BLUE, "true position")):
            kept = canvas.envelope(values, _PANEL_POINTS)
            axes.plot(time[kept], values[kept], color=colour, linewidth=0.8, label=label)
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


def tracks(trials: Sequence[Trial]) -> Figure:
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
