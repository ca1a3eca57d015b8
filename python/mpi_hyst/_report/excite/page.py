"""The report of a designed drive: what will be played, to look at before it is."""

from __future__ import annotations

from matplotlib.figure import Figure as Canvas

from mpi_hyst._report import canvas
from mpi_hyst._report.excite.drive import Drive, facts
from mpi_hyst._report.page import Card, Figure, Pairs, Report, Section, render
from mpi_hyst._text import digits


def report(drive: Drive, name: str) -> str:
    """Return the HTML text."""
    pairs = dict(facts(drive))
    cards = [Card(pairs["duration"], "duration"), Card(pairs["range"], "range")]
    cards.append(Card(str(drive.reversals), "reversals"))
    if not drive.demagnetizes:
        cards.append(Card(f"{drive.initialization_samples}", "samples of lead-in", "to be skipped by identify"))
    text = [
        "Straight lines or half cosines from reversal to reversal, never beyond the slew limit."
    ]
    if not drive.demagnetizes:
        text.append(
            "The first strokes, on grey, visit both limits and so make an unknown memory known. "
            "One cycle at full swing follows, then reversals that shrink."
        )
    figure = Figure(
        canvas.data_uri(_drive(drive)),
        "The drive over time",
        f"Every reversal is met by a sample; limits and {digits(drive.slew)} "
        f"{drive.quantity.unit or '1'}/s are kept.",
    )
    section = Section("drive", "The drive", text, [figure, Pairs("Facts", list(pairs.items()))])
    return render(
        Report(
            title=drive.title.capitalize(),
            subtitle=f"{name}, {drive.quantity.label}",
            cards=cards,
            sections=[section],
            footer="mpi_hyst.",
        )
    )


def _drive(drive: Drive) -> Canvas:
    figure = canvas.new_figure(3.8)
    axes = figure.subplots()
    kept = canvas.envelope(drive.values)
    axes.plot(drive.seconds[kept], drive.values[kept], color=canvas.BLUE, linewidth=0.9)
    if drive.initialization_samples:
        end = drive.seconds[drive.initialization_samples]
        axes.axvspan(0.0, end, color=canvas.GRID, label="lead-in, not to be fitted", zorder=0)
        canvas.top_legend(figure, axes)
    axes.set_xlim(0.0, drive.seconds[-1])
    canvas.dress(axes, "drive over time", "time (s)", drive.quantity.label)
    return figure
