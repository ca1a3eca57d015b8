"""The report of a designed drive, to look at before the drive is played."""

from __future__ import annotations

from matplotlib.figure import Figure as Canvas

from mpi_hyst._report import canvas
from mpi_hyst._report.excite.drive import Drive, facts
from mpi_hyst._report.page import Card, Figure, Pairs, Report, Section, render
from mpi_hyst._text import digits


def report(drive: Drive, name: str) -> str:
    """Return the HTML text. `name` is that of the CSV file."""
    pairs = dict(facts(drive))
    cards = [Card(pairs["duration"], "duration"), Card(pairs["range"], "range")]
    cards.append(Card(str(drive.reversals), "reversals"))
    text = [
        "The drive moves from reversal to reversal along straight lines or half cosines. It keeps "
        "the limits and the slew rate."
    ]
    if not drive.demagnetizes:
        count = f"{drive.initialization_samples}"
        cards.append(Card(count, "initialization samples", "give them to identify --skip"))
        text.append(
            "The initialization, on grey, visits both limits. This erases the unknown history of "
            "the actuator. One full cycle follows, then cycles of decreasing amplitude."
        )
    unit = f"{drive.quantity.unit}/s" if drive.quantity.unit else "per second"
    figure = Figure(
        canvas.data_uri(_drive(drive)),
        "The drive over time",
        f"A sample lies on every reversal. Slew rate: at most {digits(drive.slew)} {unit}.",
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
        axes.axvspan(0.0, end, color=canvas.GRID, label="initialization, not fitted", zorder=0)
        canvas.top_legend(figure, axes)
    axes.set_xlim(0.0, drive.seconds[-1])
    canvas.dress(axes, "drive over time", "time (s)", drive.quantity.label)
    return figure
