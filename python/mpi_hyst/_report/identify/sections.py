"""Sections of the report of an identification: loops, errors, residuals, the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mpi_hyst as mh
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.identify.records import Judged, Records, Task, judge
from mpi_hyst._report.identify.summary import parameters
from mpi_hyst._report.model_table import model_table
from mpi_hyst._report.page import Block, Figure, Pairs, Section, Table
from mpi_hyst._text import digits, in_unit


@dataclass(frozen=True)
class Result:
    """What was found on which records, and the other kind of model beside it if it was fitted."""

    task: Task
    found: mh.results.Identification
    compared: mh.results.Identification | None

    @property
    def fits(self) -> list[mh.results.Identification]:
        """The models there are, the one that was asked for last."""
        return [self.found] if self.compared is None else [self.compared, self.found]

    @property
    def of_unit(self) -> str:
        """The unit of the output, for the head of a column."""
        unit = self.task.output.shown_unit
        return f" ({unit})" if unit else ""


def short_name(found: mh.results.Identification) -> str:
    """Name the kind of model in a legend."""
    modified = isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    return "modified (coupled plays)" if modified else "conventional (plays)"


def shown_names(records: Records, count: int) -> str:
    """Name the first records."""
    return ", ".join(records.names[:count])


def base(records: Records) -> str:
    """Say what percentages are of."""
    text = "% of range: of the peak-to-peak of the measured output over the samples judged"
    several = max(len(records.fitted), len(records.held_out)) > 1
    return f"{text}{'; for all records, of the widest' if several else ''}."


def loops(traces: Sequence[plots.Trace], count: int) -> Section:
    """Show the loops measured and modelled."""
    text = [
        "Above, the output over the input as measured and as the models have it. Below, the same "
        "without the straight line through the measured points: the width and the lean of the "
        "loops fill the panel, and so does what a model misses.",
    ]
    if count > len(traces):
        text.append(f"Figures show the first {len(traces)} of {count} records.")
    return Section(
        "loops",
        "Loops measured and modelled",
        text,
        [
            Figure(
                canvas.data_uri(plots.loops(traces)),
                "Output over input, measured and modelled, and the same without the straight line",
                "Fitted samples only.",
            )
        ],
    )


def errors(result: Result) -> Section:
    """Tell the errors on fitted and held-out records, and the width of the loops."""
    found, compared = result.found, result.compared
    blocks: list[Block] = [_error_table(result, held_out=False)]
    text = []
    if compared is not None:
        gain = compared.fit.rmse / found.fit.rmse if found.fit.rmse > 0.0 else float("inf")
        text.append(
            f"The {short_name(compared)} model, fitted to the same samples, leaves "
            f"{digits(gain, 3)} times the rms error of the {short_name(found)} model."
        )
    if found.validation is not None:
        own = (
            "the offset of its record"
            if result.task.records.ends
            else "the offset that suits it best"
        )
        text.append(f"What was held out is predicted, not fitted; the output has {own}.")
        blocks.append(_error_table(result, held_out=True))
    return Section("errors", "Errors", text, [*blocks, *_loop_widths(result)])


def _error_table(result: Result, *, held_out: bool) -> Table:
    rows: list[list[str]] = []
    best = []
    for fit in result.fits:
        judged = judge(result.task.records, fit)[held_out]
        entries = [(one.record.name, one.quality) for one in judged]
        total = fit.validation if held_out else fit.fit
        if len(entries) > 1 and total is not None:
            entries.append(("all records", total))
        for name, quality in entries:
            if fit is result.found:
                best.append(len(rows))
            kind = short_name(fit).split(" ")[0]
            rows.append([name, kind, str(quality.samples), *error_cells(quality)])
    unit = result.of_unit
    errors = (f"max{unit}", f"rms{unit}", "max (%)", "rms (%)", "NRMSE", f"range{unit}")
    return Table(
        "Errors on what was held out" if held_out else "Errors of the fit",
        ["record", "model", "samples", *errors],
        rows,
        f"{base(result.task.records)} NRMSE: rms over range. Of the amplitude, half the range, "
        "every percentage is twice as much.",
        best,
    )


def error_cells(quality: mh.results.Quality) -> list[str]:
    """Format the errors with their base."""
    return [
        digits(quality.max_error, 3),
        digits(quality.rmse, 3),
        f"{quality.max_error_percent:.3f}",
        f"{quality.rmse_percent:.3f}",
        digits(quality.nrmse, 3),
        digits(quality.range, 4),
    ]


def _loop_widths(result: Result) -> list[Table]:
    """Compare the width of the loops, for records that hold full strokes."""
    rows = []
    fitted, held_out = judge(result.task.records, result.found)
    for one, what in [*((one, "") for one in fitted), *((one, "held out: ") for one in held_out)]:
        rows += _loop_width(one, what)
    if not rows:
        return []
    unit = result.of_unit
    header = ["record", f"measured{unit}", f"modelled{unit}", f"error{unit}", "error (%)"]
    note = "Widest distance of falling and rising full strokes; % of the measured width."
    return [Table(f"Loop width, {short_name(result.found)}", header, rows, note)]


def _loop_width(judged: Judged, what: str) -> list[list[str]]:
    width, error = judged.quality.loop_width, judged.quality.loop_width_error
    if width is None or error is None:
        return []
    percent = digits(100.0 * error / width, 3) if width > 0.0 else ""
    name = f"{what}{judged.record.name}"
    return [[name, digits(width), digits(width + error), digits(error, 3), percent]]


def residuals(fitted: Sequence[plots.Trace], held_out: Sequence[plots.Trace]) -> Section:
    """Show what the models leave over input, speed and time."""
    text = [
        "A residual that bends with the input is hysteresis the model does not have; one that "
        "follows its speed is a lag; one that drifts over time is creep or temperature. A band "
        "that looks the same everywhere is noise.",
    ]
    blocks: list[Block] = [
        Figure(
            canvas.data_uri(plots.residuals(trace)),
            f"Residuals of {trace.name} over input, speed and time, {what}",
            f"{trace.name}, {what}: measured minus modelled.",
        )
        for traces, what in ((fitted, "fitted"), (held_out, "held out"))
        for trace in traces
    ]
    return Section("residuals", "Residuals over input, speed and time", text, blocks)


def model(result: Result) -> Section:
    """Show weights, thresholds and parameters."""
    found, compared, task = result.found, result.compared, result.task
    slope = f"{task.output.shown_unit}/{task.input.unit}"
    weight_unit = slope if task.output.unit and task.input.unit else ""
    banks = [plots.Bank(short_name(found), canvas.BLUE, found.model)]
    if compared is not None:
        banks.append(plots.Bank(short_name(compared), canvas.ORANGE, compared.model, "s"))
    fitted = task.records.fitted
    pairs = [("operators", str(found.model.operators)), *parameters(task, found)]
    for record, offset in zip(fitted, found.output_offsets, strict=True):
        value = in_unit(float(offset), task.output.shown_unit)
        pairs.append((f"output offset of {record.name}", value))
    first = digits(float(found.model.weights[0]))
    return Section(
        "model",
        "The model",
        [
            "Neighbouring weights share what the data cannot tell apart; their running sum, the "
            "slope of the first loading curve, is what the data fix.",
        ],
        [
            Figure(
                canvas.data_uri(plots.weights(banks, weight_unit, task.input.shown_unit)),
                "Weights, their running sum, and thresholds over the threshold r",
                f"The first weight, at threshold zero, is {first} {weight_unit} and is left out of "
                "the first panel. Split models have weights v of their own below zero: dashed.",
            ),
            Pairs("Parameters, ± one standard error", pairs),
            model_table(found.model, weight_unit, task.input.shown_unit, _standard_errors(found)),
        ],
    )


def _standard_errors(found: mh.results.Identification) -> list[list[float]]:
    return [found.weights_std.tolist(), found.weights_negative_std.tolist()]
