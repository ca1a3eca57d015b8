"""What is shown of a model and of a stage: loops, weights, operators, memory, tables and words.

A point of the plane of the memory, like that of Preisach, is a relay that goes up where the input
rises to alpha and down where it falls to beta. The relays that are up lie below a staircase. Its
corners are the remembered reversals: maxima in alpha, minima in beta. A rising input sweeps
upwards, a falling one to the left, and what they sweep over is forgotten.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from mpi_hyst._core import (
    CoupledPlay,
    FirstOrder,
    Identification,
    LoopShift,
    Modes,
    ModifiedPrandtlIshlinskii,
    Play,
    PrandtlIshlinskii,
    RelaxingPlays,
    SecondOrder,
    Stage,
)
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._report.page import Table
from mpi_hyst._text import NOT_DETERMINED, determined, digits
from mpi_hyst._types import Model, Samples

Shown: TypeAlias = Stage | Model | Identification
_MOVE = 400  # samples of each
_MODELS = (PrandtlIshlinskii, ModifiedPrandtlIshlinskii)


def model_of(shown: Shown) -> Model:
    """Return the hysteresis."""
    if isinstance(shown, Stage):
        return shown.hysteresis
    return shown.model if isinstance(shown, Identification) else shown


def default_drive(shown: Shown) -> Samples:
    """Return decaying loops over the range of a stage, or over all thresholds of a model."""
    model = model_of(shown)
    known = None if isinstance(shown, _MODELS) else shown.drive_range
    if known is None:
        reach = 1.25 * max(float(one.max()) for one in _all_thresholds(model)) or 1.0
        known = (model.input_offset - reach, model.input_offset + reach)
    low, high = known
    corners = [0.0, *(sign * share for share in (1.0, 0.7, 0.4, 0.15) for sign in (1.0, -1.0)), 0.0]
    moves = len(corners) - 1
    course = np.interp(np.linspace(0.0, moves, moves * _MOVE + 1), range(moves + 1), corners)
    # The first point is where a model rests, if that is within the range.
    drive = 0.5 * (low + high) + 0.5 * (high - low) * course
    rest = min(max(model.input_offset, low), high)
    return np.concatenate([np.linspace(rest, drive[0], 100), drive])


def _all_thresholds(model: Model) -> list[Samples]:
    if isinstance(model, PrandtlIshlinskii):
        return [model.thresholds]
    return [model.r, model.ra, model.rb, model.rc]


def run(shown: Stage | Model, u: Samples, dt: float | None) -> Samples:
    """Run a model along a drive; a stage without dt has the part that does not know time."""
    if not isinstance(shown, Stage):
        return shown.forward().run(u)
    if dt is not None:
        return shown.forward(dt).run(u)
    timeless = Stage(
        shown.hysteresis,
        duhem=shown.duhem,
        input_map=shown.input_map,
        output_map=shown.output_map,
    )
    return timeless.forward(1.0).run(u)


TWO_SIDED = 1.96  # standard deviations: 95 % of a normal distribution
_SAME_END = 0.05  # of the height: labels closer than this would overlap


@dataclass(frozen=True)
class Bank:
    """The weights and thresholds of one model, for comparison."""

    name: str
    colour: str
    model: Model
    marker: str = "o"
    found: Identification | None = None
    """Where the model was identified: its standard errors are drawn too."""

    @property
    def families(self) -> dict[str, Samples]:
        """The weights by line style: dashed for the weights below zero of a split model."""
        if isinstance(self.model, ModifiedPrandtlIshlinskii) and self.model.split:
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
        if isinstance(self.model, ModifiedPrandtlIshlinskii):
            return self.model.r
        return self.model.thresholds


def weights_figure(banks: Sequence[Bank], weight_unit: str, threshold_unit: str) -> canvas.Figure:
    """Draw the weights, their cumulative sum, and the thresholds of models side by side."""
    made = canvas.new_figure(3.7)
    panels = list(made.subplots(1, 3))
    draw_weights(panels, banks, weight_unit, threshold_unit)
    canvas.top_legend(made, panels[1])
    return made


def draw_weights(
    panels: Sequence[canvas.Axes], banks: Sequence[Bank], weight_unit: str, threshold_unit: str
) -> None:
    """Draw into three panels: weights, their cumulative sum, thresholds, with 95 % bands."""
    single, total, thresholds = panels
    in_weight = f" ({weight_unit})" if weight_unit else ""
    in_threshold = f" ({threshold_unit})" if threshold_unit else ""
    for index, bank in enumerate(banks):
        _draw_weights(bank, single, total, hollow=index > 0)
        _draw_thresholds(bank, thresholds, hollow=index > 0)
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


def _bank_look(bank: Bank, *, hollow: bool) -> dict[str, Any]:
    look = {"color": bank.colour, "markersize": 4.5, "linewidth": 1.1, "label": bank.name}
    return look | {"marker": bank.marker, "markerfacecolor": "none" if hollow else bank.colour}


def _draw_weights(bank: Bank, single: canvas.Axes, total: canvas.Axes, *, hollow: bool) -> None:
    r, look = bank.thresholds, _bank_look(bank, hollow=hollow)
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


def _draw_thresholds(bank: Bank, axes: canvas.Axes, *, hollow: bool) -> None:
    if not isinstance(bank.model, ModifiedPrandtlIshlinskii):
        return
    r, look = bank.thresholds, _bank_look(bank, hollow=hollow) | {"label": None, "linewidth": 0.6}
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


def _name_ends(axes: canvas.Axes, x: float, ends: dict[str, float]) -> None:
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


_SHOWN = 7  # operators, from the first to the last: more could not be told apart


def operators_figure(
    model: Model, drive: Samples, quantities: tuple[Quantity, Quantity]
) -> canvas.Figure:
    """Draw both panels side by side."""
    made = canvas.new_figure(4.4)
    panels = list(made.subplots(1, 2, width_ratios=(1.0, 1.0)))
    draw_operators(panels, model, drive, quantities)
    return made


def draw_operators(
    panels: Sequence[canvas.Axes],
    model: Model,
    drive: Samples,
    quantities: tuple[Quantity, Quantity],
) -> None:
    """Draw into two panels: weighted operators, and the sum of the first of them."""
    from matplotlib import colormaps

    single, total = panels
    outputs = contributions(model, drive)
    sums = np.cumsum(outputs, axis=0) + model.output_offset
    count = len(outputs)
    # The first operator is a straight line that would hide all others.
    first = 1 if count > 1 else 0
    shown = np.unique(np.linspace(first, count - 1, min(_SHOWN, count - first)).round().astype(int))
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, len(shown)))
    for place, colour in zip(shown.tolist(), colours, strict=True):
        name = f"operator {place}"
        single.plot(drive, outputs[place], color=colour, linewidth=1.2, label=name)
        of_first = f"operators 0 to {place}" if place else name
        last = place == count - 1
        look: dict[str, Any] = {"linewidth": 1.8 if last else 0.9, "label": of_first}
        total.plot(drive, sums[place], color=colour, **look)
    label, output = quantities[0].label, quantities[1]
    title = f"weighted operators{' without the first' if first else ''}"
    canvas.dress(single, title, label, f"w z{output.in_parentheses}")
    canvas.dress(total, "their sum", label, output.label)
    for axes in panels:
        canvas.legend(axes, fontsize=8, loc="upper left", handlelength=1.2)


def contributions(model: Model, drive: Samples) -> list[Samples]:
    """Return the output of every operator times its weight."""
    x = drive - model.input_offset
    if isinstance(model, PrandtlIshlinskii):
        pairs = zip(model.weights.tolist(), model.thresholds.tolist(), strict=True)
        return [w * Play(r).run(x) for w, r in pairs]
    thresholds = zip(*(a.tolist() for a in (model.r, model.ra, model.rb, model.rc)), strict=True)
    weights = zip(model.weights.tolist(), model.weights_negative.tolist(), strict=True)
    made = []
    for four, (w, v) in zip(thresholds, weights, strict=True):
        z = CoupledPlay(*four).run(x)
        made.append(np.where(z > 0.0, w, v) * z)
    return made


_NUMBERED = 12  # reversals that have a number in the figure: more would overlap
_MARGIN = 1.15


@dataclass(frozen=True)
class Memory:
    """The remembered reversals of an input, oldest first, and the input now."""

    reversals: tuple[float, ...]
    now: float

    @property
    def extent(self) -> float:
        """How far the plane is drawn on both sides of zero."""
        return _MARGIN * max(map(abs, (*self.reversals, self.now))) or 1.0

    @property
    def maxima(self) -> list[bool]:
        """Which reversals are maxima: they take turns, and the input moves away from the newest."""
        last_is_maximum = bool(self.reversals) and self.now < self.reversals[-1]
        count = len(self.reversals)
        return [last_is_maximum == ((count - 1 - place) % 2 == 0) for place in range(count)]

    def staircase(self) -> list[tuple[float, float]]:
        """Return the corners (beta, alpha) of the boundary, from the input now to the oldest.

        Beyond the oldest reversal the plane is as the first loading leaves it: the line
        alpha = -beta.
        """
        beta = alpha = self.now
        corners = [(beta, alpha)]
        rising = self.reversals[-1] < self.now if self.reversals else self.now > 0.0
        for value in reversed(self.reversals):
            # Where the input rises, the next corner lies to the left of it, at the last minimum.
            beta, alpha = (value, alpha) if rising else (beta, value)
            corners.append((beta, alpha))
            rising = not rising
        far = self.extent
        ended = (-alpha, alpha) if rising else (beta, -beta)
        if ended[0] > beta or ended[1] < alpha:
            # The oldest reversal is nearer to zero than the next one: no first loading beyond it.
            ended = (-far, alpha) if rising else (beta, far)
        return [*corners, ended, (-far, far)]


def memory_figure(memory: Memory, unit: str) -> canvas.Figure:
    """Draw the plane and the zigzag side by side."""
    made = canvas.new_figure(4.6)
    panels = made.subplots(1, 2, width_ratios=(1.0, 1.25))
    draw_memory(list(panels), memory, unit)
    return made


def draw_memory(panels: Sequence[canvas.Axes], memory: Memory, unit: str) -> None:
    """Draw into two panels: the plane of the relays, and the remembered reversals."""
    plane, zigzag = panels
    in_unit = f" ({unit})" if unit else ""
    _plane(memory, plane)
    canvas.dress(plane, "plane of the relays", f"β{in_unit}", f"α{in_unit}")
    _zigzag(memory, zigzag)
    count = len(memory.reversals)
    title = f"{count} remembered reversal{'' if count == 1 else 's'}"
    canvas.dress(zigzag, title, "age: oldest on the left", f"input of the model{in_unit}")
    zigzag.set_xticks([])


def _plane(memory: Memory, axes: canvas.Axes) -> None:
    far = memory.extent
    stairs = memory.staircase()
    beta, alpha = (np.array(values) for values in zip(*stairs, strict=True))
    axes.fill([-far, far, far, -far], [-far, far, far, far], color=canvas.GRID, linewidth=0)
    below = ([-far, *beta], [-far, *alpha])
    axes.fill(*below, color=canvas.BLUE, alpha=0.22, linewidth=0)
    axes.plot([-far, far], [-far, far], color=canvas.SOFT, linewidth=0.9)
    axes.plot(beta, alpha, color=canvas.BLUE, linewidth=1.8)
    axes.plot(memory.now, memory.now, "o", color=canvas.INK, markersize=5)
    for number, value in enumerate(memory.reversals, 1):
        maximum = memory.maxima[number - 1]
        corner = next(one for one in stairs if (one[1] if maximum else one[0]) == value)
        axes.plot(*corner, "o", color=canvas.ORANGE, markersize=4.5)
        if number <= _NUMBERED:
            axes.annotate(
                str(number),
                corner,
                xytext=(-7, 5),
                textcoords="offset points",
                fontsize=8.5,
                ha="right",
                color=canvas.INK,
            )
    axes.text(0.06, 0.52, "up", transform=axes.transAxes, fontsize=9, color=canvas.BLUE)
    axes.text(0.55, 0.93, "down", transform=axes.transAxes, fontsize=9, color=canvas.SOFT)
    axes.set(xlim=(-far, far), ylim=(-far, far), aspect="equal")


def _zigzag(memory: Memory, axes: canvas.Axes) -> None:
    values = [*memory.reversals, memory.now]
    place = np.arange(len(values))
    for (x, y), (next_x, next_y) in pairwise(zip(place, values, strict=True)):
        axes.plot([x, next_x], [y, next_y], color=canvas.BLUE, linewidth=1.4)
    axes.plot(place[:-1], values[:-1], "o", color=canvas.ORANGE, markersize=5)
    axes.plot(place[-1], values[-1], "o", color=canvas.INK, markersize=5)
    above = [*memory.maxima, not memory.reversals or memory.now > memory.reversals[-1]]
    for number, (x, y) in enumerate(zip(place, values, strict=True), 1):
        if number > _NUMBERED and number < len(values):
            continue
        name = "now" if number == len(values) else str(number)
        axes.annotate(
            f"{name}: {y:.4g}",
            (x, y),
            xytext=(0, 7 if above[number - 1] else -14),
            ha="center",
            textcoords="offset points",
            fontsize=8.5,
            color=canvas.INK,
        )
    axes.axhline(0.0, color=canvas.SOFT, linewidth=0.8)
    axes.margins(x=0.16, y=0.15)


_ROWS = 60


def model_table(
    model: PrandtlIshlinskii | ModifiedPrandtlIshlinskii,
    weight_unit: str,
    input_unit: str,
    standard_errors: Sequence[Sequence[float]] = (),
) -> Table:
    """List the weights and thresholds of a model; of a split model both weights."""
    columns: list[tuple[str, list[str]]] = []
    for (name, weights), std in zip(
        _families(model), [*standard_errors, *([[]] * 2)], strict=False
    ):
        columns.append((f"{name}{_of(weight_unit)}", [digits(value, 5) for value in weights]))
        if std:
            errors = map(_error, weights, std, [sum(weights)] * len(std))
            columns.append(("± std", list(errors)))
    modified = isinstance(model, ModifiedPrandtlIshlinskii)
    for name in ["r", "ra", "rb", "rc"] if modified else ["thresholds"]:
        values = [digits(value, 5) for value in getattr(model, name).tolist()]
        columns.append((f"{'r' if name == 'thresholds' else name}{_of(input_unit)}", values))
    rows = [list(cells) for cells in zip(*(cells for _, cells in columns), strict=True)]
    note = f"The first {_ROWS} of {len(rows)}; the model file has all." if len(rows) > _ROWS else ""
    if standard_errors:
        note = f"A weight at its bound, zero, has no standard error. {note}".rstrip()
    return Table(
        "Weights and thresholds",
        ["operator", *(name for name, _ in columns)],
        [[str(index), *cells] for index, cells in enumerate(rows[:_ROWS])],
        note,
    )


def _families(
    model: PrandtlIshlinskii | ModifiedPrandtlIshlinskii,
) -> list[tuple[str, list[float]]]:
    if isinstance(model, ModifiedPrandtlIshlinskii) and model.split:
        return [("w", model.weights.tolist()), ("v", model.weights_negative.tolist())]
    return [("w", model.weights.tolist())]


def _error(weight: float, std: float, scale: float) -> str:
    """Format a standard error; one beyond the sum of all weights says nothing."""
    if not determined(weight, std, scale=scale):
        return NOT_DETERMINED
    return "bound" if math.isnan(std) else digits(std, 2)


def _of(unit: str) -> str:
    return f" ({unit})" if unit else ""


def linear_parts(stage: Stage) -> list[str]:
    """Describe everything of a stage but its hysteresis and its noise."""
    parts = []
    if stage.amplifier_bandwidth is not None:
        parts.append(f"amplifier bandwidth {stage.amplifier_bandwidth:g} Hz")
    parts += map(_section_in_words, _sections(stage))
    if stage.duhem is not None:
        parts.append(f"Duhem operator of {len(stage.duhem.knots)} knots")
    if stage.loop_shift is not None:
        parts.append(_loop_shift(stage.loop_shift, stage.units[1]))
    if stage.relaxing_plays is not None:
        parts.append(relaxing_plays(stage.relaxing_plays))
    if stage.slow_gain is not None:
        amplitude, tau = stage.slow_gain.amplitude, stage.slow_gain.time_constant
        share = digits(100.0 * amplitude)
        parts.append(f"slow gain {share} %, time constant {digits(tau)} s")
    if stage.creep is not None:
        parts.append(f"creep of {len(stage.creep.amplitudes)} terms")
    if stage.temperature is not None:
        term = stage.temperature
        share, unit = digits(term.sensitivity), stage.units[1]
        parts.append(f"{share} {unit} per K, {digits(term.time_constant)} s later")
    if stage.dead_time:
        parts.append(f"dead time {digits(1e3 * stage.dead_time)} ms")
    return parts


def relaxing_plays(plays: RelaxingPlays) -> str:
    """Describe plays that relax by their number and their time constants."""
    number, times = len(plays.thresholds), [digits(tau) for tau in plays.time_constants]
    kind = "play that relaxes" if number == 1 else "plays that relax"
    few = " and ".join(times) if len(times) < 3 else f"{len(times)} from {times[0]} to {times[-1]}"
    return f"{number} {kind}, time constant{'s' if len(times) > 1 else ''} {few} s"


def _loop_shift(shift: LoopShift, unit: str) -> str:
    square, product = map(digits, shift.amplitudes)
    tau = digits(shift.time_constant)
    return f"loop shift {square} and {product} {unit}, time constant {tau} s"


def _sections(stage: Stage) -> list[object]:
    if stage.dynamics is None:
        return []
    return list(stage.dynamics) if isinstance(stage.dynamics, tuple) else [stage.dynamics]


def _section_in_words(section: object) -> str:
    if isinstance(section, SecondOrder):
        frequency, damping = digits(section.frequency), digits(section.damping)
        return f"natural frequency {frequency} Hz, damping ratio {damping}"
    if isinstance(section, FirstOrder):
        return f"first-order lag of {digits(section.frequency)} Hz"
    if isinstance(section, Modes):
        modes = zip(section.modes, section.gains, strict=True)
        return "; ".join(
            f"{_section_in_words(mode)}, static gain {digits(float(g))}" for mode, g in modes
        )
    return repr(section)
