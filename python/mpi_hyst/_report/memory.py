"""What a stream remembers: its reversals in a plane like that of Preisach, and as a zigzag.

A point of the plane is a relay that goes up where the input rises to alpha and down where it falls
to beta. The relays that are up lie below a staircase. Its corners are the remembered reversals:
maxima in alpha, minima in beta. A rising input sweeps upwards, a falling one to the left, and what
they sweep over is forgotten.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpi_hyst._report import canvas

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


def figure(memory: Memory, unit: str) -> Figure:
    """Draw the plane and the zigzag side by side."""
    made = canvas.new_figure(4.6)
    panels = made.subplots(1, 2, width_ratios=(1.0, 1.25))
    draw(memory, list(panels), unit)
    return made


def draw(memory: Memory, panels: Sequence[Axes], unit: str) -> None:
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


def _plane(memory: Memory, axes: Axes) -> None:
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


def _zigzag(memory: Memory, axes: Axes) -> None:
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
