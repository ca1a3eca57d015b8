"""The plan of an experiment on one page: the drives with their segments, and what to do."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from mpi_hyst._report import canvas
from mpi_hyst._report.excite.drive import per_second
from mpi_hyst._report.excite.plan import POSITION, Part, Plan
from mpi_hyst._report.page import Card, Figure, Lines, Report, Section, Table, render
from mpi_hyst._report.provenance import Provenance
from mpi_hyst._text import digits, in_unit

_NAMED = 0.055  # share of the width that a segment needs for its name, or for its number
_NUMBERED = 0.009


def report(plan: Plan, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    unit = plan.quantity.unit
    low, high = plan.limits
    names = [part.name for part in plan.parts]
    return render(
        Report(
            title="Experiment to identify a stage",
            subtitle=f"{', then '.join(names)}: {plan.quantity.label}",
            cards=[
                Card(f"{digits(plan.duration)} s", "duration"),
                Card(f"{digits(low)} to {in_unit(high, unit)}", "limits, both reached"),
                Card(per_second(plan.slew, unit), "slew rate, never exceeded"),
                Card(in_unit(plan.rest, unit), "rest drive", "every file starts and ends there"),
            ],
            sections=[_before(plan), _drives(plan), _after(plan)],
            provenance=provenance,
        )
    )


def _before(plan: Plan) -> Section:
    rest = in_unit(plan.rest, plan.quantity.unit)
    text = [
        f"The actuator must have rested at {rest}, in a known state: the first stroke from rest is "
        "fitted too. Demagnetize it if it was used before, and let it rest for a minute:"
    ]
    return Section("before", "Before", text, [Lines(plan.demagnetize)])


def _drives(plan: Plan) -> Section:
    blocks = [
        Figure(
            canvas.data_uri(figure(plan)),
            "The drives over time, with their segments",
            "Segments by their numbers in the table. Every file starts and ends at the rest drive.",
        )
    ]
    unit = plan.quantity.unit
    tables = [Table(part.title, plan.header, part.rows(unit)) for part in plan.parts]
    text = ["Play the files in this order. Record time, drive and position, at the same rates."]
    return Section("drives", "The drives", text, [*blocks, *tables])


def _after(plan: Plan) -> Section:
    records = " and ".join(part.record for part in plan.parts)
    columns = f"time_s, {plan.quantity.column} and {POSITION}"
    text = [f"With the records as {records}, each with the columns {columns}:"]
    unknown = (
        "If the state before is not known, skip what comes before both limits were reached: "
        f"{_skips(plan)} instead of --skip 0."
    )
    return Section("after", "Then", [*text, unknown], [Lines(plan.identify)])


def _skips(plan: Plan) -> str:
    return " ".join(f"--skip {part.initialization_samples}" for part in plan.fitted)


def figure(plan: Plan) -> Canvas:
    """Draw the drive of each file over time, with its segments."""
    drawn = canvas.new_figure(0.6 + 2.5 * len(plan.parts))
    panels = drawn.subplots(len(plan.parts), 1, squeeze=False)[:, 0]
    for axes, part in zip(panels, plan.parts, strict=True):
        kept = canvas.envelope(part.drive)
        axes.plot(part.seconds[kept], part.drive[kept], color=canvas.BLUE, linewidth=0.9)
        axes.set_xlim(0.0, part.duration)
        canvas.dress(axes, "", "time (s)", plan.quantity.label)
        axes.set_title(canvas.plain(part.name), loc="left", pad=18, fontsize=10.5, weight="bold")
        _name_segments(axes, part)
    return drawn


def _name_segments(axes: Axes, part: Part) -> None:
    """Shade every other segment, and write its number and name above where there is room."""
    for number, segment in enumerate(part.segments, 1):
        start, stop = segment.start / part.rate, segment.stop / part.rate
        if number % 2:
            axes.axvspan(start, stop, color=canvas.GRID, zorder=0)
        share = (stop - start) / part.duration
        if share < _NUMBERED:
            continue
        axes.text(
            0.5 * (start + stop),
            1.02,
            f"{number} {segment.name}" if share >= _NAMED else f"{number}",
            transform=axes.get_xaxis_transform(),
            ha="center",
            fontsize=8.5,
            color=canvas.SOFT,
        )
