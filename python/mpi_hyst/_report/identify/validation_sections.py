"""Sections on validation: loops left out, uncertainty of the output, cross-validation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.identify import validation_figures
from mpi_hyst._report.identify.choices import ERROR, Choice
from mpi_hyst._report.identify.records import Task, told_as_a_finding
from mpi_hyst._report.identify.summary import pooled
from mpi_hyst._report.page import Figure, Section, Table
from mpi_hyst._text import digits, in_unit

_ROWS = 60


def left_out(loops: Sequence[mh.results.LeftOutLoop], task: Task) -> Section:
    """Show how well each loop is predicted by a fit to the others."""
    unit, of_input = task.output.in_parentheses, task.input.in_parentheses
    fitted, left = pooled(loops)
    rows = [
        [
            f"{number} of {task.records.names[row.record]}",
            str(row.stop - row.start),
            digits(row.amplitude),
            digits(row.fitted.rmse, 3),
            digits(row.left_out.rmse, 3),
            digits(row.fitted.max_error, 3),
            digits(row.left_out.max_error, 3),
        ]
        for number, row in enumerate(loops, 1)
    ]
    table = Table(
        "Every loop: fitted, and predicted from the others",
        [
            "loop",
            "samples",
            f"amplitude{of_input}",
            f"rms fitted{unit}",
            f"rms left out{unit}",
            f"max fitted{unit}",
            f"max left out{unit}",
        ],
        rows[:_ROWS],
        f"The first {_ROWS} of {len(rows)}." if len(rows) > _ROWS else "",
    )
    shown = task.output.unit
    return Section(
        "left-out",
        "Loops left out",
        [
            "A loop reaches from one maximum of the input to the next. Each is predicted with "
            "weights fitted to all others; all other parameters stay. Over all loops "
            f"the rms error is {in_unit(fitted, shown, 3)} fitted and {in_unit(left, shown, 3)} "
            "predicted. A loop that is fitted well but predicted badly is unlike all others.",
        ],
        [
            Figure(
                canvas.data_uri(validation_figures.left_out(loops, task.output)),
                "Rms error of every loop, fitted and predicted",
                "A line joins the two errors of the same loop.",
            ),
            table,
        ],
    )


def uncertainty(
    found: mh.results.Identification, traces: Sequence[plots.Trace], task: Task
) -> Section:
    """Show the standard deviation of the prediction."""
    unit = task.output.unit
    with told_as_a_finding():
        deviations = [found.predict(trace.input, return_std=True)[1] for trace in traces]
    largest = max(
        float(std[trace.skip :].max()) for std, trace in zip(deviations, traces, strict=True)
    )
    mean = float(np.sqrt(np.mean(np.square(deviations[0][traces[0].skip :]))))
    return Section(
        "uncertainty",
        "Uncertainty of the output",
        [
            "The standard deviation of the prediction follows from the covariance of all fitted "
            f"parameters. It is {in_unit(mean, unit, 3)} rms on "
            f"{traces[0].name} and at most {in_unit(largest, unit, 3)} on the records shown. It "
            "assumes that the model is right and that the errors of successive samples are "
            "independent. If the residuals above depend on input, rate or time, the error may be "
            "larger. Measurement noise is not included. Weights at zero count as known.",
        ],
        [
            Figure(
                canvas.data_uri(validation_figures.deviation(trace, std)),
                f"Uncertainty of the prediction of {trace.name}",
                f"{trace.name}: the band is ± 1.96 standard deviations of the prediction.",
            )
            for trace, std in zip(traces, deviations, strict=True)
        ],
    )


def chosen(made: Sequence[Choice], task: Task) -> Section:
    """Show the choices of cross-validation and the errors of all candidates."""
    header = f"error{task.output.in_parentheses}"
    return Section(
        "chosen",
        "Chosen by cross-validation",
        [
            "Folds of the records were held out in turn and predicted from fits to the others.",
            f"{ERROR[0].upper()}{ERROR[1:]}.",
            *(f"{choice.sentence[0].upper()}{choice.sentence[1:]}." for choice in made),
        ],
        [
            Table(
                f"Prediction of held-out folds: {choice.header}",
                [choice.header, header],
                choice.rows,
                best=choice.best,
            )
            for choice in made
        ],
    )
