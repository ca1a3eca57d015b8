"""The operators of a model over one drive: each with its weight, and what they add up to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import canvas
from mpi_hyst._types import Model, Samples

_SHOWN = 7  # operators, from the first to the last: more could not be told apart


def figure(model: Model, drive: Samples, quantities: tuple[Quantity, Quantity]) -> Figure:
    """Draw both panels side by side."""
    made = canvas.new_figure(4.4)
    panels = list(made.subplots(1, 2, width_ratios=(1.0, 1.0)))
    draw(model, drive, panels, quantities)
    return made


def draw(
    model: Model, drive: Samples, panels: Sequence[Axes], quantities: tuple[Quantity, Quantity]
) -> None:
    """Draw into two panels: weighted operators, and the sum of the first of them."""
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
    if isinstance(model, mh.PrandtlIshlinskii):
        pairs = zip(model.weights.tolist(), model.thresholds.tolist(), strict=True)
        return [w * mh.Play(r).run(x) for w, r in pairs]
    thresholds = zip(*(a.tolist() for a in (model.r, model.ra, model.rb, model.rc)), strict=True)
    weights = zip(model.weights.tolist(), model.weights_negative.tolist(), strict=True)
    made = []
    for four, (w, v) in zip(thresholds, weights, strict=True):
        z = mh.CoupledPlay(*four).run(x)
        made.append(np.where(z > 0.0, w, v) * z)
    return made
