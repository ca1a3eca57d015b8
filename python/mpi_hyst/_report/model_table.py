"""The weights and thresholds of a model as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._report.page import Table
from mpi_hyst._text import NOT_DETERMINED, determined, digits

_ROWS = 60


def model_table(
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii,
    weight_unit: str,
    input_unit: str,
    standard_errors: Sequence[Sequence[float]] = (),
) -> Table:
    """List the weights and thresholds of a model; of a split model both weights."""
    columns: list[tuple[str, list[str]]] = []
    for (name, weights), std in zip(
        _families(model), [*standard_errors, *([[]] * 2)], strict=False
    ):
        columns.append((f"{name}{_of(weight_unit)}", [digits(value, 5) for value in weights]))
        if std:
            errors = map(_error, weights, std, [sum(weights)] * len(std))
            columns.append(("± std", list(errors)))
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


def _error(weight: float, std: float, scale: float) -> str:
    """Format a standard error; one beyond the sum of all weights says nothing."""
    if not determined(weight, std, scale=scale):
        return NOT_DETERMINED
    return "bound" if math.isnan(std) else digits(std, 2)


def _of(unit: str) -> str:
    return f" ({unit})" if unit else ""
