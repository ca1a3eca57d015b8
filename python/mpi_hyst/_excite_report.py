"""The report of a designed drive: what will be played, to look at before it is."""

from __future__ import annotations

from matplotlib.figure import Figure as Canvas

from mpi_hyst import _plots
from mpi_hyst._excite import Drive, Request, facts, title
from mpi_hyst._report import Card, Figure, Pairs, Report, Section, render
from mpi_hyst._tables import digits


def report(drive: Drive, request: Request) -> str:
    """Return the HTML text."""
    pairs = dict(facts(drive, request))
    cards = [Card(pairs["duration"], "duration"), Card(pairs["range"], "range")]
    cards.append(Card(str(drive.reversals), "reversals"))
    if not request.demagnetize:
        cards.append(Card(f"{drive.lead_in}", "samples of lead-in", "to be skipped by identify"))
    text = [
        "Straight lines or half cosines from reversal to reversal, never beyond the slew limit."
    ]
    if not request.demagnetize:
        text.append(
            "The first strokes, on grey, visit both limits and so make an unknown memory known. "
            "One cycle at full swing follows, then reversals that shrink."
        )
    figure = Figure(
        _plots.data_uri(_drive(drive, request)),
        "The drive over time",
        f"Every reversal is met by a sample; limits and {digits(request.slew)} "
        f"{request.quantity.unit or '1'}/s are kept.",
    )
    section = Section("drive", "The drive", text, [figure, Pairs("Facts", list(pairs.items()))])
    return render(
        Report(
            title=title(request).capitalize(),
            subtitle=f"{request.drive_path.name}, {request.quantity.label}",
            cards=cards,
            sections=[section],
            footer="mpi_hyst.",
        )
    )


def _drive(drive: Drive, request: Request) -> Canvas:
    figure = _plots.new_figure(3.8)
    axes = figure.subplots()
    kept = _plots.envelope(drive.values)
    axes.plot(drive.seconds[kept], drive.values[kept], color=_plots.BLUE, linewidth=0.9)
    if drive.lead_in:
        end = drive.seconds[drive.lead_in]
        axes.axvspan(0.0, end, color=_plots.GRID, label="lead-in, not to be fitted", zorder=0)
        _plots.top_legend(figure, axes)
    axes.set_xlim(0.0, drive.seconds[-1])
    _plots.dress(axes, "drive over time", "time (s)", request.quantity.label)
    return figure
