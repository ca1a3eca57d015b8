"""Figures that several reports share: loops, residuals, weights and thresholds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._types import Model, Samples

LOOP_POINTS = 200_000  # drawn as pixels: their number does not change the size of the file
CLOUD_POINTS = 4500
_SAME_END = 0.05  # of the height: labels closer than this would overlap


@dataclass(frozen=True)
class Curve:
    """The output of one model for the input of a record."""

    name: str
    colour: str
    output: Samples


@dataclass(frozen=True)
class Trace:
    """A measured record with the outputs of models. The first `skip` samples are not fitted."""

    name: str
    input: Samples
    measured: Samples
    seconds: Samples | None
    skip: int
    curves: Sequence[Curve]
    input_quantity: Quantity
    output_quantity: Quantity

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


def loops(traces: Sequence[Trace]) -> Figure:
    """Draw measured and modelled loops; below, the same minus the straight line fit."""
    figure = canvas.new_figure(7.8)
    panels = figure.subplots(2, len(traces), squeeze=False, height_ratios=(1.0, 1.35))
    for column, trace in enumerate(traces):
        whole, width = panels[0][column], panels[1][column]
        fitted = slice(trace.skip, None)
        drive, measured = trace.input[fitted], trace.measured[fitted]
        line = _line(drive, measured)
        every = canvas.thinned(drive.size, LOOP_POINTS)
        for axes, base in ((whole, np.zeros_like(line)), (width, line)):
            cloud = canvas.thinned(drive.size, CLOUD_POINTS)
            axes.plot(
                drive[cloud],
                (measured - base)[cloud],
                ".",
                color=canvas.MEASURED,
                markersize=3.5,
                markeredgewidth=0,
                label="measured",
                rasterized=True,
            )
            for curve in trace.curves:
                modelled = (curve.output[fitted] - base)[every]
                axes.plot(
                    drive[every],
                    modelled,
                    color=curve.colour,
                    linewidth=1.0,
                    label=curve.name,
                    rasterized=True,
                )
        label, output = trace.input_quantity.label, trace.output_quantity
        canvas.dress(whole, trace.name, label, output.label)
        canvas.dress(width, f"{trace.name}, minus straight line", label, f"Δ {output.label}")
    canvas.top_legend(figure, panels[0][0])
    return figure


def _line(drive: Samples, measured: Samples) -> Samples:
    """Return the straight line fit, for samples of any magnitude."""
    low, span = float(measured.min()), float(np.ptp(measured))
    share = _share_of_span(drive)
    fitted = np.polynomial.Polynomial.fit(share, _share_of_span(measured), 1)(share)
    return np.asarray(low + span * fitted, dtype=np.float64)


def _share_of_span(values: Samples) -> Samples:
    share = (values - values.min()) / (float(np.ptp(values)) or 1.0)
    return np.asarray(share, dtype=np.float64)


def residuals(trace: Trace) -> Figure:
    """Draw the residuals over the input, over its rate of change, and over time."""
    figure = canvas.new_figure(6.2)
    panels = figure.subplot_mosaic([["input", "speed"], ["time", "time"]])
    fitted = slice(trace.skip, None)
    drive, speed, time = trace.input[fitted], trace.speed[fitted], trace.time
    extent = 0.0
    for curve in trace.curves:
        residual = trace.measured - curve.output
        extent = max(extent, float(np.abs(residual[fitted]).max()))
        every = canvas.thinned(drive.size, CLOUD_POINTS)
        dots: dict[str, Any] = {
            "color": curve.colour,
            "marker": ".",
            "linestyle": "none",
            "markersize": 2.2,
        }
        dots |= {"markeredgewidth": 0, "alpha": 0.5, "rasterized": True}
        panels["input"].plot(drive[every], residual[fitted][every], **dots)
        panels["speed"].plot(speed[every], residual[fitted][every], **dots)
        kept = canvas.envelope(residual)
        panels["time"].plot(
            time[kept],
            residual[kept],
            color=curve.colour,
            linewidth=0.6,
            alpha=0.9,
            label=curve.name,
        )
    label = f"measured − model{trace.output_quantity.in_parentheses}"
    canvas.dress(panels["input"], "residual over the input", trace.input_quantity.label, label)
    canvas.dress(panels["speed"], "residual over its rate of change", trace.speed_label, label)
    canvas.dress(panels["time"], "residual over time", trace.time_label, label)
    if trace.skip:
        panels["time"].axvspan(
            time[0], time[trace.skip], color=canvas.GRID, label="skipped", zorder=0
        )
    canvas.top_legend(figure, panels["time"])
    panels["time"].set_xlim(time[0], time[-1])
    panels["speed"].locator_params(axis="x", nbins=6)
    for axes in panels.values():
        axes.set_ylim(-1.12 * extent, 1.12 * extent)
        axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
    return figure


@dataclass(frozen=True)
class Bank:
    """The weights and thresholds of one model, for comparison."""

    name: str
    colour: str
    model: Model
    marker: str = "o"

    @property
    def families(self) -> dict[str, Samples]:
        """The weights by line style: dashed for the weights below zero of a split model."""
        if isinstance(self.model, mh.ModifiedPrandtlIshlinskii) and self.model.split:
            return {"-": self.model.weights, "--": self.model.weights_negative}
        return {"-": self.model.weights}

    @property
    def thresholds(self) -> Samples:
        """The thresholds r."""
        if isinstance(self.model, mh.ModifiedPrandtlIshlinskii):
            return self.model.r
        return self.model.thresholds


def weights(banks: Sequence[Bank], weight_unit: str, threshold_unit: str) -> Figure:
    """Draw the weights, their cumulative sum, and the thresholds of models side by side."""
    figure = canvas.new_figure(3.7)
    single, total, thresholds = figure.subplots(1, 3)
    in_weight = f" ({weight_unit})" if weight_unit else ""
    in_threshold = f" ({threshold_unit})" if threshold_unit else ""
    for index, bank in enumerate(banks):
        r = bank.thresholds
        look = {"color": bank.colour, "markersize": 4.5, "linewidth": 1.1, "label": bank.name}
        look |= {"marker": bank.marker, "markerfacecolor": "none" if index else bank.colour}
        for line, w in bank.families.items():
            below = {"linestyle": line, "label": _below(bank.name) if line == "--" else bank.name}
            below |= {"markerfacecolor": "none"} if line == "--" else {}
            single.plot(r[1:], w[1:], **(look | below | {"linewidth": 0.6}))
            total.plot(r, np.cumsum(w), **(look | below))
        if not isinstance(bank.model, mh.ModifiedPrandtlIshlinskii):
            continue
        named = {"ra": bank.model.ra, "rb": bank.model.rb, "rc": bank.model.rc}
        for values in named.values():
            thresholds.plot(r, values, **(look | {"label": None, "linewidth": 0.6}))
        if index == 0:
            _name_ends(thresholds, float(r[-1]), {name: float(v[-1]) for name, v in named.items()})
    canvas.dress(
        single, "weights, without the first", f"threshold r{in_threshold}", f"w{in_weight}"
    )
    canvas.dress(
        total, "cumulative sum of the weights", f"threshold r{in_threshold}", f"Σ w{in_weight}"
    )
    canvas.dress(
        thresholds, "thresholds ra, rb, rc", f"r{in_threshold}", f"ra, rb, rc{in_threshold}"
    )
    smallest = min(w.min() for bank in banks for w in bank.families.values())
    single.set_ylim(bottom=0.0 if smallest >= 0.0 else None)
    canvas.top_legend(figure, total)
    return figure


def _below(name: str) -> str:
    return f"{name}, below zero"


def _name_ends(axes: Axes, x: float, ends: dict[str, float]) -> None:
    """Label lines at their right ends; lines that end close together share one label."""
    near = _SAME_END * max(ends.values())
    apart: dict[float, str] = {}
    for name, end in ends.items():
        y = next((other for other in apart if abs(other - end) <= near), end)
        apart[y] = f"{apart[y]}, {name}" if y in apart else name
    for y, names in apart.items():
        axes.annotate(
            names,
            (x, y),
            xytext=(7, 0),
            textcoords="offset points",
            fontsize=9.5,
            color=canvas.INK,
            va="center",
        )
