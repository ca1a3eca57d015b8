"""The report of a demagnetizing sequence, to look at before it is played."""

from __future__ import annotations

from matplotlib.figure import Figure as Canvas

from mpi_hyst._report import canvas
from mpi_hyst._report.excite.drive import Drive, facts, per_second
from mpi_hyst._report.page import Card, Figure, Pairs, Report, Section, render
from mpi_hyst._report.provenance import Provenance


def report(drive: Drive, name: str, provenance: Provenance = ()) -> str:
    """Return the HTML text. `name` is that of the CSV file."""
    pairs = dict(facts(drive))
    text = [
        "The drive moves from reversal to reversal along straight lines or half cosines. It keeps "
        "the limits and the slew rate."
    ]
    figure = Figure(
        canvas.data_uri(_drive(drive)),
        "The drive over time",
        "A sample lies on every reversal. Slew rate: at most "
        f"{per_second(drive.slew, drive.quantity.unit)}.",
    )
    return render(
        Report(
            title="Demagnetizing sequence",
            subtitle=f"{name}, {drive.quantity.label}",
            cards=[
                Card(pairs["duration"], "duration"),
                Card(pairs["range"], "range"),
                Card(pairs["reversals"].partition(",")[0], "reversals"),
            ],
            sections=[
                Section("drive", "The drive", text, [figure, Pairs("Facts", list(pairs.items()))])
            ],
            provenance=provenance,
        )
    )


def _drive(drive: Drive) -> Canvas:
    figure = canvas.new_figure(3.8)
    axes = figure.subplots()
    kept = canvas.envelope(drive.values)
    axes.plot(drive.seconds[kept], drive.values[kept], color=canvas.BLUE, linewidth=0.9)
    axes.set_xlim(0.0, drive.seconds[-1])
    canvas.dress(axes, "drive over time", "time (s)", drive.quantity.label)
    return figure
