"""The report of an identification: its tables and figures, for `identify.html.j2`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpi_hyst._core import (
    ComparedModel,
    Comparison,
    Identification,
    LeftOutLoop,
    ModifiedPrandtlIshlinskii,
    Quality,
)
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, models, traces
from mpi_hyst._report.models import default_drive, model_table, run
from mpi_hyst._report.page import Card, Provenance, Rows, Table, hashed_stage, made_with, render
from mpi_hyst._report.records import (
    Evaluated,
    Records,
    Task,
    evaluate,
    loops_left_out,
    told_as_a_finding,
)
from mpi_hyst._report.summary import (
    ERROR,
    TRIED,
    choices,
    findings_rows,
    has_plays,
    parameters,
    pooled,
    terms_tried,
    title,
    value_of_dead_time,
    verdict_banner,
)
from mpi_hyst._text import digits, in_unit

_SHOWN = 3  # records with their own figures; the tables have all
_ROWS = 60  # loops in the table of those left out
_COLUMNS = 4  # panels side by side
_BAR = 0.38  # of the distance between two models
_FEWEST = 3  # models that the figure has room for at least


@dataclass(frozen=True)
class Result:
    """A fit, and the fit of the other kind of model if there is one."""

    task: Task
    found: Identification
    compared: Identification | None

    @property
    def fits(self) -> list[Identification]:
        """All fits; the requested one is last."""
        return [self.found] if self.compared is None else [self.compared, self.found]


def report(
    task: Task,
    found: Identification,
    compared: Identification | None,
    left_out: Sequence[LeftOutLoop],
    comparison: Comparison | None = None,
    provenance: Provenance = (),
) -> str:
    """Return the HTML text. `compared` is the other kind of model, to show beside the fit."""
    records, result = task.records, Result(task, found, compared)
    fitted, held_out = _traces(result) if records.known else ([], [])
    errors = {"Fit errors": _errors(result, held_out=False)}
    if found.validation is not None:
        errors["Validation errors"] = _errors(result, held_out=True)
    named = ((fitted, "fitted"), (held_out, "validation"))
    # The deviation is known for the sampling of the first record.
    pairs = zip(fitted, records.fitted, strict=False)
    alike = [trace for trace, record in pairs if record.dt == records.dt]
    return render(
        "identify.html.j2",
        verdict=verdict_banner(found, records),
        cards=_cards(result),
        provenance=provenance,
        task=task,
        found=found,
        compared=compared,
        short_name=short_name,
        shown=_SHOWN,
        fit=title(found, len(records.fitted)),
        base=_base(records),
        fitted=fitted,
        loops=traces.loops(fitted or [_own_loops(result)]),
        errors=errors,
        gain=_gain(found, compared),
        loop_widths=_loop_widths(result),
        **_compared(comparison, task),
        findings=findings_rows(found, records),
        assumed=records.assumed,
        residuals=[
            (trace.name, what, traces.residuals(trace)) for drawn, what in named for trace in drawn
        ],
        left_out=_left_out(left_out, task) if left_out else None,
        uncertainty=_uncertainty(found, alike) if alike else None,
        choices=choices(found),
        terms_tried=(TRIED, tried) if (tried := terms_tried(found)) else None,
        error=ERROR,
        **_model(result),
    )


def report_of_arrays(
    found: Identification,
    given: Records,
    quantities: tuple[Quantity, Quantity],
    beside: Identification | None,
) -> str:
    """Return the HTML text."""
    left_out: Sequence[LeftOutLoop] = []
    data = []
    if given.known:
        left_out = loops_left_out(given, found)
        every = [*given.fitted, *given.held_out]
        data = [(f"{one.name}, u and y as float64", one.sha256) for one in every]
    stage = hashed_stage(found.stage)
    made = made_with("mpi_hyst.reports.identification in Python", data, stage)
    return report(Task(given, *quantities), found, beside, left_out, provenance=made)


def short_name(found: Identification) -> str:
    """Return the kind of model, for a legend."""
    if not isinstance(found.model, ModifiedPrandtlIshlinskii):
        return "conventional (plays)"
    return "modified (plays)" if has_plays(found) else "modified (coupled plays)"


def _base(records: Records) -> str:
    """Return the base of the percentages."""
    text = "% of range: the range is the peak-to-peak of the measured output over the same samples"
    several = max(len(records.fitted), len(records.held_out)) > 1
    return f"{text}{'; for all records, the largest' if several else ''}."


def _cards(result: Result) -> list[Card]:
    found, compared, unit = result.found, result.compared, result.task.output.unit

    def card(value: float, what: str, percent: float) -> Card:
        return Card(in_unit(value, unit, 3), what, f"{percent:.3f} % of range")

    cards = [
        card(found.fit.rmse, "rms error", found.fit.rmse_percent),
        card(found.fit.max_error, "largest error", found.fit.max_error_percent),
    ]
    if (unseen := found.validation) is not None:
        cards.append(card(unseen.rmse, "rms error, validation", unseen.rmse_percent))
    if compared is not None:
        what = f"rms error, {short_name(compared)}"
        cards.append(Card(in_unit(compared.fit.rmse, unit, 3), what, "fitted to the same samples"))
    return [*cards, Card(value_of_dead_time(found), "dead time")]


def _gain(found: Identification, compared: Identification | None) -> float | None:
    """Return how many times the rms error the other model has."""
    if compared is None:
        return None
    return compared.fit.rmse / found.fit.rmse if found.fit.rmse > 0.0 else float("inf")


def _traces(result: Result) -> tuple[list[traces.Trace], list[traces.Trace]]:
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
) -> traces.Trace:
    record = evaluated.record
    # The requested model is drawn last and so on top.
    curves = [
        traces.Curve(short_name(fit), colour, record.output - one.residuals(fit))
        for fit, colour, one in (
            (result.compared, canvas.ORANGE, compared[place] if compared else evaluated),
            (result.found, canvas.BLUE, evaluated),
        )
        if fit is not None
    ]
    samples = (record.input, record.output, record.seconds, record.skip)
    return traces.Trace(record.name, *samples, curves, result.task.input, result.task.output)


def _own_loops(result: Result) -> traces.Trace:
    """Return the loops of the model alone, where its records are not at hand."""
    drive = default_drive(result.found)
    fits = zip(result.fits, (canvas.ORANGE, canvas.BLUE)[-len(result.fits) :], strict=True)
    curves = [
        traces.Curve(short_name(fit), colour, run(fit.model, drive, None)) for fit, colour in fits
    ]
    empty = (drive, np.empty(0), None, 0)
    return traces.Trace("loops of the model", *empty, curves, result.task.input, result.task.output)


def _errors(result: Result, *, held_out: bool) -> tuple[Rows, list[int]]:
    """Return the errors of all fits, and which rows are those of the requested one."""
    rows: list[list[str]] = []
    best = []
    for fit in result.fits:
        evaluated = evaluate(result.task.records, fit)[held_out]
        entries = [(one.record.name, one.quality) for one in evaluated]
        total = fit.validation if held_out else fit.fit
        if len(entries) != 1 and total is not None:
            entries.append(("all records", total))
        for name, quality in entries:
            if fit is result.found:
                best.append(len(rows))
            kind = short_name(fit).split(" ")[0]
            rows.append([name, kind, str(quality.samples), *_error_cells(quality)])
    unit = result.task.output.in_parentheses
    errors = (f"max{unit}", f"rms{unit}", "max (%)", "rms (%)", "NRMSE", f"range{unit}")
    return (["record", "model", "samples", *errors], rows), best


def _error_cells(quality: Quality) -> list[str]:
    return [
        *(digits(quality.max_error, 3), digits(quality.rmse, 3)),
        *(f"{quality.max_error_percent:.3f}", f"{quality.rmse_percent:.3f}"),
        *(digits(quality.nrmse, 3), digits(quality.range, 4)),
    ]


def _loop_widths(result: Result) -> Rows:
    """Compare the loop width for records that have full strokes."""
    rows = []
    fitted, held_out = evaluate(result.task.records, result.found)
    for one, what in [*((one, "") for one in fitted), *((one, "validation: ") for one in held_out)]:
        rows += _loop_width(one, what)
    unit = result.task.output.in_parentheses
    return ["record", f"measured{unit}", f"modelled{unit}", f"error{unit}", "error (%)"], rows


def _loop_width(evaluated: Evaluated, what: str) -> list[list[str]]:
    width, error = evaluated.quality.loop_width, evaluated.quality.loop_width_error
    if width is None or error is None:
        return []
    percent = digits(100.0 * error / width, 3) if width > 0.0 else ""
    name = f"{what}{evaluated.record.name}"
    return [[name, digits(width), digits(width + error), digits(error, 3), percent]]


def _model(result: Result) -> dict[str, Any]:
    """Return weights, thresholds and parameters."""
    found, compared, task = result.found, result.compared, result.task
    slope = f"{task.output.unit}/{task.input.unit}"
    weight_unit = slope if task.output.unit and task.input.unit else ""
    banks = [models.Bank(short_name(found), canvas.BLUE, found.model, found=found)]
    if compared is not None:
        banks.append(models.Bank(short_name(compared), canvas.ORANGE, compared.model, "s"))
    pairs = [("operators", str(found.model.operators)), *parameters(task, found)]
    for record, offset in zip(task.records.fitted, found.output_offsets, strict=True):
        value = in_unit(float(offset), task.output.unit)
        pairs.append((f"output offset of {record.name}", value))
    std = [found.weights_std.tolist(), found.weights_negative_std.tolist()]
    return {
        "weight_unit": weight_unit,
        "weights": models.weights_figure(banks, weight_unit, task.input.unit),
        "parameters": pairs,
        "model_table": model_table(found.model, weight_unit, task.input.unit, std),
    }


def _compared(comparison: Comparison | None, task: Task) -> dict[str, Any]:
    """Return the errors of every model, and its residuals for the first records."""
    if comparison is None:
        return {"comparison": None}
    of_unit = task.output.in_parentheses
    errors = ("rms fitted", "rms held out", "worst stretch")
    header = ["model", "weights", "unknowns", *(f"{name}{of_unit}" for name in errors)]
    header += [*(f"{name} (%)" for name in errors), "extensions kept"]
    names = task.records.names[:_SHOWN]
    return {
        "comparison": comparison,
        "compared_rows": (header, [_compared_cells(row) for row in comparison.rows]),
        "compared_best": [
            place for place, row in enumerate(comparison.rows) if row.model == comparison.simplest
        ],
        "compared_errors": _compared_errors(comparison, task),
        "compared_residuals": [
            (name, _compared_residuals(comparison, task, place)) for place, name in enumerate(names)
        ],
    }


def _compared_cells(row: ComparedModel) -> list[str]:
    percents = (row.fit.rmse_percent, row.held_out_percent, row.worst_stretch_percent)
    return [
        *(row.model, row.weights_law, str(row.unknowns)),
        *(digits(error) for error in (row.fit.rmse, row.held_out, row.worst_stretch)),
        *(f"{percent:.3f}" for percent in percents),
        ", ".join(row.kept) or ("none" if "modified +" in row.model else ""),
    ]


def _compared_errors(comparison: Comparison, task: Task) -> canvas.Figure:
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


def _compared_residuals(comparison: Comparison, task: Task, record: int) -> canvas.Figure:
    """Draw the residuals of every model over the drive, all on one scale."""
    rows, shown = comparison.rows, task.records.fitted[record]
    lines = -(-len(rows) // _COLUMNS)
    columns = min(len(rows), _COLUMNS)
    figure = canvas.new_figure(0.5 + 2.3 * lines)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    kept = slice(shown.skip, None)
    left_by_all = [row.residuals(shown.input, shown.output, record=record)[kept] for row in rows]
    extent = canvas.extent(*left_by_all)
    panels[0, 0].set_ylim(-extent, extent)
    for axes, row, left in zip(panels.flat, rows, left_by_all, strict=False):
        dots: dict[str, Any] = {"color": canvas.BLUE, "alpha": 0.5}
        canvas.cloud(axes, shown.input[kept], left, 2.2, traces.CLOUD_POINTS, **dots)
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        canvas.dress(axes, _marked(row, comparison), "", "")
        canvas.note_outside(axes, left)
    for axes in panels.flat[len(rows) :]:
        axes.set_visible(False)
    figure.supxlabel(canvas.plain(task.input.label), fontsize=10, color=canvas.INK)
    label = f"measured − model{task.output.in_parentheses}"
    figure.supylabel(canvas.plain(label), fontsize=10, color=canvas.INK)
    return figure


def _marked(row: ComparedModel, comparison: Comparison) -> str:
    return f"{row.model} *" if row.model == comparison.simplest else row.model


def _left_out(loops: Sequence[LeftOutLoop], task: Task) -> dict[str, Any]:
    """Return how well each loop is predicted by a fit to the others."""
    unit, of_input = task.output.in_parentheses, task.input.in_parentheses
    fitted, predicted = pooled(loops)
    errors = [
        f"{what}{unit}" for what in ("rms fitted", "rms left out", "max fitted", "max left out")
    ]
    rows = []
    for number, row in enumerate(loops, 1):
        one, other = row.fitted, row.left_out
        values = (one.rmse, other.rmse, one.max_error, other.max_error)
        cells = (str(row.stop - row.start), digits(row.amplitude), *(digits(v, 3) for v in values))
        rows.append([f"{number} of {task.records.names[row.record]}", *cells])
    table = Table(
        "Every loop: fitted, and predicted from the others",
        ["loop", "samples", f"amplitude{of_input}", *errors],
        rows[:_ROWS],
        f"The first {_ROWS} of {len(rows)}." if len(rows) > _ROWS else "",
    )
    drawn = _left_out_figure(loops, task.output)
    return {"fitted": fitted, "predicted": predicted, "table": table, "drawn": drawn}


def _left_out_figure(loops: Sequence[LeftOutLoop], output_quantity: Quantity) -> canvas.Figure:
    """Draw the rms error of every loop in the order of the records, fitted and predicted."""
    from matplotlib.ticker import MaxNLocator

    figure = canvas.new_figure(3.2)
    axes = figure.subplots()
    number = np.arange(1, len(loops) + 1)
    fitted = [row.fitted.rmse for row in loops]
    left = [row.left_out.rmse for row in loops]
    axes.vlines(number, fitted, left, color=canvas.MEASURED, linewidth=1.0)
    axes.plot(number, fitted, "o", color=canvas.BLUE, markersize=4.5, label="fitted")
    axes.plot(
        number, left, "D", color=canvas.ORANGE, markersize=4.0, label="predicted from the others"
    )
    axes.set_ylim(0.0, 1.12 * max(*fitted, *left) or 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    canvas.dress(
        axes, "rms error of every loop", "loop", f"rms error{output_quantity.in_parentheses}"
    )
    canvas.top_legend(figure, axes)
    return figure


def _uncertainty(found: Identification, drawn: Sequence[traces.Trace]) -> dict[str, Any]:
    """Return half the band that holds the next record, and the effect of noise on the fit."""
    with told_as_a_finding():
        pairs = [(traces.doubted(found, trace.input)[1], trace) for trace in drawn]
    first, trace = pairs[0]
    return {
        "half": float(first.half[trace.skip :].mean()),
        "largest": max(float(one.half[trace.skip :].max()) for one, trace in pairs),
        "std": float(np.sqrt(np.mean(np.square(first.std[trace.skip :])))),
        "sensor": found.sensor_noise,
        "drawn": [(trace.name, traces.doubt(trace, one)) for one, trace in pairs],
    }
