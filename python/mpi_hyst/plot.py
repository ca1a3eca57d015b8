"""Figures on matplotlib axes, in the style of the reports. They need `mpi_hyst[report]`.

`loops`, `operators`, `weights` and `memory` show a model, a stage or a stream. `residuals` and
`uncertainty` show what identification found. `tuning`, `run` and `realtime` show feedback and
closed loops. Each returns the figure and draws into `axes` of your own if you give them.

`units` are the names of the units of drive and position. A `Stage` has its own; elsewhere labels
have no unit unless you give both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._arguments import (
    Modelled,
    expect,
    expect_shown,
    interval,
    modelled,
    panels,
    quantities,
    require_matplotlib,
    samples,
    skipped,
)
from mpi_hyst._core import Forward, Identification, Inverse, LoopReport, Run, StageInverse, Tuning
from mpi_hyst._report import canvas, closed_loop, traces
from mpi_hyst._report.models import (
    Bank,
    Memory,
    Shown,
    default_drive,
    draw_memory,
    draw_operators,
    draw_weights,
    memory_figure,
    model_of,
    operators_figure,
    weights_figure,
)
from mpi_hyst._types import Units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "loops",
    "memory",
    "operators",
    "realtime",
    "residuals",
    "run",
    "tuning",
    "uncertainty",
    "weights",
]


def __dir__() -> list[str]:
    return __all__


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
    require_matplotlib("a plot")
    made = modelled(model, u, y, record=record, skip=skip, dt=dt)
    trace = _trace("loops", made, units, model)
    return _drawn(axes, 2, lambda one: traces.loops([one]), traces.draw_loops, trace, legends=(0,))


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
    require_matplotlib("a plot")
    drive = default_drive(model) if u is None else samples("u", u)
    shown = (model_of(model), drive, quantities(units, model))
    return _drawn(axes, 2, operators_figure, draw_operators, *shown)


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
    require_matplotlib("a plot")
    drive, position = quantities(units, model)
    found = model if isinstance(model, Identification) else None
    bank = Bank("model", canvas.BLUE, model_of(model), found=found)
    of_weight = f"{position.unit}/{drive.unit}" if drive.unit and position.unit else ""
    return _drawn(axes, 3, weights_figure, draw_weights, [bank], of_weight, drive.unit)


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
    require_matplotlib("a plot")
    unit = quantities(units)[0].unit
    remembered = Memory(tuple(stream.memory.tolist()), _input_now(stream))
    return _drawn(axes, 2, memory_figure, draw_memory, remembered, unit)


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
    require_matplotlib("a plot")
    made = modelled(model, samples("u", u), samples("y", y), record=record, skip=skip, dt=dt)
    trace = _trace("record", made, units, model)
    return _drawn(axes, 3, traces.residuals, traces.draw_residuals, trace)


def uncertainty(
    found: Identification,
    u: npt.ArrayLike,
    *,
    skip: int = 0,
    units: Units = None,
    axes: Sequence[Axes] | None = None,
) -> Figure:
    """Draw how far the prediction of an identified model may be off.

    On the left two bands of 95 % over time. The wide one, `predict(u, interval=0.95)`, holds a
    measured sample of the next record: what the model lacks and the noise of the sensor are in it.
    The narrow one is the effect of noise on the fit alone, plus and minus 1.96 standard deviations
    of `predict(u, return_std=True)`. On the right half of both over the drive.

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
        For the bands and for half of them; by default those of a new figure.

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
    require_matplotlib("a plot")
    drive = samples("u", u)
    leading = skipped(skip, drive)
    predicted, off = traces.doubted(found, drive)
    made = Modelled(drive, np.empty(0), predicted, leading, found.dt[0] if found.dt else None)
    trace = _trace("prediction", made, units)
    return _drawn(axes, 2, traces.doubt, traces.draw_doubt, trace, off, legends=(0,))


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
    require_matplotlib("a plot")
    figure, draw = closed_loop.tuning_figure, closed_loop.draw_tuning
    return _drawn(axes, 3, figure, draw, tuning, legends=(2,))


def run(
    run: Run, *, dt: float | None = None, units: Units = None, axes: Sequence[Axes] | None = None
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
    require_matplotlib("a plot")
    known = interval(dt)
    time = np.arange(len(run), dtype=np.float64) * (known or 1.0)
    drive, position = quantities(units)
    label = "sample" if known is None else "time (s)"
    noise = closed_loop.is_noisy(run)
    course = closed_loop.Course(run, time, label, position, drive.label, run.limits, noise=noise)
    figure, draw = closed_loop.course_figure, closed_loop.draw_course
    return _drawn(axes, 3, figure, draw, course, legends=(0, 1, 2))


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
    require_matplotlib("a plot")
    return _drawn(axes, 3, closed_loop.times_figure, closed_loop.draw_times, report)


def _input_now(stream: Forward | Inverse | StageInverse) -> float:
    """Return the last input of the hysteresis."""
    state = stream.state
    if isinstance(stream, StageInverse):
        state = state["stream"]["hysteresis"]
    if state["memory"]["method"] != "turning_points":
        raise ValueError("stream: expected one that remembers reversals, got a bank of operators")
    return float(state["last_input" if isinstance(stream, Forward) else "last_output"])


def _trace(name: str, made: Modelled, units: Units, of: object = None) -> traces.Trace:
    """Return what was measured with the output of the model."""
    curve = traces.Curve("model", canvas.BLUE, made.output)
    shown = (made.u, made.y, made.seconds, made.skip, [curve])
    return traces.Trace(name, *shown, *quantities(units, of))


def _drawn(
    axes: Sequence[Axes] | None,
    count: int,
    figure: Callable[..., Figure],
    draw: Callable[..., None],
    *shown: Any,
    legends: Sequence[int] = (),
) -> Figure:
    """Make a new figure, or draw into so many axes that are given and have no legend above them."""
    if axes is None:
        return figure(*shown)
    drawn = panels(axes, count)
    draw(drawn, *shown)
    for place in legends:
        canvas.legend(drawn[place])
    return canvas.root(drawn[0])
