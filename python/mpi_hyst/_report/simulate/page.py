"""The report of a simulated run: reference, position, error and drive."""

from __future__ import annotations

from mpi_hyst._report import canvas, course, loop
from mpi_hyst._report.page import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._report.provenance import Provenance
from mpi_hyst._report.simulate.simulation import BASE, Setup, Simulation, errors, facts
from mpi_hyst._text import in_unit

_SIMULATED = (
    "This is a simulation. The stage is the hysteresis model with the dynamics, dead time and "
    "noise listed below. Anything else that a real stage does is not included."
)
_START = (
    "At the start the controller changes over from rest to the reference without a jump of the "
    "drive."
)
_LED_IN = (
    "A lead-in from rest goes before. It is not shown, and counts neither in the errors nor as "
    "saturated."
)


def report(simulation: Simulation, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    run, setup, unit = simulation.run, simulation.setup, simulation.quantity.unit
    metrics, limits = run.metrics, _limits(simulation)
    volts = simulation.drive_unit
    bounds = f"limits {limits[0]:g} to {limits[1]:g} {volts}".rstrip() if limits else ""
    rows = facts(simulation)
    named = dict(rows)
    cards = [
        Card(in_unit(metrics.max_position_error, unit, 3), "largest error", "true position"),
        Card(in_unit(metrics.position_rmse, unit, 3), "rms error", "true position"),
        Card(named["drive"], "drive", bounds),
        Card(str(metrics.saturated_count), "saturated samples", f"of {metrics.samples}"),
    ]
    text = [] if setup is None else [_SIMULATED]
    figure = Figure(
        canvas.data_uri(course.figure(_course(simulation))),
        "Reference and position, error, and drive over time",
        "" if setup is None else _LED_IN if simulation.lead_in_samples else _START,
    )
    blocks: list[Block] = [
        figure,
        Table("Errors", *errors(simulation), note=f"{BASE}."),
        Pairs("Conditions", rows),
    ]
    return render(
        Report(
            title=f"{'Tracking' if setup is None else 'Simulated tracking'} of "
            f"{simulation.quantity.name}",
            subtitle=simulation.name,
            cards=cards,
            sections=[Section("tracking", "Tracking", text, blocks), *_feedback(setup)],
            provenance=provenance,
        )
    )


def _limits(simulation: Simulation) -> tuple[float, float] | None:
    return simulation.run.limits if simulation.setup is None else simulation.setup.limits


def _feedback(setup: Setup | None) -> list[Section]:
    """Return what the tuned feedback is, if it was tuned."""
    if setup is None or setup.tuning is None:
        return []
    figure = Figure(
        canvas.data_uri(loop.figure(setup.tuning)),
        "Magnitude and phase of the open loop, and the sensitivity over frequency",
        "The open loop L and the sensitivity 1 / (1 + L) at the smallest and the largest slope "
        "of the hysteresis, with the modes as they are known. Dots: crossover. Orange: the worst "
        "over all slopes and uncertain modes. Dotted: up to there disturbances are reduced.",
    )
    return [Section("feedback", "Feedback", [setup.tuning.explanation], [figure])]


def _course(simulation: Simulation) -> course.Course:
    run, setup = simulation.run, simulation.setup
    return course.Course(
        run,
        simulation.seconds[simulation.lead_in_samples :],
        "time (s)",
        simulation.quantity,
        simulation.drive,
        _limits(simulation),
        noise=course.is_noisy(run) if setup is None else setup.noise > 0.0,
    )
