"""The figure of a record: its loop, and drive and position over time."""

from __future__ import annotations

import io
import warnings

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._types import Samples

_DPI = 120
_LOOP_POINTS = 100_000  # drawn as pixels: their number does not change the size of the file
# The same record gives the same file: no date in it.
_METADATA = {
    "svg": dict.fromkeys(("Date", "Creator", "Format", "Type")),
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}


def image(figure: Figure, kind: str) -> bytes:
    """Return the figure as svg, png or pdf."""
    content = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "mpi_hyst"}), warnings.catch_warnings():
        # A name in a script that the font lacks is drawn as boxes, which is no reason to warn.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(content, format=kind, dpi=_DPI, metadata=_METADATA[kind])
    return content.getvalue()


def record(
    name: str,
    drive: tuple[Quantity, Samples],
    position: tuple[Quantity, Samples],
    seconds: Samples | None,
) -> Figure:
    """Draw position over drive, and both over time."""
    figure = canvas.new_figure(5.6)
    panels = figure.subplot_mosaic([["loop", "drive"], ["loop", "position"]])
    cloud = canvas.thinned(drive[1].size, _LOOP_POINTS)
    panels["loop"].plot(
        drive[1][cloud], position[1][cloud], color=canvas.BLUE, linewidth=0.8, rasterized=True
    )
    canvas.dress(panels["loop"], name, drive[0].label, position[0].label)
    time = np.arange(drive[1].size, dtype=float) if seconds is None else seconds
    label = "sample" if seconds is None else "time (s)"
    _trace(panels["drive"], "drive over time", label, time, drive, canvas.BLUE)
    _trace(panels["position"], "position over time", label, time, position, canvas.ORANGE)
    return figure


def several(name: str, columns: dict[str, tuple[Quantity, Samples]]) -> Figure:
    """Draw columns over their samples, where drive and position are not known."""
    figure = canvas.new_figure(1.0 + 2.0 * len(columns))
    panels = figure.subplots(len(columns), 1, squeeze=False)[:, 0]
    for axes, (quantity, values) in zip(panels, columns.values(), strict=True):
        time = np.arange(values.size, dtype=float)
        _trace(axes, name, "sample", time, (quantity, values), canvas.BLUE)
    return figure


def _trace(
    axes: Axes, title: str, label: str, time: Samples, column: tuple[Quantity, Samples], colour: str
) -> None:
    quantity, values = column
    kept = canvas.envelope(values)
    axes.plot(time[kept], values[kept], color=colour, linewidth=0.9)
    canvas.dress(axes, title, label, quantity.label)
