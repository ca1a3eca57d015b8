"""The section of the demo's report about the measured stack."""

from __future__ import annotations

from mpi_hyst._paper.stack import NOISE, MeasuredStack, Prediction
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas, plots
from mpi_hyst._report.demo.tables import stack_errors
from mpi_hyst._report.page import Card, Figure, Section, Table
from mpi_hyst._text import digits


def cards(stack: MeasuredStack) -> list[Card]:
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


def section(stack: MeasuredStack) -> Section:
    """Return text, figures and table."""
    header, rows = stack_errors(stack)
    record = stack.unseen
    trace = plots.Trace(
        record.name.replace("_", " "),
        record.u,
        record.y,
        record.time,
        record.skip,
        [
            plots.Curve(one.name, colour, one.output)
            for one, colour in (
                (stack.conventional, canvas.ORANGE),
                (stack.modified, canvas.BLUE),
            )
        ],
        Quantity("voltage_v"),
        Quantity("displacement_um"),
    )
    low, high = NOISE
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
                canvas.data_uri(plots.loops([trace])),
                "Measured and predicted position over drive, and the same minus the straight line",
                "The record to which no model was fitted.",
            ),
            Figure(
                canvas.data_uri(plots.residuals(trace)),
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
