"""The report of the demo."""

from __future__ import annotations

from pathlib import Path

from mpi_hyst._paper.demo import (
    LIMITS,
    NOISE,
    RATE,
    Demo,
    Error,
    Measurement,
    exact,
    seconds,
)
from mpi_hyst._paper.stack import MeasuredStack
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, plots, walk, weights
from mpi_hyst._report.demo import figures
from mpi_hyst._report.demo.stack import cards, section
from mpi_hyst._report.demo.tables import model_errors, tracking_errors
from mpi_hyst._report.model_table import model_table
from mpi_hyst._report.page import Card, Figure, Lines, Pairs, Report, Section, Table, render
from mpi_hyst._report.provenance import Provenance
from mpi_hyst._text import digits

_DRIVE = Quantity("drive_v")
_POSITION = Quantity("position_um")
_COLOURS = (canvas.SOFT, canvas.ORANGE, canvas.GREEN, canvas.BLUE, canvas.INK)


def report(stack: MeasuredStack, demo: Demo, directory: Path, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    traces = [_trace(demo, record) for record in demo.records]
    return render(
        Report(
            title="Hysteresis of piezo actuators: model, identification, compensation",
            subtitle="First a measured stack. Then the simulated actuator of Wang, Chen, Zhou and "
            "Bai (2017): Table I with all digits recovered from Table II.",
            cards=[*cards(stack), *_cards(demo)],
            sections=[
                section(stack),
                _operator(),
                _loops(traces),
                _errors(demo),
                _paper(demo, traces[0]),
                _residuals(traces),
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


def _trace(demo: Demo, record: Measurement) -> plots.Trace:
    curves = [
        plots.Curve(name, colour, demo.modelled(found, record))
        for name, colour, found in (
            ("conventional model (plays)", canvas.ORANGE, demo.conventional),
            ("modified model (coupled plays)", canvas.BLUE, demo.modified),
        )
    ]
    return plots.Trace(
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
                canvas.data_uri(walk.walk()),
                "Output z over input x of one operator, and both over the distance travelled",
                "The walk of Fig. 5 of the paper with r = 10, ra = 8, rb = 3, rc = 4 V. At the "
                "corners 0 to 7, x is 0, 20, −20, 15, 6, 25, −15, −5 and z is 0, 10, −12, 5, 5, "
                "15, −7, −7. The result does not depend on the sampling of the moves.",
            )
        ],
    )


def _loops(traces: list[plots.Trace]) -> Section:
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
                canvas.data_uri(plots.loops(traces)),
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


def _paper(demo: Demo, trace: plots.Trace) -> Section:
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
                canvas.data_uri(figures.side_by_side(trace)),
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


def _residuals(traces: list[plots.Trace]) -> Section:
    return Section(
        "residuals",
        "Residuals over input, rate and time",
        [
            "The residual of the modified model is sensor noise. It is the same everywhere. The "
            "residual of the conventional model depends on the input: hysteresis that it lacks.",
        ],
        [
            Figure(
                canvas.data_uri(plots.residuals(trace)),
                f"Residuals of the {trace.name} over input, rate and time",
                f"{trace.name.capitalize()}: measured minus modelled.",
            )
            for trace in traces
        ],
    )


def _model(demo: Demo) -> Section:
    banks = [
        weights.Bank("modified, identified", canvas.BLUE, demo.modified.model),
        weights.Bank("true actuator", canvas.INK, demo.actuator.hysteresis, "D"),
        weights.Bank("conventional, identified", canvas.ORANGE, demo.conventional.model, "s"),
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
                canvas.data_uri(weights.figure(banks, "µm/V", "V")),
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
        figures.Tracking(scheme.name, colour, scheme.position - scheme.target)
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
                canvas.data_uri(figures.tracking(seconds(demo.target), demo.target, shown, "µm")),
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
                canvas.data_uri(figures.memory(demo.actuator.hysteresis, "V")),
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
