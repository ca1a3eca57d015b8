"""The demo, for the terminal and as a page: a measured stack, then the actuator of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mpi_hyst._paper.demo import (
    LIMITS,
    NOISE,
    RATE,
    STACK_NOISE,
    Demo,
    Error,
    MeasuredStack,
    Measurement,
    Prediction,
    exact,
    seconds,
)
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, coupled_play, models, traces
from mpi_hyst._report.models import model_table
from mpi_hyst._report.page import Card, Figure, Lines, Pairs, Report, Section, Table, render
from mpi_hyst._report.provenance import Provenance
from mpi_hyst._text import digits
from mpi_hyst._types import Samples

_DRIVE = Quantity("drive_v")
_POSITION = Quantity("position_um")
_COLOURS = (canvas.SOFT, canvas.ORANGE, canvas.GREEN, canvas.BLUE, canvas.INK)


def report(stack: MeasuredStack, demo: Demo, directory: Path, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    drawn = [_trace(demo, record) for record in demo.records]
    return render(
        Report(
            title="Hysteresis of piezo actuators: model, identification, compensation",
            subtitle="First a measured stack. Then the simulated actuator of Wang, Chen, Zhou and "
            "Bai (2017): Table I with all digits recovered from Table II.",
            cards=[*stack_cards(stack), *_cards(demo)],
            sections=[
                stack_section(stack),
                _operator(),
                _loops(drawn),
                _errors(demo),
                _paper(demo, drawn[0]),
                _residuals(drawn),
                _model(demo),
                _compensation(demo),
                _memory(demo),
                _next(directory),
            ],
            provenance=provenance,
            footer=f"Measured: {stack.fitted.source} Simulated: at "
            f"{RATE / 1000:g} kHz with {1e3 * NOISE:g} nm rms of sensor noise; the seed is fixed. "
            "Method: G. Wang, G. Chen, "
            "H. Zhou, F. Bai, IEEE/CAA J. Autom. Sinica 4(4), 782-791, 2017, "
            "doi 10.1109/JAS.2016.7510136.",
        )
    )


def _trace(demo: Demo, record: Measurement) -> traces.Trace:
    curves = [
        traces.Curve(name, colour, demo.modelled(found, record))
        for name, colour, found in (
            ("conventional model (plays)", canvas.ORANGE, demo.conventional),
            ("modified model (coupled plays)", canvas.BLUE, demo.modified),
        )
    ]
    return traces.Trace(
        f"{record.name} record",
        record.drive,
        record.measured,
        seconds(record.drive),
        0,
        curves,
        _DRIVE,
        _POSITION,
    )


def _cards(demo: Demo) -> list[Card]:
    unseen = demo.records[1]
    error = Error.of(demo.modelled(demo.modified, unseen) - unseen.position, unseen.position)
    other = Error.of(demo.modelled(demo.conventional, unseen) - unseen.position, unseen.position)
    followed, line = exact(demo).error, demo.schemes[0].error
    return [
        Card(
            f"{1e3 * error.rms:.2f} nm",
            "simulated: rms error of the model, validation",
            f"{1e2 * error.rms / error.base:.3f} % of {digits(error.base, 3)} µm, true position",
        ),
        Card(
            f"{1e3 * other.rms:.1f} nm",
            "the same, conventional model",
            f"{1e2 * other.rms / other.base:.3f} % of {digits(other.base, 3)} µm",
        ),
        Card(
            f"{1e3 * followed.max:.1f} nm",
            "simulated: largest tracking error, exact inverse",
            f"{1e2 * followed.max / followed.base:.3f} % of the "
            f"{digits(followed.base, 3)} µm stroke",
        ),
        Card(
            f"{1e3 * line.max:.0f} nm",
            "the same, without a model",
            f"{1e2 * line.max / line.base:.2f} % of the {digits(line.base, 3)} µm stroke",
        ),
    ]


def _operator() -> Section:
    return Section(
        "operator",
        "The coupled-play operator",
        [
            "A model is a weighted sum of operators. The output of a play follows its input at a "
            "distance. A coupled play has four such distances: for rising and falling input, above "
            "and below zero. At zero its output stays until the input has moved far enough. The "
            "four thresholds r, ra, rb, rc give asymmetric loops that are narrow near zero, as "
            "those of piezo stacks are.",
        ],
        [
            Figure(
                canvas.data_uri(coupled_play.walk()),
                "Output z over input x of one operator, and both over the distance travelled",
                "The walk of Fig. 5 of the paper with r = 10, ra = 8, rb = 3, rc = 4 V. At the "
                "corners 0 to 7, x is 0, 20, −20, 15, 6, 25, −15, −5 and z is 0, 10, −12, 5, 5, "
                "15, −7, −7. The result does not depend on the sampling of the moves.",
            )
        ],
    )


def _loops(drawn: list[traces.Trace]) -> Section:
    return Section(
        "loops",
        "Measured and modelled loops",
        [
            "Both models are fitted to a decaying triangle. They are validated on a second record "
            "with several amplitudes and minor loops. The lower panels show the same data minus "
            "the straight line fit, so that differences are visible.",
        ],
        [
            Figure(
                canvas.data_uri(traces.loops(drawn)),
                "Measured and modelled position over drive, and the same minus the straight line",
                "The measured loops are narrow near zero. The conventional model cannot reproduce "
                "this; the modified one does.",
            )
        ],
    )


def _errors(demo: Demo) -> Section:
    header, rows = model_errors(demo)
    return Section(
        "errors",
        "Errors of the models",
        [
            f"The sensor noise is {1e3 * NOISE:g} nm rms. No model can have a smaller error "
            "against the measured position. The last two rows compare with the true position.",
        ],
        [
            Table(
                "Measured or true position minus model",
                header,
                rows,
                "%: of the base, the peak-to-peak range of the measured or true position.",
                [index for index, row in enumerate(rows) if row[1] == "modified"],
            )
        ],
    )


def _paper(demo: Demo, trace: traces.Trace) -> Section:
    conventional, modified = demo.conventional.fit, demo.modified.fit
    cells = [
        [
            name,
            f"{quality.max_error_percent:.2f}",
            f"{quality.max_error_percent_of_amplitude:.2f}",
            digits(quality.mse, 2),
            *printed,
        ]
        for name, quality, printed in (
            ("conventional", conventional, ("5.31", "0.014")),
            ("modified", modified, ("1.02", "0.002")),
        )
    ]
    return Section(
        "paper",
        "The same as in Fig. 8 to 10 of the paper",
        [
            "Both models are fitted to the same record. The error of the conventional model has "
            "the shape of the loops. The error of the modified model is noise.",
            "The paper gives a largest error of 5.31 % for the conventional model and 1.02 % for "
            "the modified one. Both depend on data that are not published, and their base is not "
            "given. They are listed for comparison and not reproduced. On this record the largest "
            f"error of the conventional model is {conventional.max_error_percent:.2f} % of the "
            f"range, {conventional.max_error_percent_of_amplitude:.2f} % of the amplitude.",
        ],
        [
            Figure(
                canvas.data_uri(side_by_side(trace)),
                "Loop, time course and error of the conventional and the modified model",
                f"{trace.name.capitalize()}. Both rows have the same scales.",
            ),
            Table(
                "Largest error and mean square error, here and published",
                [
                    "model",
                    "max (% of range)",
                    "max (% of amplitude)",
                    "mse (µm²)",
                    "published max (%)",
                    "published “MSE”",
                ],
                cells,
                "Range: peak-to-peak of the measured output. Amplitude: half of it. The published "
                "mean square errors can only be in µm².",
            ),
        ],
    )


def _residuals(drawn: list[traces.Trace]) -> Section:
    return Section(
        "residuals",
        "Residuals over input, rate and time",
        [
            "The residual of the modified model is sensor noise. It is the same everywhere. The "
            "residual of the conventional model depends on the input: hysteresis that it lacks.",
        ],
        [
            Figure(
                canvas.data_uri(traces.residuals(trace)),
                f"Residuals of the {trace.name} over input, rate and time",
                f"{trace.name.capitalize()}: measured minus modelled.",
            )
            for trace in drawn
        ],
    )


def _model(demo: Demo) -> Section:
    banks = [
        models.Bank("modified, identified", canvas.BLUE, demo.modified.model),
        models.Bank("true actuator", canvas.INK, demo.actuator.hysteresis, "D"),
        models.Bank("conventional, identified", canvas.ORANGE, demo.conventional.model, "s"),
    ]
    found = ", ".join(f"{ratio:.4f}" for ratio in demo.modified.ratios)
    first, true = (
        1e3 * model.weights[0] for model in (demo.modified.model, demo.actuator.hysteresis)
    )
    pairs = [
        ("ratios ra/r, rb/r, rc/r", f"{found}  (true 0.95, 0.30, 0.35)"),
        ("input offset", f"{demo.modified.model.input_offset:.3f} V  (true 0)"),
        ("output offset", f"{1e3 * demo.modified.model.output_offset:.2f} nm  (true 0)"),
        ("dead time", f"{1e3 * (demo.modified.dead_time or 0.0):.4f} ms  (true 0)"),
        ("first weight", f"{first:.4f} nm/V  (true {true:.4f})"),
    ]
    return Section(
        "model",
        "Weights and thresholds",
        [
            "Noise makes single weights of neighbouring operators uncertain. Their cumulative sum, "
            "the slope of the first loading curve, agrees with the true one. The thresholds follow "
            "from three identified ratios.",
        ],
        [
            Figure(
                canvas.data_uri(models.weights_figure(banks, "µm/V", "V")),
                "Weights, their cumulative sum, and thresholds, identified and true",
                "The left panel omits the first weight, at threshold zero.",
            ),
            Pairs("Identified parameters of the modified model", pairs),
            model_table(demo.modified.model, "µm/V", "V"),
        ],
    )


def _compensation(demo: Demo) -> Section:
    header, rows = tracking_errors(demo)
    followed, table_2 = exact(demo).error, demo.schemes[2].error
    shown = [
        Tracking(scheme.name, colour, scheme.position - scheme.target)
        for scheme, colour in zip(demo.schemes, _COLOURS, strict=True)
    ]
    return Section(
        "compensation",
        "Compensation of the hysteresis",
        [
            "The actuator is driven in open loop, without a sensor. The target is a full stroke "
            "with minor loops after it. The parametric inverse of the paper is approximate: its "
            f"error is at most {1e3 * table_2.max:.1f} nm, although Table II has the true weights. "
            f"The exact inverse of the identified model has {1e3 * followed.max:.1f} nm, the error "
            "of identification. The exact inverse of the true model has rounding errors only.",
        ],
        [
            Figure(
                canvas.data_uri(tracking(seconds(demo.target), demo.target, shown, "µm")),
                "Target over time, and the tracking errors of all schemes to one scale",
                "All errors have the same scale.",
            ),
            Table(
                "Position minus target",
                header,
                rows,
                "%: of the base, the peak-to-peak range of the target.",
                [len(rows) - 2],
            ),
        ],
    )


def _memory(demo: Demo) -> Section:
    return Section(
        "memory",
        "The memory of reversals",
        [
            "The memory of a model is a stack of reversals. A reversal inside the last loop is "
            "added to the stack. A move beyond an earlier reversal erases that reversal and all "
            "later ones. The library stores this stack instead of the output of every operator. "
            "One full stroke empties it: afterwards the state of the actuator is known.",
        ],
        [
            Figure(
                canvas.data_uri(coupled_play.memory_course(demo.actuator.hysteresis, "V")),
                "Drive in steps, remembered reversals as lines, and their number",
                "Decreasing steps add reversals. Increasing steps erase them in pairs.",
            )
        ],
    )


def _next(directory: Path) -> Section:
    return Section(
        "next",
        "With your own data",
        [
            f"The directory {directory} has stack.json, the stage of the measured stack, and of "
            "the simulated actuator the records, both models, the trajectory and the drive of the "
            "exact inverse. These two commands repeat identification and compensation of the "
            "latter. Replace the files by your own.",
        ],
        [
            Lines(
                "mpi-hyst identify identification.csv --input drive_v --output position_um \\\n"
                "    -o stage.json --report stage.html\n"
                "mpi-hyst precompensate stage.json trajectory.csv -o stage_drive.csv "
                f"--limits {LIMITS[0]:g},{LIMITS[1]:g}"
            )
        ],
    )


def stack_cards(stack: MeasuredStack) -> list[Card]:
    """Return the main results, each with its base."""

    def card(one: Prediction, what: str) -> Card:
        percent = 100 * one.unseen.rms / one.unseen.base
        return Card(
            f"{one.unseen.rms:.3f} µm",
            what,
            f"{percent:.2f} % of {digits(one.unseen.base, 3)} µm, a record that was not fitted",
        )

    return [
        card(stack.modified, "measured: rms error of the model"),
        card(stack.line, "the same, without a model"),
    ]


def stack_section(stack: MeasuredStack) -> Section:
    """Return text, figures and table."""
    header, rows = stack_errors(stack)
    record = stack.unseen
    trace = traces.Trace(
        record.name.replace("_", " "),
        record.u,
        record.y,
        record.time,
        record.skip,
        [
            traces.Curve(one.name, colour, one.output)
            for one, colour in (
                (stack.conventional, canvas.ORANGE),
                (stack.modified, canvas.BLUE),
            )
        ],
        Quantity("voltage_v"),
        Quantity("displacement_um"),
    )
    low, high = STACK_NOISE
    return Section(
        "stack",
        "A measured stack",
        [
            f"Measured, not simulated: {record.source} Models are fitted to one record "
            f"({stack.fitted.description}) and judged by another ({record.description}). The zero "
            "of the position is arbitrary, so each record has its own offset. The first "
            f"{record.skip * record.dt:g} s of both do not count.",
            f"The noise of the sensor is {low:g} to {high:g} µm rms: no model can have a smaller "
            "error. What is above it the model does not have. All sections after this one are "
            "simulated: they show what the mathematics can do, not what a device does.",
        ],
        [
            Figure(
                canvas.data_uri(traces.loops([trace])),
                "Measured and predicted position over drive, and the same minus the straight line",
                "The record to which no model was fitted.",
            ),
            Figure(
                canvas.data_uri(traces.residuals(trace)),
                "Residuals of the record over input, rate and time",
                "Measured minus predicted, of the same record.",
            ),
            Table(
                "Measured position minus model",
                header,
                rows,
                "%: of the base, the peak-to-peak range of the measured position.",
                [index for index, row in enumerate(rows) if row[1] == stack.modified.name],
            ),
        ],
    )


def stack_errors(stack: MeasuredStack) -> tuple[list[str], list[list[str]]]:
    """Return the errors of all models of the measured stack as a table."""
    header = ["record", "model", "max (µm)", "rms (µm)", "max (%)", "rms (%)", "base (µm)"]
    rows = []
    for what, name in (("fitted", stack.fitted.name), ("not fitted", stack.unseen.name)):
        for one in stack.predictions:
            error = one.fitted if what == "fitted" else one.unseen
            micrometres = (f"{value:.3f}" for value in (error.max, error.rms))
            percent = (f"{100 * value / error.base:.2f}" for value in (error.max, error.rms))
            cells = [*micrometres, *percent, digits(error.base)]
            rows.append([f"{name}, {what}", one.name, *cells])
    return header, rows


def model_errors(demo: Demo) -> tuple[list[str], list[list[str]]]:
    """Return the errors of both models as a table."""
    header = ["compared with", "model", "max (nm)", "rms (nm)", "max (%)", "rms (%)", "base (µm)"]
    rows = []
    learned, unseen = demo.records
    for against, record, wanted in (
        ("identification, measured", learned, learned.measured),
        ("validation, measured", unseen, unseen.measured),
        ("validation, true position", unseen, unseen.position),
    ):
        for name, found in (("conventional", demo.conventional), ("modified", demo.modified)):
            error = Error.of(wanted - demo.modelled(found, record), wanted)
            rows.append([against, name, *_cells(error)])
    return header, rows


def tracking_errors(demo: Demo) -> tuple[list[str], list[list[str]]]:
    """Return the errors of all schemes as a table."""
    header = ["drive from", "max (nm)", "rms (nm)", "max (%)", "rms (%)", "base (µm)"]
    return header, [[scheme.name, *_cells(scheme.error)] for scheme in demo.schemes]


def _cells(error: Error) -> list[str]:
    """Format with unit nm and % of the base."""
    of_base = (f"{100 * value / error.base:.3f}" for value in (error.max, error.rms))
    return [_nanometres(error.max), _nanometres(error.rms), *of_base, digits(error.base)]


def _nanometres(micrometres: float) -> str:
    value = 1e3 * micrometres
    return f"{value:.2f}" if value >= 0.005 else f"{value:.0e}"


@dataclass(frozen=True)
class Tracking:
    """The tracking error of one scheme."""

    name: str
    colour: str
    error: Samples


def tracking(
    time: Samples, target: Samples, schemes: Sequence[Tracking], unit: str
) -> canvas.Figure:
    """Draw the target, and the tracking errors of all schemes to one scale."""
    figure = canvas.new_figure(1.5 + 1.35 * len(schemes))
    panels = figure.subplots(
        len(schemes) + 1, 1, sharex=True, height_ratios=(1.3, *(1.0 for _ in schemes))
    )
    kept = canvas.envelope(target)
    panels[0].plot(time[kept], target[kept], color=canvas.INK, linewidth=1.4)
    canvas.dress(panels[0], "target", "", f"position ({unit})")
    extent = 1.12e3 * max(float(np.abs(scheme.error).max()) for scheme in schemes)
    for axes, scheme in zip(panels[1:], schemes, strict=True):
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        error = 1e3 * scheme.error
        kept = canvas.envelope(error)
        axes.plot(time[kept], error[kept], color=scheme.colour, linewidth=1.4)
        axes.set_ylim(-extent, extent)
        largest = float(np.abs(error).max())
        said = f"at most {largest:.1f} nm" if largest >= 0.05 else "rounding errors"
        canvas.dress(axes, f"{scheme.name}: {said}", "", "error (nm)")
    panels[-1].set_xlim(time[0], time[-1])
    panels[-1].set_xlabel("time (s)", fontsize=10, color=canvas.INK)
    return figure


def side_by_side(trace: traces.Trace) -> canvas.Figure:
    """Draw loop, time course and error of each model in a row, as in Fig. 8 to 10 of the paper."""
    figure = canvas.new_figure(2.9 * len(trace.curves) + 0.4)
    panels = figure.subplots(len(trace.curves), 3, sharey="col", squeeze=False)
    time, unit = trace.time, trace.output_quantity.unit
    cloud = canvas.thinned(time.size, traces.CLOUD_POINTS)
    dots: dict[str, Any] = {"color": canvas.MEASURED, "markersize": 3.5, "markeredgewidth": 0}
    dots |= {"rasterized": True, "label": "measured"}
    for (loop, course, error), curve in zip(panels, trace.curves, strict=True):
        line: dict[str, Any] = {"color": curve.colour, "linewidth": 1.0, "label": curve.name}
        for axes, x in ((loop, trace.input), (course, time)):
            axes.plot(x[cloud], trace.measured[cloud], ".", **dots)
            axes.plot(x, curve.output, rasterized=True, **line)
        left = 1e3 * (trace.measured - curve.output)
        kept = canvas.envelope(left)
        error.plot(time[kept], left[kept], color=curve.colour, linewidth=0.7)
        error.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        canvas.dress(loop, curve.name, trace.input_quantity.label, trace.output_quantity.label)
        canvas.dress(course, "time course", trace.time_label, f"position ({unit})")
        canvas.dress(error, "error: measured − model", trace.time_label, "error (nm)")
        for axes in (course, error):
            axes.set_xlim(time[0], time[-1])
    return figure
