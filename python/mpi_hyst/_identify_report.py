"""The report of an identification on the user's own records."""

from __future__ import annotations

from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst import _findings, _plots
from mpi_hyst._identify import Record, Request, model_name, parameters, residuals
from mpi_hyst._report import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._tables import digits, in_unit

_SHOWN = 3  # records with figures of their own; the table has all
_ROWS = 60


def report(
    records: Sequence[Record],
    found: mh.Identification,
    compared: mh.Identification,
    findings: Sequence[mh.Finding],
    request: Request,
) -> str:
    """Return the HTML text: the model found, and beside it the other kind for comparison."""
    traces = [
        _trace(index, record, found, compared, request)
        for index, record in enumerate(records[:_SHOWN])
    ]
    return render(
        Report(
            title=f"Hysteresis of {', '.join(record.name for record in records[:_SHOWN])}",
            subtitle=f"{model_name(found)} fitted to {found.fit.samples} samples, "
            f"{request.input.label} to {request.output.label}",
            cards=_cards(records, found, compared, request),
            sections=[
                _loops(traces, len(records)),
                _errors(records, found, compared, request),
                _findings.section(findings, [record.name for record in records]),
                _residuals(traces),
                _model(records, found, compared, request),
            ],
            footer=f"mpi_hyst. Errors are measured minus modelled output. {_base(len(records))}",
        )
    )


def short_name(found: mh.Identification) -> str:
    """Name the kind of model in a legend."""
    modified = isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    return "modified (coupled plays)" if modified else "conventional (plays)"


def _trace(
    index: int,
    record: Record,
    found: mh.Identification,
    compared: mh.Identification,
    request: Request,
) -> _plots.Trace:
    # The model that was asked for is drawn last, on top, in the accent colour.
    curves = [
        _plots.Curve(short_name(fit), colour, record.output - residuals(record, fit, index))
        for fit, colour in ((compared, _plots.ORANGE), (found, _plots.BLUE))
    ]
    return _plots.Trace(
        record.name,
        record.input,
        record.output,
        record.seconds,
        record.skip,
        curves,
        request.input,
        request.output,
    )


def _cards(
    records: Sequence[Record],
    found: mh.Identification,
    compared: mh.Identification,
    request: Request,
) -> list[Card]:
    unit = request.output.shown_unit
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
        Card(
            in_unit(compared.fit.rmse, unit, 3),
            f"rms error, {short_name(compared)}",
            "fitted to the same samples, for comparison",
        ),
    ]
    step = records[0].sample_time
    delay = f"{found.delay:.2f} samples"
    if step is not None:
        cards.append(Card(f"{digits(1e3 * step * found.delay, 3)} ms", "lag of the output", delay))
    else:
        cards.append(Card(delay, "lag of the output"))
    return cards


def _base(records: int) -> str:
    base = "% of range: of the peak-to-peak of the measured output over the fitted samples"
    return f"{base}{'; for all records, of the widest' if records > 1 else ''}."


def _loops(traces: Sequence[_plots.Trace], count: int) -> Section:
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
                _plots.data_uri(_plots.loops(traces)),
                "Output over input, measured and modelled, and the same without the straight line",
                "Fitted samples only.",
            )
        ],
    )


def _errors(
    records: Sequence[Record],
    found: mh.Identification,
    compared: mh.Identification,
    request: Request,
) -> Section:
    unit = request.output.shown_unit
    of_unit = f" ({unit})" if unit else ""
    rows: list[list[str]] = []
    best = []
    for fit in (compared, found):
        entries = list(zip([record.name for record in records], fit.records, strict=True))
        if len(entries) > 1:
            entries.append(("all records", fit.fit))
        for name, quality in entries:
            if fit is found:
                best.append(len(rows))
            rows.append(
                [name, short_name(fit).split(" ")[0], str(quality.samples), *error_cells(quality)]
            )
    table = Table(
        "Errors of the fit",
        [
            "record",
            "model",
            "samples",
            f"max{of_unit}",
            f"rms{of_unit}",
            "max (%)",
            "rms (%)",
            f"range{of_unit}",
        ],
        rows,
        _base(len(records)),
        best,
    )
    gain = compared.fit.rmse / found.fit.rmse if found.fit.rmse > 0.0 else float("inf")
    sentence = (
        f"The {short_name(compared)} model, fitted to the same samples, leaves "
        f"{digits(gain, 3)} times the rms error of the {short_name(found)} model."
    )
    widths = _loop_widths(records, found, request)
    return Section("errors", "Errors", [sentence], [table, *widths])


