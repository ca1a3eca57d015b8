"""The report of an identification."""

from __future__ import annotations

from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.identify import comparison as comparison_section
from mpi_hyst._report.identify import findings
from mpi_hyst._report.identify.choices import choices
from mpi_hyst._report.identify.records import Evaluated, Task, evaluate
from mpi_hyst._report.identify.sections import (
    Result,
    base,
    errors,
    loops,
    model,
    own_loops,
    residuals,
    short_name,
    shown_names,
)
from mpi_hyst._report.identify.summary import title, value_of_dead_time
from mpi_hyst._report.identify.validation_sections import chosen, uncertainty
from mpi_hyst._report.identify.validation_sections import left_out as left_out_section
from mpi_hyst._report.page import Card, Report, render
from mpi_hyst._report.provenance import Provenance
from mpi_hyst._text import in_unit

_SHOWN = 3  # records with their own figures; the tables have all


def report(
    task: Task,
    found: mh.results.Identification,
    compared: mh.results.Identification | None,
    left_out: Sequence[mh.results.LeftOutLoop],
    comparison: mh.results.Comparison | None = None,
    provenance: Provenance = (),
) -> str:
    """Return the HTML text. `compared` is the other kind of model, to show beside the fit."""
    records, result = task.records, Result(task, found, compared)
    fitted, held_out = _traces(result) if records.known else ([], [])
    sections = [
        loops(fitted, len(records.fitted)) if records.known else own_loops(result),
        errors(result),
        findings.section(found.warnings, records),
    ]
    if comparison is not None:
        sections.insert(2, comparison_section.section(comparison, task, _SHOWN))
    if records.known:
        sections.append(residuals(fitted, held_out))
    if left_out:
        sections.append(left_out_section(left_out, task))
    # The deviation is known for the sampling of the first record.
    alike = [
        trace
        for trace, record in zip(fitted, records.fitted, strict=False)
        if record.dt == records.dt
    ]
    if alike:
        sections.append(uncertainty(found, alike, task))
    if made := choices(found):
        sections.append(chosen(made, task))
    sections.append(model(result))
    return render(
        Report(
            title=f"Hysteresis of {shown_names(records, _SHOWN)}"
            f"{' (partial)' if found.partial else ''}",
            subtitle=f"{title(found, len(records.fitted))}, "
            f"{task.input.label} to {task.output.label}",
            verdict=findings.banner(found, records),
            cards=_cards(result),
            sections=sections,
            provenance=provenance,
            footer=f"Error: measured minus modelled output. {base(records)}",
        )
    )


def _traces(result: Result) -> tuple[list[plots.Trace], list[plots.Trace]]:
    fitted, held_out = evaluate(result.task.records, result.found)
    beside: tuple[Sequence[Evaluated], Sequence[Evaluated]] = ([], [])
    if result.compared is not None:
        beside = evaluate(result.task.records, result.compared)
    return (
        [_trace(place, one, beside[0], result) for place, one in enumerate(fitted[:_SHOWN])],
        [_trace(place, one, beside[1], result) for place, one in enumerate(held_out[:_SHOWN])],
    )


def _trace(
    place: int, evaluated: Evaluated, compared: Sequence[Evaluated], result: Result
) -> plots.Trace:
    record = evaluated.record
    # The requested model is drawn last and so on top.
    curves = [
        plots.Curve(short_name(fit), colour, record.output - one.residuals(fit))
        for fit, colour, one in (
            (result.compared, canvas.ORANGE, compared[place] if compared else evaluated),
            (result.found, canvas.BLUE, evaluated),
        )
        if fit is not None
    ]
    return plots.Trace(
        record.name,
        record.input,
        record.output,
        record.seconds,
        record.skip,
        curves,
        result.task.input,
        result.task.output,
    )


def _cards(result: Result) -> list[Card]:
    found, compared, task = result.found, result.compared, result.task
    unit = task.output.unit
    cards = [
        Card(
            in_unit(found.fit.rmse, unit, 3),
            "rms error",
            f"{found.fit.rmse_percent:.3f} % of range",
        ),
        Card(
            in_unit(found.fit.max_error, unit, 3),
            "largest error",
            f"{found.fit.max_error_percent:.3f} % of range",
        ),
    ]
    if found.validation is not None:
        cards.append(
            Card(
                in_unit(found.validation.rmse, unit, 3),
                "rms error, validation",
                f"{found.validation.rmse_percent:.3f} % of range",
            )
        )
    if compared is not None:
        cards.append(
            Card(
                in_unit(compared.fit.rmse, unit, 3),
                f"rms error, {short_name(compared)}",
                "fitted to the same samples",
            )
        )
    cards.append(Card(value_of_dead_time(found), "dead time"))
    return cards
