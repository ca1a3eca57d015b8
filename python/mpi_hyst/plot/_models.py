"""Figures of models, stages and streams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy.typing as npt

from mpi_hyst._core import Forward, Identification, Inverse, StageInverse
from mpi_hyst._report.shown import Shown, default_drive, model_of
from mpi_hyst.plot._arguments import (
    Units,
    drawing,
    expect,
    expect_shown,
    modelled,
    panels,
    quantities,
    samples,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def loops(
    model: Shown,
    u: npt.ArrayLike | None = None,
    y: npt.ArrayLike | None = None,
    *,
    record: int | None = None,
    skip: int = 0,
    dt: float | None = None,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw the loops of a model; below, the same minus the straight line fit.

    Without the line, the width of the loops and the error of the model fill the panel.

    Parameters
    ----------
    model : Stage, PrandtlIshlinskii, ModifiedPrandtlIshlinskii or results.Identification
        What has the hysteresis.
    u : array of n floats, optional
        The drive; by default decaying loops over the known range, or over all thresholds.
    y : array of n floats, optional
        The measured position, drawn as dots.
    record : int, optional
        Of an identification: the number of the record, as in `Identification.residuals`.
    skip : int
        Leading samples that are not drawn.
    dt : float, optional
        Sampling interval in seconds. A stage without it shows hysteresis and maps alone.
    units : (str, str), optional
        Of drive and position; by default those of a stage.
    axes : sequence of two matplotlib axes, optional
        For the loops, and the loops minus the line; by default those of a new figure.

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
    >>> figure = mh.plot.loops(mh.paper.plant("A1").stage)
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['position (µm)', 'Δ position (µm)']

    """
    expect_shown("model", model)
    with drawing():
        from mpi_hyst._report import canvas, plots
    made = modelled(model, u, y, record=record, skip=skip, dt=dt)
    curve = plots.Curve("model", canvas.BLUE, made.output)
    trace = plots.Trace(
        "loops", made.u, made.y, made.seconds, made.skip, [curve], *quantities(units, model)
    )
    if axes is None:
        return plots.loops([trace])
    drawn = panels(axes, 2)
    plots.draw_loops(trace, drawn)
    canvas.legend(drawn[0])
    return canvas.root(drawn[0])


def operators(
    model: Shown,
    u: npt.ArrayLike | None = None,
    *,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw the operators of a model with their weights, and what they add up to.

    At most seven are shown, from the first to the last.

    Parameters
    ----------
    model : Stage, PrandtlIshlinskii, ModifiedPrandtlIshlinskii or results.Identification
        Of a stage, its hysteresis is shown.
    u : array of n floats, optional
        The drive; by default decaying loops over the known range, or over all thresholds.
    units : (str, str), optional
        Of drive and position; by default those of a stage.
    axes : sequence of two matplotlib axes, optional
        For the single operators and for their sum; by default those of a new figure.

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
    >>> figure = mh.plot.operators(mh.PrandtlIshlinskii([1.0, 0.5, 0.2], [0.0, 2.0, 4.0]))
    >>> [line.get_label() for line in figure.axes[1].get_lines()]
    ['operators 0 to 1', 'operators 0 to 2']

    """
    expect_shown("model", model)
    with drawing():
        from mpi_hyst._report import canvas
        from mpi_hyst._report import operators as drawing_of
    drive = default_drive(model) if u is None else samples("u", u)
    named = quantities(units, model)
    if axes is None:
        return drawing_of.figure(model_of(model), drive, named)
    drawn = panels(axes, 2)
    drawing_of.draw(model_of(model), drive, drawn, named)
    return canvas.root(drawn[0])


def weights(model: Shown, *, units: Units = None, axes: Sequence[Axes] | None = None) -> Figure:
    """Draw weights, their cumulative sum and the thresholds over the threshold r.

    Of an identification bars and bands are 95 %, plus and minus 1.96 standard errors. What was
    given or lies at a bound has none.

    Parameters
    ----------
    model : Stage, PrandtlIshlinskii, ModifiedPrandtlIshlinskii or results.Identification
        What has the hysteresis.
    units : (str, str), optional
        Of drive and position; by default those of a stage.
    axes : sequence of three matplotlib axes, optional
        For weights, sums and thresholds; by default those of a new figure.

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
    >>> figure = mh.plot.weights(mh.paper.table_1_recovered(), units=("V", "um"))
    >>> figure.axes[1].get_ylabel()
    'Σ w (µm/V)'

    """
    expect_shown("model", model)
    with drawing():
        from mpi_hyst._report import canvas
        from mpi_hyst._report import weights as drawing_of
    drive, position = quantities(units, model)
    found = model if isinstance(model, Identification) else None
    bank = drawing_of.Bank("model", canvas.BLUE, model_of(model), found=found)
    of_weight = f"{position.unit}/{drive.unit}" if drive.unit and position.unit else ""
    if axes is None:
        return drawing_of.figure([bank], of_weight, drive.unit)
    drawn = panels(axes, 3)
    drawing_of.draw([bank], drawn, of_weight, drive.unit)
    return canvas.root(drawn[0])


def memory(
    stream: Forward | Inverse | StageInverse,
    *,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw what a stream remembers: the reversals that still determine its output.

    On the left a plane like that of Preisach. A relay at (beta, alpha) goes up where the input
    rises to alpha, and down where it falls to beta. The relays that are up lie below the staircase;
    its corners are the remembered reversals. On the right the same reversals as a zigzag, the
    oldest on the left. The input is that of the hysteresis: behind input map and input offset.

    Parameters
    ----------
    stream : Forward, Inverse or StageInverse
        Its `method` must be "turning_points": a bank of operators remembers no reversals.
    units : (str, str), optional
        Of drive and position.
    axes : sequence of two matplotlib axes, optional
        For the plane and for the zigzag; by default those of a new figure.

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
    >>> stream = mh.paper.table_1_recovered().forward()
    >>> _ = stream.run([400.0, -300.0, 200.0, -100.0, 50.0])
    >>> figure = mh.plot.memory(stream, units=("V", "um"))
    >>> figure.axes[1].get_title(loc="left"), figure.axes[0].get_xlabel()
    ('3 remembered reversals', 'β (V)')

    """
    expect("stream", stream, (Forward, Inverse, StageInverse))
    with drawing():
        from mpi_hyst._report import canvas
        from mpi_hyst._report import memory as drawing_of
    unit = quantities(units)[0].unit
    remembered = drawing_of.Memory(tuple(stream.memory.tolist()), _input_now(stream))
    if axes is None:
        return drawing_of.figure(remembered, unit)
    drawn = panels(axes, 2)
    drawing_of.draw(remembered, drawn, unit)
    return canvas.root(drawn[0])


def _input_now(stream: Forward | Inverse | StageInverse) -> float:
    """Return the last input of the hysteresis."""
    state = stream.state
    if isinstance(stream, StageInverse):
        state = state["stream"]["hysteresis"]
    if state["memory"]["method"] != "turning_points":
        raise ValueError("stream: expected one that remembers reversals, got a bank of operators")
    return float(state["last_input" if isinstance(stream, Forward) else "last_output"])
