"""Figures of feedback and of closed loops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mpi_hyst._core import LoopReport, Run, Tuning
from mpi_hyst.plot._arguments import Units, drawing, expect, interval, panels, quantities

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
    expect("tuning", tuning, (Tuning,))
    with drawing():
        from mpi_hyst._report import canvas, loop
    if axes is None:
        return loop.figure(tuning)
    drawn = panels(axes, 3)
    loop.draw(tuning, drawn)
    canvas.legend(drawn[2])
    return canvas.root(drawn[0])


def run(
    run: Run,
    *,
    dt: float | None = None,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw a closed loop: reference and position, the error, and the drive with its limits.

    Triangles mark what happened: samples with the drive at a limit, and samples without a reading.
    The legend has their number. Where few points would flatten the error, they are left out of its
    axis, and their number is in the figure.

    Parameters
    ----------
    run : plant.Run
        Made by `Stage.simulate` or `plant.simulate`, or from a record of your own.
    dt : float, optional
        Sampling interval in seconds; without it samples are counted.
    units : (str, str), optional
        Of drive and position.
    axes : sequence of three matplotlib axes, optional
        For positions, errors and drive; by default those of a new figure.

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
    >>> target = mh.signals.sine(2.5, 10.0, seconds=0.3, rate=1e4)
    >>> run = mh.paper.plant("A1").stage.simulate(target, dt=1e-4)
    >>> figure = mh.plot.run(run, dt=1e-4, units=("V", "um"))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['position (µm)', 'error (µm)', 'drive (V)']

    """
    expect("run", run, (Run,))
    with drawing():
        from mpi_hyst._report import canvas, course
    known = interval(dt)
    time = np.arange(len(run), dtype=np.float64) * (known or 1.0)
    drive, position = quantities(units)
    label = "sample" if known is None else "time (s)"
    noise = course.is_noisy(run)
    made = course.Course(run, time, label, position, drive.label, run.limits, noise=noise)
    if axes is None:
        return course.figure(made)
    drawn = panels(axes, 3)
    course.draw(made, drawn)
    for panel in drawn:
        canvas.legend(panel)
    return canvas.root(drawn[0])


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
    expect("report", report, (LoopReport,))
    with drawing():
        from mpi_hyst._report import canvas, latency
    if axes is None:
        return latency.figure(report)
    drawn = panels(axes, 3)
    latency.draw(report, drawn)
    return canvas.root(drawn[0])
