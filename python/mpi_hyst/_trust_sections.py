"""Sections and tables that say how far to trust a model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import mpi_hyst as mh
from mpi_hyst import _plots, _trust_plots
from mpi_hyst._identify_records import Records
from mpi_hyst._identify_request import Request
from mpi_hyst._identify_summary import pooled
from mpi_hyst._report import Figure, Section, Table
from mpi_hyst._tables import digits, in_unit

_ROWS = 60


def left_out(loops: Sequence[mh.LeftOutLoop], records: Records, request: Request) -> Section:
    """Tell how every loop is predicted by weights that have not seen it."""
    unit, of_input = _of(request.output.shown_unit), _of(request.input.shown_unit)
    fitted, left = pooled(loops)
    rows = [
        [
            f"{number} of {records.names[row.record]}",
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
    shown = request.output.shown_unit
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
                _plots.data_uri(_trust_plots.left_out(loops, request.output)),
                "Rms error of every loop, fitted and left out",
                "A line joins what the same loop has when it is fitted and when it is left out.",
            ),
            table,
        ],
    )


def uncertainty(
    found: mh.Identification, traces: Sequence[_plots.Trace], request: Request
) -> Section:
    """Show the standard deviation of the prediction on the records shown."""
    unit = request.output.shown_unit
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
                _plots.data_uri(_trust_plots.deviation(trace, std)),
                f"Residual and uncertainty of the prediction of {trace.name}",
                f"{trace.name}: the band is ± 1.96 standard deviations of the prediction.",
            )
            for trace, std in zip(traces, deviations, strict=True)
        ],
    )


def operators(found: mh.Identification, request: Request) -> Section:
    """Tell what cross-validation said of every number of operators."""
    counts = [count for count, _ in found.cross_validation]
    chosen = found.model.operators
    return Section(
        "operators",
        "The number of operators",
        [
            f"Cross-validation over stretches of the records chose {chosen} operators: the fewest "
            "whose mean square error is within one standard error of the least.",
        ],
        [
            Table(
                "Prediction of stretches that were held out",
                ["operators", f"rms{_of(request.output.shown_unit)}"],
                [[str(count), digits(rmse)] for count, rmse in found.cross_validation],
                best=[counts.index(chosen)] if chosen in counts else [],
            )
        ],
    )


def bank_table(
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii,
    weight_unit: str,
    input_unit: str,
    standard_errors: Sequence[Sequence[float]] = (),
) -> Table:
    """List the weights and thresholds of a model, both weights if they are split."""
    columns: list[tuple[str, list[str]]] = []
    for (name, weights), std in zip(
        _families(model), [*standard_errors, *([[]] * 2)], strict=False
    ):
        columns.append((f"{name}{_of(weight_unit)}", [digits(value, 5) for value in weights]))
        if std:
            columns.append(("± std", [_error(value) for value in std]))
    modified = isinstance(model, mh.ModifiedPrandtlIshlinskii)
    for name in ["r", "ra", "rb", "rc"] if modified else ["thresholds"]:
        values = [digits(value, 5) for value in getattr(model, name).tolist()]
        columns.append((f"{'r' if name == 'thresholds' else name}{_of(input_unit)}", values))
    rows = [list(cells) for cells in zip(*(cells for _, cells in columns), strict=True)]
    note = f"The first {_ROWS} of {len(rows)}; the model file has all." if len(rows) > _ROWS else ""
    if standard_errors:
        note = f"A weight at its bound, zero, has no standard error. {note}".rstrip()
    return Table(
        "Weights and thresholds",
        ["operator", *(name for name, _ in columns)],
        [[str(index), *cells] for index, cells in enumerate(rows[:_ROWS])],
        note,
    )


def _families(
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii,
) -> list[tuple[str, list[float]]]:
    if isinstance(model, mh.ModifiedPrandtlIshlinskii) and model.split:
        return [("w", model.weights.tolist()), ("v", model.weights_negative.tolist())]
    return [("w", model.weights.tolist())]


def _error(std: float) -> str:
    return "bound" if math.isnan(std) else digits(std, 2)


def _of(unit: str) -> str:
    return f" ({unit})" if unit else ""
