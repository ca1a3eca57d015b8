"""Figures on matplotlib axes, in the style of the reports. They need `mpi_hyst[report]`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from mpi_hyst._core import LoopReport, Tuning

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["realtime", "tuning"]


def tuning(tuning: Tuning, axes: Sequence[Axes] | None = None) -> Figure:
    """Draw the loop of a tuning: Bode diagram of the open loop, and the sensitivity.

    The open loop L and the sensitivity S = 1 / (1 + L) are shown at the least and the greatest
    slope of the hysteresis, with the modes as they are known. Dots are the crossovers. Below, the
    worst abs(S) over all slopes and all modes that may be stays under the dashed line, the peak
    that was allowed. The dotted line is the bandwidth of rejection.

    Parameters
    ----------
    tuning : control.Tuning
        Made by `control.tune` or `Stage.tune`.
    axes : sequence of three matplotlib axes, optional
        For magnitude and phase of L, and the magnitude of S; by default those of a new figure.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the one of the first axes.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    TypeError, ValueError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> figure = mh.plot.tuning(mh.control.tune(mh.paper.plant("A1")))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['|L|', 'degrees', '|S|']

    """
    if not isinstance(tuning, Tuning):
        raise TypeError(f"tuning: expected a Tuning, got {tuning!r}")
    try:
        from mpi_hyst._report import canvas, loop
    except ModuleNotFoundError as error:
        raise ImportError(f"a plot needs {error.name}: pip install 'mpi_hyst[report]'") from error
    if axes is None:
        return loop.figure(tuning)
    panels = _three(axes)
    loop.draw(tuning, panels)
    canvas.legend(panels[2])
    return loop.root(panels[0])


def realtime(report: LoopReport, axes: Sequence[Axes] | None = None) -> Figure:
    """Draw how late and how long the samples of a loop in real time were, and how far apart.

    Histograms with logarithmic axes; the dashed line is the time that 99.9 % did not exceed.

    Parameters
    ----------
    report : realtime.LoopReport
        Made by `realtime.run`.
    axes : sequence of three matplotlib axes, optional
        For latency, computing time and period; by default those of a new figure.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the one of the first axes.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    TypeError, ValueError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> stage = mh.paper.plant("A1").stage
    >>> plant = mh.plant.Plant(stage, dt=1e-3)
    >>> rest = {"rest_drive": 0.0, "rest_rate": 5e3}
    >>> report = mh.realtime.run(stage, plant, [0.5], rate=1000, seconds=0.1, **rest)
    >>> figure = mh.plot.realtime(report)
    >>> [axes.get_title(loc="left").split(":")[0] for axes in figure.axes]
    ['latency', 'compute', 'period']

    """
    if not isinstance(report, LoopReport):
        raise TypeError(f"report: expected a LoopReport, got {report!r}")
    try:
        from mpi_hyst._report import latency, loop
    except ModuleNotFoundError as error:
        raise ImportError(f"a plot needs {error.name}: pip install 'mpi_hyst[report]'") from error
    if axes is None:
        return latency.figure(report)
    panels = _three(axes)
    latency.draw(report, panels)
    return loop.root(panels[0])


def _three(axes: Sequence[Axes]) -> list[Axes]:
    """Return three axes, or say what is wrong with them."""
    from matplotlib.axes import Axes as Drawn

    if not isinstance(axes, Iterable):
        raise TypeError(f"axes: expected three matplotlib axes, got {axes!r}")
    panels = list(axes)
    if len(panels) != 3:
        raise ValueError(f"axes: expected three axes, got {len(panels)}")
    for i, panel in enumerate(panels):
        if not isinstance(panel, Drawn):
            raise TypeError(f"axes[{i}]: expected matplotlib axes, got {panel!r}")
    return panels
