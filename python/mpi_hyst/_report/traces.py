"""Figures of records: as they are, with the outputs of models, and what the models leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mpi_hyst._core import Identification
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._report.models import TWO_SIDED
from mpi_hyst._types import Samples

# Drawn as pixels: their number does not change the size of the file.
LOOP_POINTS = 200_000
_LOOK_POINTS = 100_000
CLOUD_POINTS = 4500
_TITLE = 90  # characters that fit across the page


@dataclass(frozen=True)
class Curve:
    """The output of one model for the input of a record."""

    name: str
    colour: str
    output: Samples


@dataclass(frozen=True)
class Trace:
    """A record with the outputs of models; without a measurement `measured` is empty.

    The first `skip` samples are not fitted.
    """

    name: str
    input: Samples
    measured: Samples
    seconds: Samples | None
    skip: int
    curves: Sequence[Curve]
    input_quantity: Quantity
    output_quantity: Quantity

    def residual(self, curve: Curve) -> Samples:
        """Measured minus modelled output."""
        return np.asarray(self.measured - curve.output, dtype=np.float64)

    @property
    def time(self) -> Samples:
        """The time in seconds, or the index of the sample."""
        return np.arange(self.input.size, dtype=float) if self.seconds is None else self.seconds

    @property
    def time_label(self) -> str:
        """The label of a time axis."""
        return "sample" if self.seconds is None else "time (s)"

    @property
    def speed(self) -> Samples:
        """The rate of change of the input, per second or per sample."""
        return np.asarray(np.gradient(self.input, self.time), dtype=np.float64)

    @property
    def speed_label(self) -> str:
        """The label of an axis of the rate of change."""
        over = "s" if self.seconds is not None else "sample"
        unit = f"{self.input_quantity.unit or 1}/{over}"
        return f"rate of change of {self.input_quantity.name} ({unit})"


def loops(traces: Sequence[Trace]) -> canvas.Figure:
    """Draw measured and modelled loops; below, the same minus the straight line fit."""
    figure = canvas.new_figure(7.8)
    panels = figure.subplots(2, len(traces), squeeze=False, height_ratios=(1.0, 1.35))
    for trace, column in zip(traces, panels.T, strict=True):
        name = canvas.short(trace.name, _TITLE // len(traces))
        draw_loops(list(column), replace(trace, name=name))
    canvas.top_legend(figure, panels[0][0])
    return figure


def draw_loops(panels: Sequence[canvas.Axes], trace: Trace) -> None:
    """Draw the loops of a trace into two panels: as they are, and minus the straight line fit."""
    fitted = slice(trace.skip, None)
    drive = trace.input[fitted]
    measured = trace.measured[fitted]
    line = _line(drive, measured if measured.size else trace.curves[0].output[fitted])
    every = canvas.thinned(drive.size, LOOP_POINTS)
    look: dict[str, Any] = {"color": canvas.MEASURED, "label": "measured"}
    for axes, base in zip(panels, (np.zeros_like(line), line), strict=True):
        if measured.size:
            canvas.cloud(axes, drive, measured - base, 3.5, CLOUD_POINTS, **look)
        for curve in trace.curves:
            axes.plot(
                drive[every],
                (curve.output[fitted] - base)[every],
                color=curve.colour,
                linewidth=1.0,
                label=curve.name,
                rasterized=True,
            )
    label, output = trace.input_quantity.label, trace.output_quantity
    canvas.dress(panels[0], trace.name, label, output.label)
    canvas.dress(panels[1], "the same, minus straight line", label, f"Δ {output.label}")
    if measured.size:
        for axes, values in zip(panels, (measured, measured - line), strict=True):
            _leave_out(axes, values)


def _leave_out(axes: canvas.Axes, values: Samples) -> None:
    """Limit the axis where few of the values would flatten all others."""
    low, high = canvas.shown(values)
    if low > values.min() or high < values.max():
        margin = 0.06 * (high - low)
        axes.set_ylim(low - margin, high + margin)
        canvas.note_outside(axes, values)


def _line(drive: Samples, measured: Samples) -> Samples:
    """Return the straight line fit, for samples of any magnitude."""
    low, span = float(measured.min()), float(np.ptp(measured))
    share = _share_of_span(drive)
    fitted = np.polynomial.Polynomial.fit(share, _share_of_span(measured), 1)(share)
    return np.asarray(low + span * fitted, dtype=np.float64)


def _share_of_span(values: Samples) -> Samples:
    share = (values - values.min()) / (float(np.ptp(values)) or 1.0)
    return np.asarray(share, dtype=np.float64)


def residuals(trace: Trace) -> canvas.Figure:
    """Draw the residuals over the input, over its rate of change, and over time."""
    figure = canvas.new_figure(6.2)
    named = figure.subplot_mosaic([["input", "speed"], ["time", "time"]])
    panels = [named["input"], named["speed"], named["time"]]
    draw_residuals(panels, trace)
    canvas.top_legend(figure, panels[2])
    return figure


def draw_residuals(panels: Sequence[canvas.Axes], trace: Trace) -> None:
    """Draw the residuals into three panels: over the input, its rate of change, and time."""
    over_input, over_speed, over_time = panels
    fitted = slice(trace.skip, None)
    drive, speed, time = trace.input[fitted], trace.speed[fitted], trace.time
    left = []
    for curve in trace.curves:
        residual = trace.residual(curve)
        left.append(residual[fitted])
        dots: dict[str, Any] = {"color": curve.colour, "alpha": 0.5}
        canvas.cloud(over_input, drive, residual[fitted], 2.2, CLOUD_POINTS, **dots)
        canvas.cloud(over_speed, speed, residual[fitted], 2.2, CLOUD_POINTS, **dots)
        look: dict[str, Any] = {"color": curve.colour, "alpha": 0.9, "label": curve.name}
        canvas.line(over_time, time, residual, linewidth=0.6, **look)
    label = f"measured − model{trace.output_quantity.in_parentheses}"
    canvas.dress(over_input, "residual over the input", trace.input_quantity.label, label)
    canvas.dress(over_speed, "residual over its rate of change", trace.speed_label, label)
    canvas.dress(over_time, "residual over time", trace.time_label, label)
    if trace.skip:
        over_time.axvspan(time[0], time[trace.skip], color=canvas.GRID, label="skipped", zorder=0)
    over_time.set_xlim(time[0], time[-1])
    over_speed.locator_params(axis="x", nbins=6)
    extent = canvas.extent(*left)
    for axes in panels:
        axes.set_ylim(-extent, extent)
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
    canvas.note_outside(over_time, *left)


def raw_record(
    name: str,
    drive: tuple[Quantity, Samples],
    position: tuple[Quantity, Samples],
    seconds: Samples | None,
) -> canvas.Figure:
    """Draw position over drive, and both over time."""
    figure = canvas.new_figure(5.6)
    panels = figure.subplot_mosaic([["loop", "drive"], ["loop", "position"]])
    cloud = canvas.thinned(drive[1].size, _LOOK_POINTS)
    panels["loop"].plot(
        drive[1][cloud], position[1][cloud], color=canvas.BLUE, linewidth=0.8, rasterized=True
    )
    canvas.dress(panels["loop"], name, drive[0].label, position[0].label)
    time = np.arange(drive[1].size, dtype=float) if seconds is None else seconds
    label = "sample" if seconds is None else "time (s)"
    _over_time(panels["drive"], "drive over time", label, time, drive, canvas.BLUE)
    _over_time(panels["position"], "position over time", label, time, position, canvas.ORANGE)
    return figure


def raw_columns(name: str, columns: dict[str, tuple[Quantity, Samples]]) -> canvas.Figure:
    """Draw columns over their samples, where drive and position are not known."""
    figure = canvas.new_figure(1.0 + 2.0 * len(columns))
    panels = figure.subplots(len(columns), 1, squeeze=False)[:, 0]
    for axes, (quantity, values) in zip(panels, columns.values(), strict=True):
        time = np.arange(values.size, dtype=float)
        _over_time(axes, name, "sample", time, (quantity, values), canvas.BLUE)
    return figure


def _over_time(
    axes: canvas.Axes,
    title: str,
    label: str,
    time: Samples,
    column: tuple[Quantity, Samples],
    colour: str,
) -> None:
    quantity, values = column
    canvas.line(axes, time, values, color=colour, linewidth=0.9)
    canvas.dress(axes, title, label, quantity.label)


@dataclass(frozen=True)
class Doubt:
    """How far a prediction may be off: half the 95 % band, and the effect of noise on the fit."""

    half: Samples
    std: Samples


def doubted(found: Identification, drive: Samples) -> tuple[Samples, Doubt]:
    """Return what a model predicts for a drive, and how far that may be off."""
    predicted, low, high = found.predict(drive, interval=0.95)
    return predicted, Doubt(0.5 * (high - low), found.predict(drive, return_std=True)[1])


def doubt(trace: Trace, off: Doubt) -> canvas.Figure:
    """Draw the 95 % bands of the prediction over time, and half of them over the input."""
    figure = canvas.new_figure(3.4)
    draw_doubt(list(figure.subplots(1, 2, width_ratios=(1.6, 1.0))), trace, off)
    canvas.top_legend(figure, figure.axes[0])
    return figure


def draw_doubt(panels: Sequence[canvas.Axes], trace: Trace, off: Doubt) -> None:
    """Draw into two panels: the 95 % bands over time, and half of them over the input."""
    course, plane = panels
    fitted = slice(trace.skip, None)
    time = trace.time[fitted]
    bands = (
        ("the next record", off.half[fitted], canvas.ORANGE),
        ("noise on the fit alone", TWO_SIDED * off.std[fitted], canvas.BLUE),
    )
    for label, half, colour in bands:
        kept = np.union1d(canvas.envelope(half), [0, half.size - 1])
        sides = (-half[kept], half[kept])
        course.fill_between(time[kept], *sides, color=colour, alpha=0.3, linewidth=0, label=label)
        canvas.cloud(plane, trace.input[fitted], half, 2.4, LOOP_POINTS, color=colour)
    course.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
    course.set_xlim(time[0], time[-1])
    plane.set_ylim(bottom=0.0)
    of_unit = trace.output_quantity.in_parentheses
    canvas.dress(course, "95 % bands of the prediction over time", trace.time_label, f"Δ{of_unit}")
    canvas.dress(plane, "half the bands over input", trace.input_quantity.label, f"Δ{of_unit}")
