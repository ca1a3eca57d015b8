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
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, plots, walk
from mpi_hyst._report.demo import figures
from mpi_hyst._report.demo.tables import model_errors, tracking_errors
from mpi_hyst._report.model_table import model_table
from mpi_hyst._report.page import Card, Figure, Lines, Pairs, Report, Section, Table, render
from mpi_hyst._text import digits

_DRIVE = Quantity("drive_v")
_POSITION = Quantity("position_um")
_COLOURS = (canvas.SOFT, canvas.ORANGE, canvas.GREEN, canvas.BLUE, canvas.INK)


def report(demo: Demo, directory: Path) -> str:
    """Return the HTML text."""
    traces = [_trace(demo, record) for record in demo.records]
    return render(
        Report(
            title="Hysteresis of a piezo actuator: modelled, identified, cancelled",
            subtitle="The whole chain of mpi_hyst on the simulated actuator of Wang, Chen, Zhou "
            "and Bai (2017), Table I with all digits recovered.",
            cards=_cards(demo),
            sections=[
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
            footer="mpi_hyst demo. Simulated at "
            f"{RATE / 1000:g} kHz with {1e3 * NOISE:g} nm rms sensor noise, repeatable: the same "
            "seed every time. Each percentage has its base beside it. Method: G. Wang, G. Chen, "
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
            "rms model error on the unseen record",
            f"{1e2 * error.rms / error.base:.3f} % of {digits(error.base, 3)} µm, true position",
        ),
        Card(
            f"{1e3 * other.rms:.1f} nm",
            "the same, conventional model",
            f"{1e2 * other.rms / other.base:.3f} % of {digits(other.base, 3)} µm",
        ),
        Card(
            f"{1e3 * followed.max:.1f} nm",
            "largest tracking error, exact inverse",
            f"{1e2 * followed.max / followed.base:.3f} % of the "
            f"{digits(followed.base, 3)} µm stroke",
        ),
        Card(
            f"{1e3 * line.max:.0f} nm",
            "the same without a model",
            f"{1e2 * line.max / line.base:.2f} % of the {digits(line.base, 3)} µm stroke",
        ),
    ]


def _operator() -> Section:
    return Section(
        "operator",
        "The coupled-play operator",
        [
            "A model is a weighted sum of operators. Each follows its input with a lag; a coupled "
            "play lags by one distance above zero and by another below it, rising and falling, and "
            "sticks at zero in between. Four thresholds r, ra, rb, rc make loops that are "
            "asymmetric and pinched, as those of a piezo stack are.",
        ],
        [
            Figure(
                canvas.data_uri(walk.walk()),
                "Output z over input x of one operator along a walk, and both over the way",
                "The walk of Fig. 5 of the paper with r = 10, ra = 8, rb = 3, rc = 4: x goes to "
                "0, 20, −20, 15, 6, 25, −15, −5 (corners 0 to 7), z to 0, 10, −12, 5, 5, 15, −7, "
                "−7. How finely a move is sampled makes no difference.",
            )
        ],
    )


def _loops(traces: list[plots.Trace]) -> Section:
    return Section(
        "loops",
        "Loops measured and modelled",
        [
            "Both models are fitted to a decaying triangle and then judged on a record they have "
            "not seen, with several amplitudes and minor loops. Below, the same without the "
            "straight line through the measured points, which would hide the differences.",
        ],
        [
            Figure(
                canvas.data_uri(plots.loops(traces)),
                "Position over drive, measured and modelled, and the same without the line",
                "The measured loops are pinched near zero. The conventional model cannot be, and "
                "cuts across; the modified one follows.",
            )
        ],
    )


def _errors(demo: Demo) -> Section:
    header, rows = model_errors(demo)
    return Section(
        "errors",
        "Errors of the models",
        [
            f"The sensor noise alone is {1e3 * NOISE:g} nm rms: against the measured output no "
            "model can do better. The last two rows leave the noise out.",
        ],
        [
            Table(
                "Measured or true position minus model",
                _shown(header),
                rows,
                "% of the base: peak-to-peak of the measured or true position.",
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
        "As in Fig. 8 to 10 of the paper",
        [
            "Each model fitted to the same record: the loop, the time course and the error, the "
            "conventional model above the modified one. The error of the conventional model has "
            "the shape of the loops; that of the modified one is noise.",
            "The paper prints a largest error of 5.31 % for the conventional model and 1.02 % for "
            "the modified one. Both depend on data that are not published, and their base is not "
            "given, so they stand here for comparison only and are not reproduced: on this record, "
            "from the published actuator, the conventional model errs "
            f"{conventional.max_error_percent:.2f} % of the range at most, which is "
            f"{conventional.max_error_percent_of_amplitude:.2f} % of the amplitude.",
        ],
        [
            Figure(
                canvas.data_uri(figures.side_by_side(trace)),
                "Loop, time course and error of the conventional and the modified model",
                f"{trace.name.capitalize()}, to the same scales above and below.",
            ),
            Table(
                "Largest error and mean square error, here and as printed",
                [
                    "model",
                    "max (% of range)",
                    "max (% of amplitude)",
                    "mse (µm²)",
                    "printed max (%)",
                    "printed “MSE”",
                ],
                cells,
                "Range: peak-to-peak of the measured output; amplitude: half of it. The printed "
                "mean square errors can only be in µm².",
            ),
        ],
    )


def _shown(header: list[str]) -> list[str]:
    """Write units as people do: max nm becomes max (nm)."""
    units = {"nm": "nm", "%": "%", "um": "µm"}
    words = [name.rpartition(" ") for name in header]
    return [
        f"{name} ({units[unit]})" if unit in units else whole
        for whole, (name, _, unit) in zip(header, words, strict=True)
    ]


def _residuals(traces: list[plots.Trace]) -> Section:
    return Section(
        "residuals",
        "Residuals over input, speed and time",
        [
            "The residual of the modified model is the sensor noise, the same everywhere. That of "
            "the conventional model bends with the input: hysteresis it does not have.",
        ],
        [
            Figure(
                canvas.data_uri(plots.residuals(trace)),
                f"Residuals of the {trace.name} over input, speed and time",
                f"{trace.name.capitalize()}: measured minus modelled.",
            )
            for trace in traces
        ],
    )


def _model(demo: Demo) -> Section:
    banks = [
        plots.Bank("modified, identified", canvas.BLUE, demo.modified.model),
        plots.Bank("true actuator", canvas.INK, demo.actuator, "D"),
        plots.Bank("conventional, identified", canvas.ORANGE, demo.conventional.model, "s"),
    ]
    found = ", ".join(f"{ratio:.4f}" for ratio in demo.modified.ratios)
    first = 1e3 * demo.modified.model.weights[0]
    pairs = [
        ("ratios ra/r, rb/r, rc/r", f"{found}  (true 0.95, 0.30, 0.35)"),
        ("input offset", f"{demo.modified.model.input_offset:.3f} V  (true 0)"),
        ("output offset", f"{1e3 * demo.modified.model.output_offset:.2f} nm  (true 0)"),
        ("delay", f"{demo.modified.delay:.3f} samples  (true 0)"),
        ("first weight", f"{first:.4f} nm/V  (true {1e3 * demo.actuator.weights[0]:.4f})"),
    ]
    return Section(
        "model",
        "Weights and thresholds",
        [
            "Single weights of neighbouring operators are hard to tell apart under noise, but "
            "their running sum, the slope of the first loading curve, falls on the true one. The "
            "thresholds come back through three ratios.",
        ],
        [
            Figure(
                canvas.data_uri(plots.weights(banks, "µm/V", "V")),
                "Weights, their running sum, and thresholds, identified and true",
                "The first weight, at threshold zero, is left out of the first panel.",
            ),
            Pairs("Parameters of the modified model, identified", pairs),
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
        "Hysteresis cancelled",
        [
            "The true actuator is driven open loop, without a sensor, along a full stroke and "
            "then minor moves. The parametric inverse of the paper is only nearly an inverse. The "
            "exact one, sample by sample, leaves what the identified model does not know: "
            f"{1e3 * followed.max:.1f} nm at most, against {1e3 * table_2.max:.1f} nm with Table "
            "II, which has the true weights. With the true model only rounding is left.",
        ],
        [
            Figure(
                canvas.data_uri(figures.tracking(seconds(demo.target), demo.target, shown, "µm")),
                "Target over time and the tracking error of every scheme, to one scale",
                "All errors to one scale.",
            ),
            Table(
                "Position minus target",
                _shown(header),
                rows,
                "% of the base: peak-to-peak of the target.",
                [len(rows) - 2],
            ),
        ],
    )


def _memory(demo: Demo) -> Section:
    return Section(
        "memory",
        "The turning-point memory",
        [
            "All that a model remembers of its past is a stack of reversals. A move inside the "
            "last one adds to the stack; a move beyond a reversal wipes it out, and all since. "
            "The library keeps this stack instead of every operator's output. One full stroke "
            "empties it: after that the state of an actuator is known, whatever came before.",
        ],
        [
            Figure(
                canvas.data_uri(figures.memory(demo.actuator, "V")),
                "Drive in a staircase, its remembered reversals as lines, and how many there are",
                "Moves that shrink build the stack up; moves that grow take it down in pairs.",
            )
        ],
    )


def _next(directory: Path) -> Section:
    return Section(
        "next",
        "The same with your data",
        [
            f"Beside this report in {directory}: the records, both models, the trajectory and the "
            "drive of the exact inverse. Two commands repeat the chain on these files; put your "
            "own in their place.",
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
