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
from mpi_hyst._report.page import Card, Provenance, Rows, render
from mpi_hyst._text import digits
from mpi_hyst._types import Samples

_DRIVE = Quantity("drive_v")
_POSITION = Quantity("position_um")
_COLOURS = (canvas.SOFT, canvas.ORANGE, canvas.GREEN, canvas.BLUE, canvas.INK)
_COMMANDS = (
    "mpi-hyst identify identification.csv --input drive_v --output position_um \\\n"
    "    -o stage.json --report stage.html\n"
    "mpi-hyst precompensate stage.json trajectory.csv -o stage_drive.csv "
    f"--limits {LIMITS[0]:g},{LIMITS[1]:g}"
)


def report(stack: MeasuredStack, demo: Demo, directory: Path, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    drawn = [_trace(demo, record) for record in demo.records]
    time, errors = seconds(demo.target), model_errors(demo)
    return render(
        "demo.html.j2",
        cards=[*stack_cards(stack), *_cards(demo)],
        provenance=provenance,
        **stack_values(stack),
        demo=demo,
        directory=directory,
        exact=exact(demo),
        noise=NOISE,
        rate=RATE,
        commands=_COMMANDS,
        traces=drawn,
        walk=coupled_play.walk(),
        loops=traces.loops(drawn),
        model_errors=errors,
        best_of_models=[i for i, row in enumerate(errors[1]) if row[1] == "modified"],
        side_by_side=_side_by_side(drawn[0]),
        published_errors=_published_errors(demo),
        residuals=[traces.residuals(trace) for trace in drawn],
        weights=models.weights_figure(_banks(demo), "µm/V", "V"),
        parameters=_parameters(demo),
        model_table=models.model_table(demo.modified.model, "µm/V", "V"),
        tracking=_tracking(time, demo.target, _followed(demo), "µm"),
        tracking_errors=tracking_errors(demo),
        memory=coupled_play.memory_course(demo.actuator.hysteresis, "V"),
    )


def stack_values(stack: MeasuredStack) -> dict[str, Any]:
    """Return what the section about the measured stack shows."""
    record, errors = stack.unseen, stack_errors(stack)
    colours = ((stack.conventional, canvas.ORANGE), (stack.modified, canvas.BLUE))
    trace = traces.Trace(
        record.name.replace("_", " "),
        *(record.u, record.y, record.time, record.skip),
        [traces.Curve(one.name, colour, one.output) for one, colour in colours],
        *(Quantity("voltage_v"), Quantity("displacement_um")),
    )
    return {
        "stack": stack,
        "stack_noise": STACK_NOISE,
        "stack_loops": traces.loops([trace]),
        "stack_residuals": traces.residuals(trace),
        "stack_errors": errors,
        "best_of_stack": [i for i, row in enumerate(errors[1]) if row[1] == stack.modified.name],
    }


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


def _published_errors(demo: Demo) -> Rows:
    """Return the errors of Fig. 8 to 10, here and as printed."""
    header = ["model", "max (% of range)", "max (% of amplitude)", "mse (µm²)"]
    header += ["published max (%)", "published “MSE”"]
    rows = []
    for name, found, printed in (
        ("conventional", demo.conventional, ("5.31", "0.014")),
        ("modified", demo.modified, ("1.02", "0.002")),
    ):
        quality = found.fit
        percents = (quality.max_error_percent, quality.max_error_percent_of_amplitude)
        rows.append([name, *(f"{one:.2f}" for one in percents), digits(quality.mse, 2), *printed])
    return header, rows


def _banks(demo: Demo) -> list[models.Bank]:
    return [
        models.Bank("modified, identified", canvas.BLUE, demo.modified.model),
        models.Bank("true actuator", canvas.INK, demo.actuator.hysteresis, "D"),
        models.Bank("conventional, identified", canvas.ORANGE, demo.conventional.model, "s"),
    ]


def _parameters(demo: Demo) -> list[tuple[str, str]]:
    found, true = demo.modified, demo.actuator.hysteresis
    ratios = ", ".join(f"{ratio:.4f}" for ratio in found.ratios)
    first = [1e3 * model.weights[0] for model in (found.model, true)]
    return [
        ("ratios ra/r, rb/r, rc/r", f"{ratios}  (true 0.95, 0.30, 0.35)"),
        ("input offset", f"{found.model.input_offset:.3f} V  (true 0)"),
        ("output offset", f"{1e3 * found.model.output_offset:.2f} nm  (true 0)"),
        ("dead time", f"{1e3 * (found.dead_time or 0.0):.4f} ms  (true 0)"),
        ("first weight", f"{first[0]:.4f} nm/V  (true {first[1]:.4f})"),
    ]


def _followed(demo: Demo) -> list[Tracking]:
    return [
        Tracking(scheme.name, colour, scheme.position - scheme.target)
        for scheme, colour in zip(demo.schemes, _COLOURS, strict=True)
    ]


def stack_errors(stack: MeasuredStack) -> Rows:
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


def model_errors(demo: Demo) -> Rows:
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


def tracking_errors(demo: Demo) -> Rows:
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


def _tracking(
    time: Samples, target: Samples, schemes: Sequence[Tracking], unit: str
) -> canvas.Figure:
    """Draw the target, and the tracking errors of all schemes to one scale."""
    figure = canvas.new_figure(1.5 + 1.35 * len(schemes))
    panels = figure.subplots(
        len(schemes) + 1, 1, sharex=True, height_ratios=(1.3, *(1.0 for _ in schemes))
    )
    canvas.line(panels[0], time, target, color=canvas.INK, linewidth=1.4)
    canvas.dress(panels[0], "target", "", f"position ({unit})")
    extent = 1.12e3 * max(float(np.abs(scheme.error).max()) for scheme in schemes)
    for axes, scheme in zip(panels[1:], schemes, strict=True):
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        error = 1e3 * scheme.error
        canvas.line(axes, time, error, color=scheme.colour, linewidth=1.4)
        axes.set_ylim(-extent, extent)
        largest = float(np.abs(error).max())
        said = f"at most {largest:.1f} nm" if largest >= 0.05 else "rounding errors"
        canvas.dress(axes, f"{scheme.name}: {said}", "", "error (nm)")
    panels[-1].set_xlim(time[0], time[-1])
    panels[-1].set_xlabel("time (s)", fontsize=10, color=canvas.INK)
    return figure


def _side_by_side(trace: traces.Trace) -> canvas.Figure:
    """Draw loop, time course and error of each model in a row, as in Fig. 8 to 10 of the paper."""
    figure = canvas.new_figure(2.9 * len(trace.curves) + 0.4)
    panels = figure.subplots(len(trace.curves), 3, sharey="col", squeeze=False)
    time, unit = trace.time, trace.output_quantity.unit
    dots: dict[str, Any] = {"color": canvas.MEASURED, "label": "measured"}
    for (loop, course, error), curve in zip(panels, trace.curves, strict=True):
        line: dict[str, Any] = {"color": curve.colour, "linewidth": 1.0, "label": curve.name}
        for axes, x in ((loop, trace.input), (course, time)):
            canvas.cloud(axes, x, trace.measured, 3.5, traces.CLOUD_POINTS, **dots)
            axes.plot(x, curve.output, rasterized=True, **line)
        left = 1e3 * (trace.measured - curve.output)
        canvas.line(error, time, left, color=curve.colour, linewidth=0.7)
        error.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
        canvas.dress(loop, curve.name, trace.input_quantity.label, trace.output_quantity.label)
        canvas.dress(course, "time course", trace.time_label, f"position ({unit})")
        canvas.dress(error, "error: measured − model", trace.time_label, "error (nm)")
        for axes in (course, error):
            axes.set_xlim(time[0], time[-1])
    return figure
