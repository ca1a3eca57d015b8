"""The report of an identification: its sections in the order of the page, and their figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, models, provenance, traces
from mpi_hyst._report.models import default_drive, model_table, run
from mpi_hyst._report.page import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._report.provenance import Provenance
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
    Choice,
    choices,
    findings_section,
    parameters,
    pooled,
    title,
    value_of_dead_time,
    verdict_banner,
)
from mpi_hyst._text import digits, in_unit

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
        findings_section(found.warnings, records),
    ]
    if comparison is not None:
        sections.insert(2, compared_models(comparison, task, _SHOWN))
    if records.known:
        sections.append(residuals(fitted, held_out))
    if left_out:
        sections.append(left_out_loops(left_out, task))
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
            verdict=verdict_banner(found, records),
            cards=_cards(result),
            sections=sections,
            provenance=provenance,
            footer=f"Error: measured minus modelled output. {base(records)}",
        )
    )


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
    return traces.Trace(
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


@dataclass(frozen=True)
class Result:
    """A fit, and the fit of the other kind of model if there is one."""

    task: Task
    found: mh.results.Identification
    compared: mh.results.Identification | None

    @property
    def fits(self) -> list[mh.results.Identification]:
        """All fits; the requested one is last."""
        return [self.found] if self.compared is None else [self.compared, self.found]

    @property
    def of_unit(self) -> str:
        """The unit of the output in parentheses, for a column header."""
        return self.task.output.in_parentheses


def short_name(found: mh.results.Identification) -> str:
    """Return the kind of model, for a legend."""
    modified = isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    return "modified (coupled plays)" if modified else "conventional (plays)"


def shown_names(records: Records, count: int) -> str:
    """Return the names of the first records."""
    return ", ".join(records.names[:count])


def base(records: Records) -> str:
    """Return the base of the percentages."""
    text = "% of range: the range is the peak-to-peak of the measured output over the same samples"
    several = max(len(records.fitted), len(records.held_out)) > 1
    return f"{text}{'; for all records, the largest' if several else ''}."


def loops(drawn: Sequence[traces.Trace], count: int) -> Section:
    """Show measured and modelled loops."""
    text = [
        "Top: measured and modelled output over the input. Bottom: the same minus the straight "
        "line fit of the measured points. Without the line, the width of the loops and the error "
        "of a model fill the panel.",
    ]
    if count > len(drawn):
        text.append(f"Figures show the first {len(drawn)} of {count} records.")
    return Section(
        "loops",
        "Measured and modelled loops",
        text,
        [
            Figure(
                canvas.data_uri(traces.loops(drawn)),
                "Measured and modelled output over the input, and the same minus the straight line",
                "Fitted samples only.",
            )
        ],
    )


def own_loops(result: Result) -> Section:
    """Show the loops of the model alone, where its records are not at hand."""
    drive = default_drive(result.found)
    fits = zip(result.fits, (canvas.ORANGE, canvas.BLUE)[-len(result.fits) :], strict=True)
    curves = [
        traces.Curve(short_name(fit), colour, run(fit.model, drive, None)) for fit, colour in fits
    ]
    trace = traces.Trace(
        *("loops of the model", drive, np.empty(0), None, 0, curves),
        *(result.task.input, result.task.output),
    )
    return Section(
        "loops",
        "Loops of the model",
        ["Decaying loops over the range of the records, of the hysteresis alone."],
        [
            Figure(
                canvas.data_uri(traces.loops([trace])),
                "Modelled output over the input, and the same minus the straight line",
                "Top: the output over the input. Bottom: the same minus the straight line fit.",
            )
        ],
    )


def errors(result: Result) -> Section:
    """Show the errors on fitted and held-out records, and the loop width."""
    found, compared = result.found, result.compared
    blocks: list[Block] = [_error_table(result, held_out=False)]
    text = []
    if compared is not None:
        gain = compared.fit.rmse / found.fit.rmse if found.fit.rmse > 0.0 else float("inf")
        text.append(
            f"Fitted to the same samples, the {short_name(compared)} model has "
            f"{digits(gain, 3)} times the rms error of the {short_name(found)} model."
        )
    if found.validation is not None:
        own = "of the fitted part" if result.task.records.ends else "that minimizes its rms error"
        text.append(
            "The validation samples are predicted, not fitted. The output offset of each record is "
            f"the one {own}."
        )
        blocks.append(_error_table(result, held_out=True))
    return Section("errors", "Errors", text, [*blocks, *_loop_widths(result)])


def _error_table(result: Result, *, held_out: bool) -> Table:
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
            rows.append([name, kind, str(quality.samples), *error_cells(quality)])
    unit = result.of_unit
    errors = (f"max{unit}", f"rms{unit}", "max (%)", "rms (%)", "NRMSE", f"range{unit}")
    return Table(
        "Validation errors" if held_out else "Fit errors",
        ["record", "model", "samples", *errors],
        rows,
        f"{base(result.task.records)} NRMSE: rms over range. "
        "In % of the amplitude, half the range, every percentage doubles.",
        best,
    )


def error_cells(quality: mh.results.Quality) -> list[str]:
    """Format the errors and their base."""
    return [
        digits(quality.max_error, 3),
        digits(quality.rmse, 3),
        f"{quality.max_error_percent:.3f}",
        f"{quality.rmse_percent:.3f}",
        digits(quality.nrmse, 3),
        digits(quality.range, 4),
    ]


def _loop_widths(result: Result) -> list[Table]:
    """Compare the loop width for records that have full strokes."""
    rows = []
    fitted, held_out = evaluate(result.task.records, result.found)
    for one, what in [*((one, "") for one in fitted), *((one, "validation: ") for one in held_out)]:
        rows += _loop_width(one, what)
    if not rows:
        return []
    unit = result.of_unit
    header = ["record", f"measured{unit}", f"modelled{unit}", f"error{unit}", "error (%)"]
    note = "Largest distance between falling and rising full strokes. %: of the measured width."
    return [Table(f"Loop width, {short_name(result.found)}", header, rows, note)]


def _loop_width(evaluated: Evaluated, what: str) -> list[list[str]]:
    width, error = evaluated.quality.loop_width, evaluated.quality.loop_width_error
    if width is None or error is None:
        return []
    percent = digits(100.0 * error / width, 3) if width > 0.0 else ""
    name = f"{what}{evaluated.record.name}"
    return [[name, digits(width), digits(width + error), digits(error, 3), percent]]


def residuals(fitted: Sequence[traces.Trace], held_out: Sequence[traces.Trace]) -> Section:
    """Show the residuals over input, rate and time."""
    text = [
        "A residual that depends on the input is hysteresis that the model lacks. One that depends "
        "on the rate of the input is a lag. One that drifts over time is creep or temperature. A "
        "band that is the same everywhere is noise.",
    ]
    blocks: list[Block] = [
        Figure(
            canvas.data_uri(traces.residuals(trace)),
            f"Residuals of {trace.name} over input, rate and time, {what}",
            f"{trace.name}, {what}: measured minus modelled.",
        )
        for drawn, what in ((fitted, "fitted"), (held_out, "validation"))
        for trace in drawn
    ]
    return Section("residuals", "Residuals over input, rate and time", text, blocks)


def model(result: Result) -> Section:
    """Show weights, thresholds and parameters."""
    found, compared, task = result.found, result.compared, result.task
    slope = f"{task.output.unit}/{task.input.unit}"
    weight_unit = slope if task.output.unit and task.input.unit else ""
    banks = [models.Bank(short_name(found), canvas.BLUE, found.model, found=found)]
    if compared is not None:
        banks.append(models.Bank(short_name(compared), canvas.ORANGE, compared.model, "s"))
    fitted = task.records.fitted
    pairs = [("operators", str(found.model.operators)), *parameters(task, found)]
    for record, offset in zip(fitted, found.output_offsets, strict=True):
        value = in_unit(float(offset), task.output.unit)
        pairs.append((f"output offset of {record.name}", value))
    first = digits(float(found.model.weights[0]))
    return Section(
        "model",
        "The model",
        [
            "The data determine the cumulative sum of the weights, which is the slope of the "
            "first loading curve, better than each single weight.",
        ],
        [
            Figure(
                canvas.data_uri(models.weights_figure(banks, weight_unit, task.input.unit)),
                "Weights, their cumulative sum, and thresholds over the threshold r",
                f"The first weight, at threshold zero, is {first} {weight_unit}; the left panel "
                "omits it. Dashed: weights v below zero of a split model. Bars and bands: 95 %, "
                "± 1.96 standard errors.",
            ),
            Pairs("Parameters ± one standard error", pairs),
            model_table(found.model, weight_unit, task.input.unit, _standard_errors(found)),
        ],
    )


def _standard_errors(found: mh.results.Identification) -> list[list[float]]:
    return [found.weights_std.tolist(), found.weights_negative_std.tolist()]


def compared_models(comparison: mh.results.Comparison, task: Task, shown: int) -> Section:
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
            canvas.data_uri(_compared_residuals(comparison, task, place)),
            f"Residuals of every model on {record.name} over the drive",
            f"{record.name}: measured minus modelled, fitted to all stretches.",
        )
        for place, record in enumerate(task.records.fitted[:shown])
    ]
    bars = Figure(
        canvas.data_uri(_compared_errors(comparison, task)),
        "Rms error of every model: fitted, held out, worst stretch",
        "Held out: over all stretches, each predicted from the others. Worst stretch: the largest "
        "of these errors.",
    )
    return Section(
        "comparison",
        "Comparison of models",
        text,
        [_compared_table(comparison, task), bars, *residuals],
    )


def _compared_table(comparison: mh.results.Comparison, task: Task) -> Table:
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
        [_compared_cells(row) for row in rows],
        f"%: of the range, {in_unit(rows[0].fit.range, task.output.unit)}, the peak-to-peak of the "
        "measured output. Extensions are kept as cross-validation asks for, unless given.",
        [place for place, row in enumerate(rows) if row.model == comparison.simplest],
    )


def _compared_cells(row: mh.results.ComparedModel) -> list[str]:
    percents = (row.fit.rmse_percent, row.held_out_percent, row.worst_stretch_percent)
    return [
        *(row.model, row.weights_law, str(row.unknowns)),
        *(digits(error) for error in (row.fit.rmse, row.held_out, row.worst_stretch)),
        *(f"{percent:.3f}" for percent in percents),
        ", ".join(row.kept) or ("none" if "modified +" in row.model else ""),
    ]


_COLUMNS = 4  # panels side by side
_BAR = 0.38  # of the distance between two models
_FEWEST = 3  # models that the figure has room for at least


def _compared_errors(comparison: mh.results.Comparison, task: Task) -> canvas.Figure:
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


def _compared_residuals(
    comparison: mh.results.Comparison, task: Task, record: int
) -> canvas.Figure:
    """Draw the residuals of every model over the drive, all on one scale."""
    rows, shown = comparison.rows, task.records.fitted[record]
    lines = -(-len(rows) // _COLUMNS)
    columns = min(len(rows), _COLUMNS)
    figure = canvas.new_figure(0.5 + 2.3 * lines)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    kept = slice(shown.skip, None)
    every = canvas.thinned(shown.input[kept].size, traces.CLOUD_POINTS)
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


_ROWS = 60


def left_out_loops(loops: Sequence[mh.results.LeftOutLoop], task: Task) -> Section:
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
                canvas.data_uri(_left_out_figure(loops, task.output)),
                "Rms error of every loop, fitted and predicted",
                "A line joins the two errors of the same loop.",
            ),
            table,
        ],
    )


def uncertainty(
    found: mh.results.Identification, drawn: Sequence[traces.Trace], task: Task
) -> Section:
    """Show the standard deviation of the prediction."""
    unit = task.output.unit
    with told_as_a_finding():
        deviations = [found.predict(trace.input, return_std=True)[1] for trace in drawn]
    largest = max(
        float(std[trace.skip :].max()) for std, trace in zip(deviations, drawn, strict=True)
    )
    mean = float(np.sqrt(np.mean(np.square(deviations[0][drawn[0].skip :]))))
    return Section(
        "uncertainty",
        "Uncertainty of the output",
        [
            "The standard deviation of the prediction follows from the covariance of all fitted "
            f"parameters. It is {in_unit(mean, unit, 3)} rms on "
            f"{drawn[0].name} and at most {in_unit(largest, unit, 3)} on the records shown. It "
            "assumes that the model is right and that the errors of successive samples are "
            "independent. If the residuals above depend on input, rate or time, the error may be "
            "larger. Measurement noise is not included. Weights at zero count as known.",
        ],
        [
            Figure(
                canvas.data_uri(traces.deviation(trace, std)),
                f"Uncertainty of the prediction of {trace.name}",
                f"{trace.name}: the band is ± 1.96 standard deviations of the prediction.",
            )
            for trace, std in zip(drawn, deviations, strict=True)
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


def _left_out_figure(
    loops: Sequence[mh.results.LeftOutLoop], output_quantity: Quantity
) -> canvas.Figure:
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


def report_of_arrays(
    found: mh.results.Identification,
    given: Records,
    quantities: tuple[Quantity, Quantity],
    beside: mh.results.Identification | None,
) -> str:
    """Return the HTML text."""
    left_out: Sequence[mh.results.LeftOutLoop] = []
    data = []
    if given.known:
        left_out = loops_left_out(given, found)
        every = [*given.fitted, *given.held_out]
        data = [(f"{one.name}, u and y as float64", one.sha256) for one in every]
    stage = provenance.of_stage(found.stage)
    made = provenance.rows("mpi_hyst.reports.identification in Python", data, stage)
    return report(Task(given, *quantities), found, beside, left_out, provenance=made)
