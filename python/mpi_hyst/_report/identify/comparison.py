"""The section on the comparison of models."""

from __future__ import annotations

import mpi_hyst as mh
from mpi_hyst._report import canvas
from mpi_hyst._report.identify import comparison_figures
from mpi_hyst._report.identify.records import Task
from mpi_hyst._report.page import Figure, Section, Table
from mpi_hyst._text import digits, in_unit


def section(comparison: mh.results.Comparison, task: Task, shown: int) -> Section:
    """Show the errors of every model; its residuals for the first `shown` records."""
    text = [
        "Every model is fitted to the same samples and judged in the same way. Each record is cut "
        "into stretches, and each stretch is predicted from a fit to the others. A model that "
        "fits well but predicts badly has more unknowns than the records can tell. "
        f"The simplest model that predicts as well as the best is: {comparison.simplest} (marked "
        "with *).",
        "Polynomial + plays: square and cube of the drive beside the plays. It has no exact "
        "inverse here and is for comparison only.",
    ]
    if comparison.creep_under_way:
        text.append(
            "All models have the creep that was under way where the start of a record is skipped."
        )
    text += [f"Not tried: {name}: {reason}." for name, reason in comparison.omitted.items()]
    residuals = [
        Figure(
            canvas.data_uri(comparison_figures.residuals(comparison, task, place)),
            f"Residuals of every model on {record.name} over the drive",
            f"{record.name}: measured minus modelled, fitted to all stretches.",
        )
        for place, record in enumerate(task.records.fitted[:shown])
    ]
    bars = Figure(
        canvas.data_uri(comparison_figures.errors(comparison, task)),
        "Rms error of every model: fitted, held out, worst stretch",
        "Held out: over all stretches, each predicted from the others. Worst stretch: the largest "
        "of these errors.",
    )
    return Section(
        "comparison", "Comparison of models", text, [_table(comparison, task), bars, *residuals]
    )


def _table(comparison: mh.results.Comparison, task: Task) -> Table:
    rows = comparison.rows
    of_unit = task.output.in_parentheses
    errors = ("rms fitted", "rms held out", "worst stretch")
    return Table(
        "What each model buys",
        [
            *("model", "weights", "unknowns", *(f"{name}{of_unit}" for name in errors)),
            *(f"{name} (%)" for name in errors),
            "extensions kept",
        ],
        [_cells(row) for row in rows],
        f"%: of the range, {in_unit(rows[0].fit.range, task.output.unit)}, the peak-to-peak of the "
        "measured output. Extensions are kept as cross-validation asks for, unless given.",
        [place for place, row in enumerate(rows) if row.model == comparison.simplest],
    )


def _cells(row: mh.results.ComparedModel) -> list[str]:
    percents = (row.fit.rmse_percent, row.held_out_percent, row.worst_stretch_percent)
    return [
        *(row.model, row.weights_law, str(row.unknowns)),
        *(digits(error) for error in (row.fit.rmse, row.held_out, row.worst_stretch)),
        *(f"{percent:.3f}" for percent in percents),
        ", ".join(row.kept) or ("none" if "modified +" in row.model else ""),
    ]
