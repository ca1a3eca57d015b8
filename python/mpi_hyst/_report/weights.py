"""The weights and thresholds of models, with their uncertainty where they were identified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._report import canvas
from mpi_hyst._types import Model, Samples

TWO_SIDED = 1.96  # standard deviations: 95 % of a normal distribution
_SAME_END = 0.05  # of the height: labels closer than this would overlap


@dataclass(frozen=True)
class Bank:
    """The weights and thresholds of one model, for comparison."""

    name: str
    colour: str
    model: Model
    marker: str = "o"
    found: mh.results.Identification | None = None
    """Where the model was identified: its standard errors are drawn too."""

    @property
    def families(self) -> dict[str, Samples]:
        """The weights by line style: dashed for the weights below zero of a split model."""
        if isinstance(self.model, mh.ModifiedPrandtlIshlinskii) and self.model.split:
            return {"-": self.model.weights, "--": self.model.weights_negative}
        return {"-": self.model.weights}

    @property
    def deviations(self) -> dict[str, tuple[Samples, Samples]]:
        """Standard errors of the weights and of their cumulative sums, by line style."""
        if self.found is None:
            return {}
        single = {"-": self.found.weights_std, "--": self.found.weights_negative_std}
        named = {"-": "weights", "--": "weights_negative"}
        return {line: (single[line], self._of_sums(named[line])) for line in self.families}

    def _of_sums(self, name: str) -> Samples:
        """Return the standard errors of the cumulative sums; what is at a bound counts as known."""
        assert self.found is not None
        parameters, covariance = self.found.parameters, self.found.covariance
        places = {
            index: parameters.index(f"{name}[{index}]")
            for index in range(self.model.operators)
            if f"{name}[{index}]" in parameters
        }
        sums = np.zeros((self.model.operators, len(parameters)))
        for index, place in places.items():
            sums[index:, place] = 1.0
        variance = np.einsum("ij,jk,ik->i", sums, covariance, sums)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)), dtype=np.float64)

    @property
    def thresholds(self) -> Samples:
        """The thresholds r."""
        if isinstance(self.model, mh.ModifiedPrandtlIshlinskii):
            return self.model.r
        return self.model.thresholds


def figure(banks: Sequence[Bank], weight_unit: str, threshold_unit: str) -> Figure:
    """Draw the weights, their cumulative sum, and the thresholds of models side by side."""
    figure = canvas.new_figure(3.7)
    panels = list(figure.subplots(1, 3))
    draw(banks, panels, weight_unit, threshold_unit)
    canvas.top_legend(figure, panels[1])
    return figure


def draw(
    banks: Sequence[Bank], panels: Sequence[Axes], weight_unit: str, threshold_unit: str
) -> None:
    """Draw into three panels: weights, their cumulative sum, thresholds, with 95 % bands."""
    single, total, thresholds = panels
    in_weight = f" ({weight_unit})" if weight_unit else ""
    in_threshold = f" ({threshold_unit})" if threshold_unit else ""
    for index, bank in enumerate(banks):
        _weights(bank, single, total, hollow=index > 0)
        _thresholds(bank, thresholds, hollow=index > 0)
    threshold = f"threshold r{in_threshold}"
    canvas.dress(single, "weights, without the first", threshold, f"w{in_weight}")
    canvas.dress(total, "cumulative sum of the weights", threshold, f"Σ w{in_weight}")
    title, several = "thresholds ra, rb, rc", f"ra, rb, rc{in_threshold}"
    canvas.dress(thresholds, title, f"r{in_threshold}", several)
    if not thresholds.lines:
        thresholds.text(
            *(0.5, 0.5, "a play has one threshold"),
            transform=thresholds.transAxes,
            ha="center",
            fontsize=9,
            color=canvas.SOFT,
        )
    smallest = min(w.min() for bank in banks for w in bank.families.values())
    single.set_ylim(bottom=0.0 if smallest >= 0.0 else None)


def _look(bank: Bank, *, hollow: bool) -> dict[str, Any]:
    look = {"color": bank.colour, "markersize": 4.5, "linewidth": 1.1, "label": bank.name}
    return look | {"marker": bank.marker, "markerfacecolor": "none" if hollow else bank.colour}


def _weights(bank: Bank, single: Axes, total: Axes, *, hollow: bool) -> None:
    r, look = bank.thresholds, _look(bank, hollow=hollow)
    for line, w in bank.families.items():
        below = {"linestyle": line, "label": _below(bank.name) if line == "--" else bank.name}
        below |= {"markerfacecolor": "none"} if line == "--" else {}
        single.plot(r[1:], w[1:], **(look | below | {"linewidth": 0.6}))
        total.plot(r, np.cumsum(w), **(look | below))
        if line not in bank.deviations:
            continue
        for_weight, for_sum = (TWO_SIDED * one for one in bank.deviations[line])
        bars: dict[str, Any] = {"fmt": "none", "ecolor": bank.colour, "elinewidth": 0.9}
        single.errorbar(r[1:], w[1:], yerr=np.nan_to_num(for_weight[1:]), capsize=2.5, **bars)
        sums = np.cumsum(w)
        band: dict[str, Any] = {"color": bank.colour, "alpha": 0.22, "linewidth": 0}
        total.fill_between(r, sums - for_sum, sums + for_sum, **band)


def _thresholds(bank: Bank, axes: Axes, *, hollow: bool) -> None:
    if not isinstance(bank.model, mh.ModifiedPrandtlIshlinskii):
        return
    r, look = bank.thresholds, _look(bank, hollow=hollow) | {"label": None, "linewidth": 0.6}
    named = {"ra": bank.model.ra, "rb": bank.model.rb, "rc": bank.model.rc}
    ratios_std = (0.0, 0.0, 0.0) if bank.found is None else bank.found.ratios_std
    for values, std in zip(named.values(), ratios_std, strict=True):
        axes.plot(r, values, **look)
        half = TWO_SIDED * std * r
        if std > 0.0:
            axes.fill_between(
                r, values - half, values + half, color=bank.colour, alpha=0.22, linewidth=0
            )
    if not hollow:
        _name_ends(axes, float(r[-1]), {name: float(v[-1]) for name, v in named.items()})


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
