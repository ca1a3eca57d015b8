"""Sections and tables that say how far to trust a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.identify import validation_figures
from mpi_hyst._report.identify.choices import Choice
from mpi_hyst._report.identify.records import Task
from mpi_hyst._report.identify.summary import pooled
from mpi_hyst._report.page import Figure, Section, Table
from mpi_hyst._text import digits, in_unit

_ROWS = 60


def left_out(loops: Sequence[mh.results.LeftOutLoop], task: Task) -> Section:
    """Tell how every loop is predicted by weights that have not seen it."""
    unit, of_input = _of(task.output.shown_unit), _of(task.input.shown_unit)
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
        "Every loop, fitted with all and predicted from the others",
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
    shown = task.output.shown_unit
    return Section(
        "left-out",
        "Loops left out",
        [
            "Each loop, from one maximum of the input to the next, is predicted by weights fitted "
            "to all others; thresholds, offset and delay stay. All loops together are fitted to "
            f"{in_unit(fitted, shown, 3)} rms and predicted to {in_unit(left, shown, 3)}. A loop "
            "that is fitted well and predicted badly is one that nothing else in the records is "
            "like.",
        ],
        [
            Figure(
                canvas.data_uri(validation_figures.left_out(loops, task.output)),
                "Rms error of every loop, fitted and left out",
                "A line joins what the same loop has when it is fitted and when it is left out.",
            ),
            table,
        ],
    )


def uncertainty(
    found: mh.results.Identification, traces: Sequence[plots.Trace], task: Task
) -> Section:
    """Show the standard deviation of the prediction on the records shown."""
    unit = task.output.shown_unit
    deviations = [found.predict(trace.input, return_std=True)[1] for trace in traces]
    largest = max(
        float(std[trace.skip :].max()) for std, trace in zip(deviations, traces, strict=True)
    )
    mean = float(np.sqrt(np.mean(np.square(deviations[0][traces[0].skip :]))))
    return Section(
        "uncertainty",
        "Uncertainty of the output",
        [
            "How far the prediction may be from that of the true parameters, from the covariance "
            "of weights, ratios, offsets and delay: one standard deviation, "
            f"{in_unit(mean, unit, 3)} rms on {traces[0].name} and at most "
            f"{in_unit(largest, unit, 3)} on the records shown. It takes the errors of successive "
            "samples for independent and the model for true: where the residuals above follow "
            "input, speed or time, the truth may be further away. The noise of a measurement "
            "comes on top. Weights at zero count as known.",
        ],
        [
            Figure(
                canvas.data_uri(validation_figures.deviation(trace, std)),
                f"Residual and uncertainty of the prediction of {trace.name}",
                f"{trace.name}: the band is ± 1.96 standard deviations of the prediction.",
            )
            for trace, std in zip(traces, deviations, strict=True)
        ],
    )


def chosen(made: Sequence[Choice], task: Task) -> Section:
    """Tell what cross-validation chose, and what it said of every candidate."""
    header = f"rms{_of(task.output.shown_unit)}"
    return Section(
        "chosen",
        "Chosen by cross-validation",
        [
            "Stretches of the records were held out in turn, and predicted from fits to the "
            "others.",
            *(f"{choice.said[0].upper()}{choice.said[1:]}." for choice in made),
        ],
        [
            Table(
                f"Prediction of held-out stretches: {choice.header}",
                [choice.header, header],
                choice.rows,
                best=choice.best,
            )
            for choice in made
        ],
    )


def _of(unit: str) -> str:
    return f" ({unit})" if unit else ""
