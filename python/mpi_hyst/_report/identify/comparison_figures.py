"""Figures on the comparison of models: their errors, and what each leaves over the drive."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.identify.records import Task

_COLUMNS = 4  # panels side by side
_BAR = 0.38  # of the distance between two models
_FEWEST = 3  # models that the figure has room for at least


def errors(comparison: mh.results.Comparison, task: Task) -> Figure:
    """Draw the rms error of every model: fitted, held out, and on the worst stretch."""
    rows = comparison.rows
    figure = canvas.new_figure(1.1 + 0.5 * max(len(rows), _FEWEST))
    axes = figure.subplots()
    place = np.arange(len(rows))
    axes.barh(
        place - 0.5 * _BAR,
        [row.fit.rmse for row in rows],
        _BAR,
        color=canvas.MEASURED,
        label="fitted",
    )
    axes.barh(
        place + 0.5 * _BAR,
        [row.held_out for row in rows],
        _BAR,
        color=canvas.BLUE,
        label="held out",
    )
    axes.plot(
        [row.worst_stretch for row in rows],
        place + 0.5 * _BAR,
        "D",
        color=canvas.ORANGE,
        markersize=4.5,
        label="worst stretch",
    )
    axes.set_yticks(place, [_marked(row, comparison) for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(left=0.0)
    label = f"rms error{task.output.in_parentheses}"
    canvas.dress(axes, "error of every model", label, "")
    axes.grid(visible=False, axis="y")
    canvas.top_legend(figure, axes)
    return figure


def residuals(comparison: mh.results.Comparison, task: Task, record: int) -> Figure:
    """Draw the residuals of every model over the drive, all on one scale."""
    rows, shown = comparison.rows, task.records.fitted[record]
    lines = -(-len(rows) // _COLUMNS)
    columns = min(len(rows), _COLUMNS)
    figure = canvas.new_figure(0.5 + 2.3 * lines)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    kept = slice(shown.skip, None)
    every = canvas.thinned(shown.input[kept].size, plots.CLOUD_POINTS)
    left_by_all = [row.residuals(shown.input, shown.output, record=record)[kept] for row in rows]
    extent = canvas.extent(*left_by_all)
    panels[0, 0].set_ylim(-extent, extent)
    for axes, row, left in zip(panels.flat, rows, left_by_all, strict=False):
        axes.plot(
            shown.input[kept][every],
            left[every],
            ".",
            color=canvas.BLUE,
            markersize=2.2,
            markeredgewidth=0,
            alpha=0.5,
            rasterized=True,
        )
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        canvas.dress(axes, _marked(row, comparison), "", "")
        canvas.note_outside(axes, left)
    for axes in panels.flat[len(rows) :]:
        axes.set_visible(False)
    figure.supxlabel(canvas.plain(task.input.label), fontsize=10, color=canvas.INK)
    label = f"measured − model{task.output.in_parentheses}"
    figure.supylabel(canvas.plain(label), fontsize=10, color=canvas.INK)
    return figure


def _marked(row: mh.results.ComparedModel, comparison: mh.results.Comparison) -> str:
    return f"{row.model} *" if row.model == comparison.simplest else row.model
