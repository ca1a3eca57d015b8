"""A stage of several axes, for the terminal and as a page: what was tried, what is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mpi_hyst._core import AxesIdentification
from mpi_hyst._report import canvas
from mpi_hyst._report.page import (
    MEANINGS,
    Card,
    Provenance,
    Rows,
    Verdict,
    findings_table,
    render,
    verdict_lines,
)
from mpi_hyst._text import digits, text_pairs
from mpi_hyst._types import Matrix

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = 2000  # samples of a figure


@dataclass(frozen=True)
class Record:
    """Drives and positions of a file, rows of samples."""

    name: str
    u: Matrix
    y: Matrix


@dataclass(frozen=True)
class Found:
    """What was found, from which records, with the names of their columns."""

    found: AxesIdentification
    records: Sequence[Record]
    drives: Sequence[str]
    positions: Sequence[str]
    skip: int


def _share(result: Found) -> float:
    """Return the mean error of samples that were not fitted, over the standard deviations."""
    found = result.found
    return float(np.mean(found.held_out_errors / found.deviations))


def facts(result: Found) -> list[tuple[str, str]]:
    """Return what was found as names and values."""
    found, model = result.found, result.found.model
    where = {"none": "", "in_front": " in front of the dynamics", "inside": " inside the dynamics"}
    return [
        ("records", ", ".join(one.name for one in result.records)),
        ("drives", ", ".join(result.drives)),
        ("positions", ", ".join(result.positions)),
        ("states", str(len(model.a))),
        ("hysteresis", f"{found.hysteresis}{where[found.place]}"),
        ("sampling interval", f"{digits(model.dt)} s"),
        ("held out", f"{100.0 * _share(result):.3g} % of the standard deviation, on average"),
    ]


def errors(result: Found) -> Rows:
    """Return the errors of each position as a table."""
    found = result.found
    columns = (found.errors, found.held_out_errors, found.linear_errors, found.deviations)
    rows = [
        [name, *(digits(float(column[i])) for column in columns)]
        for i, name in enumerate(result.positions)
    ]
    header = ["position", "error rms", "held out", "linear, held out", "standard deviation"]
    return header, rows


def tried(result: Found) -> Rows:
    """Return what was tried as a table: errors in % of the standard deviation."""
    rows = [
        [
            str(one["name"]),
            str(one["states"]),
            str(one["parameters"]),
            f"{one['fitted']:.3f}",
            f"{one['held_out']:.3f}",
            "yes" if one["chosen"] else "",
        ]
        for one in result.found.tried
    ]
    return ["model", "states", "parameters", "fitted, %", "held out, %", "chosen"], rows


def summary(result: Found) -> str:
    """Return what the terminal shows."""
    found = result.found
    lines = verdict_lines(found.verdict, found.warnings)
    return "\n".join([text_pairs(facts(result)), found.summary().rstrip(), *lines])


def report(result: Found, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    found = result.found
    cards = [
        Card(f"{100.0 * _share(result):.2g} %", "error held out", "of the standard deviation"),
        Card(found.hysteresis, "hysteresis", found.place.replace("_", " ")),
        Card(str(len(found.model.a)), "states", f"{len(result.drives)} drives"),
    ]
    return render(
        "axes.html.j2",
        cards=cards,
        verdict=Verdict(
            found.verdict, MEANINGS[found.verdict], [one.message for one in found.warnings]
        ),
        provenance=provenance,
        result=result,
        facts=facts(result),
        findings=findings_table(found.warnings),
        errors=errors(result),
        tried=tried(result),
        record=figure(result),
    )


def figure(result: Found) -> Figure:
    """Draw the positions of the first record behind what is skipped, and what the model misses."""
    record, model = result.records[0], result.found.model
    modelled = model.forward().run(record.u)
    part = slice(result.skip, result.skip + _SHOWN)
    time = 1e3 * model.dt * np.arange(len(record.u))[part]
    drawn = canvas.new_figure(2.2 * len(result.positions) + 0.6)
    panels = drawn.subplots(len(result.positions), 2, squeeze=False, sharex=True)
    for i, (name, (left, right)) in enumerate(zip(result.positions, panels, strict=True)):
        canvas.dress(left, name, "time (ms)", "measured")
        canvas.line(left, time, record.y[part, i])
        canvas.dress(right, f"{name}: measured less model", "time (ms)", "missed")
        canvas.line(right, time, (record.y - modelled)[part, i])
    return drawn
