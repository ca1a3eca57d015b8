"""Figures of what identification found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from mpi_hyst._core import Identification
from mpi_hyst._report.shown import Shown
from mpi_hyst.plot._arguments import (
    Units,
    drawing,
    expect,
    expect_shown,
    modelled,
    panels,
    quantities,
    samples,
    skipped,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def residuals(
    model: Shown,
    u: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    record: int | None = None,
    skip: int = 0,
    dt: float | None = None,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw measured minus modelled position over the drive, over its rate, and over time.

    A residual that depends on the drive is hysteresis that the model lacks. One that depends on the
    rate is a lag. One that drifts is creep or temperature. Where few points would flatten all
    others, they are left out of the axis, and their number is in the figure.

    Parameters
    ----------
    model : results.Identification, Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
        What has the hysteresis.
    u, y : arrays of n floats
        Drive and measured position.
    record : int, optional
        Of an identification: the number of the record, as in `Identification.residuals`.
    skip : int
        Leading samples that do not count.
    dt : float, optional
        Sampling interval in seconds; of an identification that of the record.
    units : (str, str), optional
        Of drive and position; by default those of a stage.
    axes : sequence of three matplotlib axes, optional
        Over the drive, its rate and time; by default those of a new figure.

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
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    >>> y = mh.paper.table_1_recovered().forward().run(u)
    >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    >>> figure = mh.plot.residuals(found, u, y, record=0, units=("V", "um"))
    >>> figure.axes[0].get_ylabel()
    'measured − model (µm)'

    """
    expect_shown("model", model)
    with drawing():
        from mpi_hyst._report import canvas, plots
    made = modelled(model, samples("u", u), samples("y", y), record=record, skip=skip, dt=dt)
    curve = plots.Curve("model", canvas.BLUE, made.output)
    trace = plots.Trace(
        "record", made.u, made.y, made.seconds, made.skip, [curve], *quantities(units, model)
    )
    if axes is None:
        return plots.residuals(trace)
    drawn = panels(axes, 3)
    plots.draw_residuals(trace, drawn)
    return canvas.root(drawn[0])


def uncertainty(
    found: Identification,
    u: npt.ArrayLike,
    *,
    skip: int = 0,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw how far the prediction of an identified model may be off.

    On the left the 95 % band over time, plus and minus 1.96 standard deviations. On the right the
    standard deviation over the drive. It follows from the covariance of all that was fitted; the
    noise of a measurement and what the model lacks come on top.

    Parameters
    ----------
    found : results.Identification
        Made by `identify`.
    u : array of n floats
        The drive, sampled like the first record.
    skip : int
        Leading samples that are not drawn.
    units : (str, str), optional
        Of drive and position.
    axes : sequence of two matplotlib axes, optional
        For the band and for the deviation; by default those of a new figure.

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
    >>> import numpy as np
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    >>> noise = np.random.default_rng(1).normal(0.0, 0.015, u.size)  # um
    >>> y = mh.paper.table_1_recovered().forward().run(u) + noise
    >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    >>> mh.plot.uncertainty(found, u).axes[0].get_xlabel()
    'sample'

    """
    expect("found", found, (Identification,))
    with drawing():
        from mpi_hyst._report import canvas, plots
        from mpi_hyst._report.identify import validation_figures
    drive = samples("u", u)
    leading = skipped(skip, drive)
    predicted, std = found.predict(drive, return_std=True)
    seconds = np.arange(drive.size, dtype=np.float64) * found.dt[0] if found.dt else None
    curve = plots.Curve("model", canvas.BLUE, predicted)
    trace = plots.Trace(
        "prediction", drive, np.empty(0), seconds, leading, [curve], *quantities(units)
    )
    if axes is None:
        return validation_figures.deviation(trace, std)
    drawn = panels(axes, 2)
    validation_figures.draw_deviation(trace, std, drawn)
    return canvas.root(drawn[0])
