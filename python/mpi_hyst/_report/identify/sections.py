"""Sections of the report of an identification: loops, errors, residuals, the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots, weights
from mpi_hyst._report.identify.records import Evaluated, Records, Task, evaluate
from mpi_hyst._report.identify.summary import parameters
from mpi_hyst._report.model_table import model_table
from mpi_hyst._report.page import Block, Figure, Pairs, Section, Table
from mpi_hyst._report.shown import default_drive, run
from mpi_hyst._text import digits, in_unit


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


def loops(traces: Sequence[plots.Trace], count: int) -> Section:
    """Show measured and modelled loops."""
    text = [
        "Top: measured and modelled output over the input. Bottom: the same minus the straight "
        "line fit of the measured points. Without the line, the width of the loops and the error "
        "of a model fill the panel.",
    ]
    if count > len(traces):
        text.append(f"Figures show the first {len(traces)} of {count} records.")
    return Section(
        "loops",
        "Measured and modelled loops",
        text,
        [
            Figure(
                canvas.data_uri(plots.loops(traces)),
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
        plots.Curve(short_name(fit), colour, run(fit.model, drive, None)) for fit, colour in fits
    ]
    trace = plots.Trace(
        *("loops of the model", drive, np.empty(0), None, 0, curves),
        *(result.task.input, result.task.output),
    )
    return Section(
        "loops",
        "Loops of the model",
        ["Decaying loops over the range of the records, of the hysteresis alone."],
        [
            Figure(
                canvas.data_uri(plots.loops([trace])),
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


def residuals(fitted: Sequence[plots.Trace], held_out: Sequence[plots.Trace]) -> Section:
    """Show the residuals over input, rate and time."""
    text = [
        "A residual that depends on the input is hysteresis that the model lacks. One that depends "
        "on the rate of the input is a lag. One that drifts over time is creep or temperature. A "
        "band that is the same everywhere is noise.",
    ]
    blocks: list[Block] = [
        Figure(
            canvas.data_uri(plots.residuals(trace)),
            f"Residuals of {trace.name} over input, rate and time, {what}",
            f"{trace.name}, {what}: measured minus modelled.",
        )
        for traces, what in ((fitted, "fitted"), (held_out, "validation"))
        for trace in traces
    ]
    return Section("residuals", "Residuals over input, rate and time", text, blocks)


def model(result: Result) -> Section:
    """Show weights, thresholds and parameters."""
    found, compared, task = result.found, result.compared, result.task
    slope = f"{task.output.unit}/{task.input.unit}"
    weight_unit = slope if task.output.unit and task.input.unit else ""
    banks = [weights.Bank(short_name(found), canvas.BLUE, found.model, found=found)]
    if compared is not None:
        banks.append(weights.Bank(short_name(compared), canvas.ORANGE, compared.model, "s"))
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
                canvas.data_uri(weights.figure(banks, weight_unit, task.input.unit)),
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
