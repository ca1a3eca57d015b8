"""The report of a simulated run: reference, position, error and drive."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure as Canvas

from mpi_hyst._report import canvas, loop
from mpi_hyst._report.page import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._report.simulate.simulation import BASE, Setup, Simulation, errors, facts
from mpi_hyst._text import in_unit


def report(simulation: Simulation) -> str:
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
        canvas.data_uri(_figure(simulation)),
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
            footer="mpi_hyst.",
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


def _figure(simulation: Simulation) -> Canvas:
    run, time = simulation.run, simulation.seconds
    figure = canvas.new_figure(7.2)
    positions, errors_over_time, drives = figure.subplots(3, 1, sharex=True)
    kept = canvas.envelope(run.position)
    soft, blue = canvas.SOFT, canvas.BLUE
    positions.plot(time[kept], run.reference[kept], color=soft, linewidth=2.0, label="reference")
    positions.plot(time[kept], run.position[kept], color=blue, linewidth=1.0, label="true position")
    if simulation.setup.noise:
        measured = run.reference - run.measured
        kept = canvas.envelope(measured)
        errors_over_time.plot(
            time[kept], measured[kept], color=canvas.MEASURED, linewidth=0.6, label="measured"
        )
    error = run.reference - run.position
    kept = canvas.envelope(error)
    errors_over_time.plot(time[kept], error[kept], color=blue, linewidth=1.0)
    kept = canvas.envelope(run.drive)
    drives.plot(time[kept], run.drive[kept], color=canvas.ORANGE, linewidth=1.0, label="drive")
    for limit in simulation.setup.limits:
        drives.axhline(limit, color=soft, linewidth=0.8, linestyle="--")
    canvas.dress(positions, "reference and position", "", simulation.quantity.label)
    canvas.dress(
        errors_over_time,
        "error: reference − position",
        "",
        f"error{simulation.quantity.in_parentheses}",
    )
    canvas.dress(drives, "drive and its limits", "time (s)", "drive")
    drives.set_xlim(time[0], time[-1] if time.size > 1 else simulation.dt)
    canvas.top_legend(figure, positions, errors_over_time)
    return figure
