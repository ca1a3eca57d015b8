"""The report of a tracked reference: what was asked, where the stage went, what drove it."""

from __future__ import annotations

from matplotlib.figure import Figure as Canvas

from mpi_hyst import _plots
from mpi_hyst._report import Block, Card, Figure, Pairs, Report, Section, Table, render
from mpi_hyst._tables import in_unit
from mpi_hyst._track import Request, Tracked, errors, facts


def report(tracked: Tracked, request: Request) -> str:
    """Return the HTML text."""
    metrics, unit = tracked.run.metrics, tracked.quantity.shown_unit
    rows = facts(tracked, request)
    named = dict(rows)
    cards = [
        Card(in_unit(metrics.max_position_error, unit, 3), "largest error", "true position"),
        Card(in_unit(metrics.rms_position_error, unit, 3), "rms error", "true position"),
        Card(named["drive"], "drive", f"limits {request.limits[0]:g} to {request.limits[1]:g}"),
        Card(str(metrics.saturated), "samples at a limit", f"of {metrics.samples}"),
    ]
    text = [
        "A simulation: the stage is the model with the dynamics, delay and noise given below. What "
        "the model does not know of a real stage is not in it."
    ]
    figure = Figure(
        _plots.data_uri(_tracking(tracked, request)),
        "Reference and position, their difference, and the drive over time",
        "The start goes over from rest to the reference, so that the drive does not jump.",
    )
    note = "% of the base: the peak-to-peak of the reference"
    blocks: list[Block] = [
        figure,
        Table("Errors", *errors(tracked), note=note),
        Pairs("Facts", rows),
    ]
    return render(
        Report(
            title=f"Tracking {tracked.quantity.name}",
            subtitle=f"{request.trajectory.name} on {request.model_path.name}",
            cards=cards,
            sections=[Section("tracking", "Tracking", text, blocks)],
            footer="mpi_hyst.",
        )
    )


def _tracking(tracked: Tracked, request: Request) -> Canvas:
    run, time = tracked.run, tracked.seconds
    figure = _plots.new_figure(7.2)
    positions, differences, drives = figure.subplots(3, 1, sharex=True)
    kept = _plots.envelope(run.position)
    soft, blue = _plots.SOFT, _plots.BLUE
    positions.plot(time[kept], run.reference[kept], color=soft, linewidth=2.0, label="reference")
    positions.plot(time[kept], run.position[kept], color=blue, linewidth=1.0, label="true position")
    if request.noise:
        measured = run.reference - run.measured
        kept = _plots.envelope(measured)
        grey = _plots.MEASURED
        differences.plot(time[kept], measured[kept], color=grey, linewidth=0.6, label="measured")
    missed = run.reference - run.position
    kept = _plots.envelope(missed)
    differences.plot(time[kept], missed[kept], color=blue, linewidth=1.0)
    kept = _plots.envelope(run.drive)
    drives.plot(time[kept], run.drive[kept], color=_plots.ORANGE, linewidth=1.0, label="drive")
    for limit in request.limits:
        drives.axhline(limit, color=soft, linewidth=0.8, linestyle="--")
    unit = f" ({tracked.quantity.shown_unit})" if tracked.quantity.unit else ""
    _plots.dress(positions, "reference and position", "", tracked.quantity.label)
    _plots.dress(differences, "what is missed", "", f"error{unit}")
    _plots.dress(drives, "drive, and its limits", "time (s)", "drive")
    drives.set_xlim(time[0], time[-1] if time.size > 1 else tracked.dt)
    _plots.top_legend(figure, positions, differences)
    return figure