def _loop_widths(
    records: Sequence[Record], found: mh.Identification, request: Request
) -> list[Table]:
    """Compare the width of the loops, for records that hold full strokes."""
    unit = request.output.shown_unit
    of_unit = f" ({unit})" if unit else ""
    rows = []
    for index, record in enumerate(records):
        drive, measured = record.input[record.skip :], record.output[record.skip :]
        modelled = measured - residuals(record, found, index)[record.skip :]
        width, model_width = mh.loop_width(drive, measured), mh.loop_width(drive, modelled)
        if width is None or model_width is None:
            continue
        error = model_width - width
        percent = digits(100.0 * error / width, 3) if width > 0.0 else ""
        rows.append([record.name, digits(width), digits(model_width), digits(error, 3), percent])
    if not rows:
        return []
    header = ["record", f"measured{of_unit}", f"modelled{of_unit}", f"error{of_unit}", "error (%)"]
    note = "Widest distance of falling and rising full strokes; % of the measured width."
    return [Table(f"Loop width, {short_name(found)}", header, rows, note)]


def error_cells(quality: mh.Quality) -> list[str]:
    """Format the errors with their base."""
    return [
        digits(quality.max_error, 3),
        digits(quality.rmse, 3),
        f"{quality.max_error_percent:.3f}",
        f"{quality.rmse_percent:.3f}",
        digits(quality.range, 4),
    ]


def _residuals(traces: Sequence[_plots.Trace]) -> Section:
    text = [
        "A residual that bends with the input is hysteresis the model does not have; one that "
        "follows its speed is a lag; one that drifts over time is creep or temperature. A band "
        "that looks the same everywhere is noise.",
    ]
    blocks: list[Block] = [
        Figure(
            _plots.data_uri(_plots.residuals(trace)),
            f"Residuals of {trace.name} over input, speed and time",
            f"{trace.name}: measured minus modelled.",
        )
        for trace in traces
    ]
    return Section("residuals", "Residuals over input, speed and time", text, blocks)


def _model(
    records: Sequence[Record],
    found: mh.Identification,
    compared: mh.Identification,
    request: Request,
) -> Section:
    slope = f"{request.output.shown_unit}/{request.input.unit}"
    weight_unit = slope if request.output.unit and request.input.unit else ""
    banks = [
        _plots.Bank(short_name(found), _plots.BLUE, found.model),
        _plots.Bank(short_name(compared), _plots.ORANGE, compared.model, "s"),
    ]
    pairs = [("operators", str(found.model.operators)), *parameters(records, found, request)]
    for record, offset in zip(records, found.output_offsets, strict=True):
        value = in_unit(float(offset), request.output.shown_unit)
        pairs.append((f"output offset of {record.name}", value))
    return Section(
        "model",
        "The model",
        [
            "Neighbouring weights share what the data cannot tell apart; their running sum, the "
            "slope of the first loading curve, is what the data fix.",
        ],
        [
            Figure(
                _plots.data_uri(_plots.weights(banks, weight_unit, request.input.shown_unit)),
                "Weights, their running sum, and thresholds over the threshold r",
                f"The first weight, at threshold zero, is {digits(float(found.model.weights[0]))} "
                f"{weight_unit} and is left out of the first panel.",
            ),
            Pairs("Parameters", pairs),
            bank_table(found.model, weight_unit, request.input.shown_unit),
        ],
    )


def bank_table(
    model: mh.PrandtlIshlinskii | mh.ModifiedPrandtlIshlinskii, weight_unit: str, input_unit: str
) -> Table:
    """List the weights and thresholds of a model."""
    modified = isinstance(model, mh.ModifiedPrandtlIshlinskii)
    names = ["r", "ra", "rb", "rc"] if modified else ["thresholds"]
    columns = [getattr(model, name).tolist() for name in names]
    of_input = f" ({input_unit})" if input_unit else ""
    rows = [
        [str(index), digits(weight, 5), *(digits(value, 5) for value in values)]
        for index, (weight, *values) in enumerate(
            zip(model.weights.tolist(), *columns, strict=True)
        )
    ]
    return Table(
        "Weights and thresholds",
        [
            "operator",
            f"w ({weight_unit})" if weight_unit else "w",
            *(f"{'r' if name == 'thresholds' else name}{of_input}" for name in names),
        ],
        rows[:_ROWS],
        f"The first {_ROWS} of {len(rows)}; the model file has all." if len(rows) > _ROWS else "",
    )
