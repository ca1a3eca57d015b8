"""The style of all figures, and their conversion to images in a page.

Figures use matplotlib's object interface: no window, no global state. The colours are from the
palette of Okabe and Ito, which colour-blind readers can distinguish. matplotlib is an extra, so it
is imported where something is drawn, here and in the other files of reports; its types are here.
"""

from __future__ import annotations

import io
import re
import warnings
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from mpi_hyst._text import digits, printable
from mpi_hyst._types import Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure

Values: TypeAlias = npt.NDArray[np.floating[Any]]

MEASURED = "#9aa5b1"
INK = "#1c2733"
SOFT = "#5b6875"
BLUE = "#0072b2"
ORANGE = "#d55e00"
GREEN = "#009e73"
GRID = "#e6eaee"

_WIDTH = 10.0  # inches; at 96 to the inch about the width of the page
_LINE_POINTS = 2400
_OUTSIDE = 0.25  # per cent of the points on either side that need not be on an axis
_FLATTENED = 3.0  # times the range of the others: from there on they are left out
_LONGEST = 60  # characters of a name: longer ones would leave no room for the axes
_DPI = 120
# The same figure gives the same file: no date in it.
_METADATA = {
    "svg": dict.fromkeys(("Date", "Creator", "Format", "Type")),
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
_COORDINATES = re.compile(r"([ML]) (-?\d+\.\d\d)\d* (-?\d+\.\d\d)\d*")


def new_figure(height: float) -> Figure:
    """Return an empty figure as wide as the page."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return Figure(figsize=(_WIDTH, height), layout=ConstrainedLayoutEngine(h_pad=0.08, w_pad=0.06))


def dress(axes: Axes, title: str, x_label: str, y_label: str) -> Axes:
    """Apply the style to a panel, with its title and labels."""
    axes.set_title(plain(title), loc="left", fontsize=10.5, color=INK, fontweight="bold")
    axes.set_xlabel(plain(x_label), fontsize=10, color=INK)
    axes.set_ylabel(plain(y_label), fontsize=10, color=INK)
    axes.tick_params(labelsize=9, colors=SOFT, length=3)
    axes.grid(visible=True, color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(SOFT)
    return axes


def plain(text: str) -> str:
    """Make the name of a file or column safe to draw: no formula, no control character, short."""
    return short(printable(text), _LONGEST).replace("$", r"\$")


def short(text: str, longest: int) -> str:
    """Cut a text that is too long."""
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def legend(axes: Axes, **keywords: Any) -> None:
    """Add a legend without a frame."""
    axes.legend(**{"fontsize": 9, "frameon": False, "labelcolor": INK, **keywords})


def top_legend(figure: Figure, *panels: Axes) -> None:
    """Add one legend for all panels, above them on the left, where a phone begins."""
    handles, labels = [], []
    for axes in panels:
        found = axes.get_legend_handles_labels()
        handles += found[0]
        labels += found[1]
    shown = figure.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=len(labels),
        frameon=False,
        fontsize=9.5,
        labelcolor=INK,
    )
    for line in shown.get_lines():
        size = 14.0 if line.get_marker() == "." else line.get_markersize()
        line.set(linewidth=2.6, markersize=size, alpha=1.0)


def image(figure: Figure, kind: str) -> bytes:
    """Return the figure as svg, png or pdf. The same figure gives the same bytes."""
    import matplotlib as mpl

    content = io.BytesIO()
    # The salt makes the identifiers inside the image repeatable.
    with mpl.rc_context({"svg.hashsalt": "mpi_hyst"}), warnings.catch_warnings():
        # A name in a script that the font lacks is drawn as boxes, which is no reason to warn.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(content, format=kind, dpi=_DPI, metadata=_METADATA[kind])
    return content.getvalue()


def data_uri(figure: Figure) -> str:
    """Return the figure as a self-contained SVG image."""
    import base64

    # Two decimals of a point are enough for a line, and make the file three times smaller.
    short = _COORDINATES.sub(r"\1 \2 \3", image(figure, "svg").decode())
    return "data:image/svg+xml;base64," + base64.b64encode(short.encode()).decode("ascii")


def root(axes: Axes) -> Figure:
    """Return the figure of an axes, also inside a subfigure."""
    from matplotlib.figure import Figure

    found = axes.figure
    while not isinstance(found, Figure):
        found = found.figure
    return found


def shown(values: Samples) -> tuple[float, float]:
    """Return between which values an axis is drawn: all of them, unless few would flatten it.

    Where the range of all is several times that of nearly all, it is the latter with a margin.
    """
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    near, far = (float(end) for end in np.percentile(finite, [_OUTSIDE, 100.0 - _OUTSIDE]))
    if far > near and high - low > _FLATTENED * (far - near):
        margin = 0.5 * (far - near)
        return max(low, near - margin), min(high, far + margin)
    return low, high


def extent(*signals: Samples) -> float:
    """Return how far from zero an axis reaches on both sides, as `shown` says of each signal."""
    reach = (float(np.abs(shown(values)).max()) for values in signals)
    return 1.12 * max(reach, default=0.0) or 1.0


def note_outside(axes: Axes, *signals: Samples) -> None:
    """Say how many points the vertical axis leaves out, and how far the furthest one is."""
    low, high = axes.get_ylim()
    values = np.concatenate([one[np.isfinite(one)] for one in signals])
    outside = values[(values < low) | (values > high)]
    if outside.size == 0:
        return
    furthest = float(outside[np.abs(outside).argmax()])
    text = f"{outside.size} of {values.size} points outside, to {digits(furthest, 3)}"
    axes.text(
        *(0.995, 0.97, text),
        transform=axes.transAxes,
        ha="right",
        va="top",
        fontsize=8.5,
        color=ORANGE,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5},
    )


def thinned(samples: int, points: int) -> slice:
    """Return the slice that keeps about `points` of the samples."""
    return slice(None, None, max(1, -(-samples // points)))


def envelope(values: Values, points: int = _LINE_POINTS) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return the indices of the extremes of every stretch, so that no spike is lost."""
    stretch = max(1, -(-2 * values.size // points))
    if stretch <= 2:
        return np.arange(values.size)
    starts = range(0, values.size, stretch)
    kept = {
        start + int(at) for start in starts for at in _extremes(values[start : start + stretch])
    }
    return np.array(sorted(kept))


def line(axes: Axes, x: Values, y: Values, points: int = _LINE_POINTS, **look: Any) -> None:
    """Draw a line with every spike."""
    kept = envelope(y, points)
    axes.plot(x[kept], y[kept], **look)


def cloud(axes: Axes, x: Values, y: Values, markersize: float, points: int, **look: Any) -> None:
    """Draw about so many of the samples as dots; as pixels, so that the file stays small."""
    some = thinned(x.size, points)
    dots: dict[str, Any] = {"markersize": markersize, "markeredgewidth": 0, "rasterized": True}
    axes.plot(x[some], y[some], ".", **dots, **look)


def _extremes(values: Values) -> tuple[np.intp, np.intp]:
    return values.argmin(), values.argmax()
