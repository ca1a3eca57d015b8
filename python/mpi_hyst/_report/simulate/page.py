"""The report of a simulated run: reference, position, error and drive."""

from __future__ import annotations

from pathlib import Path

from mpi_hyst._report import canvas, course, loop
from mpi_hyst._report.page import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._report.provenance import Rows
from mpi_hyst._report.simulate.simulation import BASE, Setup, Simulation, errors, facts
from mpi_hyst._text import in_unit


def report(simulation: Simulation, provenance: Rows = ()) -> str:
    """Return the HTML text."""
    setup, metrics, unit = simulation.setup, simulation.run.metrics, simulation.quantity.unit
    rows = facts(simulation)
    named = dict(rows)
    cards = [
        Card(in_unit(metrics.max_position_error, unit, 3), "largest error", "true position"),
        Card(in_unit(metrics.position_rmse, unit, 3), "rms error", "true position"),
        Card(named["drive"], "drive", f"limits {setup.limits[0]:g} to {setup.limits[1]:g}"),
        Card(str(metrics.saturated_count), "saturated samples", f"of {metrics.samples}"),
    ]
    text = [
        "This is a simulation. The stage is the hysteresis model with the dynamics, dead time and "
        "noise listed below. Anything else that a real stage does is not included."
    ]
    figure = Figure(
        canvas.data_uri(course.figure(_course(simulation))),
        "Reference and position, error, and drive over time",
        "At the start the controller changes over from rest to the reference without a jump of "
        "the drive.",
    )
    blocks: list[Block] = [
        figure,
        Table("Errors", *errors(simulation), note=f"{BASE}."),
        Pairs("Conditions", rows),
    ]
    return render(
        Report(
            title=f"Simulated tracking of {simulation.quantity.name}",
            subtitle=f"{Path(setup.reference).name} on {Path(setup.stage).name}",
            cards=cards,
            sections=[Section("tracking", "Tracking", text, blocks), *_feedback(setup)],
            provenance=provenance,
        )
    )


def _feedback(setup: Setup) -> list[Section]:
    """Return what the tuned feedback is, if it was tuned."""
    if setup.tuning is None:
        return []
    figure = Figure(
        canvas.data_uri(loop.figure(setup.tuning)),
        "Magnitude and phase of the open loop, and the sensitivity over frequency",
        "The open loop L and the sensitivity 1 / (1 + L) at the least and the greatest slope of "
        "the hysteresis, with the modes as they are known. Dots: crossover. Orange: the worst over "
        "all slopes and modes that may be. Dotted: up to there disturbances are reduced.",
    )
    return [Section("feedback", "Feedback", [setup.tuning.explanation], [figure])]


def _course(simulation: Simulation) -> course.Course:
    return course.Course(
        simulation.run,
        simulation.seconds,
        "time (s)",
        simulation.quantity,
        "drive",
        simulation.setup.limits,
        noise=simulation.setup.noise > 0.0,
    )
