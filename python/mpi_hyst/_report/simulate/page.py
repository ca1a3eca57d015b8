"""The report of a simulated run: what was asked, where the stage went, what drove it."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure as Canvas

from mpi_hyst._report import canvas
from mpi_hyst._report.page import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._report.simulate.outcome import Outcome, errors, facts
from mpi_hyst._text import in_unit


def report(outcome: Outcome) -> str:
    """Return the HTML text."""
    setup, metrics, unit = outcome.setup, outcome.run.metrics, outcome.quantity.shown_unit
    rows = facts(outcome)
    named = dict(rows)
    cards = [
        Card(in_unit(metrics.max_position_error, unit, 3), "largest error", "true position"),
        Card(in_unit(metrics.position_rmse, unit, 3), "rms error", "true position"),
        Card(named["drive"], "drive", f"limits {setup.limits[0]:g} to {setup.limits[1]:g}"),
        Card(str(metrics.saturated_count), "samples at a limit", f"of {metrics.samples}"),
    ]
    text = [
        "A simulation: the stage is the model with the dynamics, delay and noise given below. What "
        "the model does not know of a real stage is not in it."
    ]
    figure = Figure(
        canvas.data_uri(_tracking(outcome)),
        "Reference and position, their difference, and the drive over time",
        "The start goes over from rest to the reference, so that the drive does not jump.",
    )
    note = "% of the base: the peak-to-peak of the reference"
    blocks: list[Block] = [
        figure,
        Table("Errors", *errors(outcome), note=note),
        Pairs("Facts", rows),
    ]
    return render(
        Report(
            title=f"Tracking {outcome.quantity.name}",
            subtitle=f"{Path(setup.reference).name} on {Path(setup.model).name}",
            cards=cards,
            sections=[Section("tracking", "Tracking", text, blocks)],
            footer="mpi_hyst.",
        )
    )


def _tracking(outcome: Outcome) -> Canvas:
    run, time = outcome.run, outcome.seconds
    figure = canvas.new_figure(7.2)
    positions, differences, drives = figure.subplots(3, 1, sharex=True)
    kept = canvas.envelope(run.position)
    soft, blue = canvas.SOFT, canvas.BLUE
    positions.plot(time[kept], run.reference[kept], color=soft, linewidth=2.0, label="reference")
    positions.plot(time[kept], run.position[kept], color=blue, linewidth=1.0, label="true position")
    if outcome.setup.noise:
        measured = run.reference - run.measured
        kept = canvas.envelope(measured)
        grey = canvas.MEASURED
        differences.plot(time[kept], measured[kept], color=grey, linewidth=0.6, label="measured")
    missed = run.reference - run.position
    kept = canvas.envelope(missed)
    differences.plot(time[kept], missed[kept], color=blue, linewidth=1.0)
    kept = canvas.envelope(run.drive)
    drives.plot(time[kept], run.drive[kept], color=canvas.ORANGE, linewidth=1.0, label="drive")
    for limit in outcome.setup.limits:
        drives.axhline(limit, color=soft, linewidth=0.8, linestyle="--")
    unit = f" ({outcome.quantity.shown_unit})" if outcome.quantity.unit else ""
    canvas.dress(positions, "reference and position", "", outcome.quantity.label)
    canvas.dress(differences, "what is missed", "", f"error{unit}")
    canvas.dress(drives, "drive, and its limits", "time (s)", "drive")
    drives.set_xlim(time[0], time[-1] if time.size > 1 else outcome.dt)
    canvas.top_legend(figure, positions, differences)
    return figure
