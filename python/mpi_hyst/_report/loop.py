"""The loop of a tuning over frequency: Bode diagram and sensitivity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from mpi_hyst._core import Tuning
from mpi_hyst._report import canvas
from mpi_hyst._types import Samples

_POINTS = 3000
_BELOW = 100.0  # how far below the rejection bandwidth the figure begins
_LEAST = 1e-3  # of magnitudes: what is below says nothing about the loop


def figure(tuning: Tuning) -> Figure:
    """Draw magnitude and phase of the open loop, and the sensitivity, one below the other."""
    made = canvas.new_figure(8.4)
    panels = made.subplots(3, 1, sharex=True, height_ratios=(1.0, 0.75, 1.0))
    draw(tuning, list(panels))
    canvas.top_legend(made, panels[2])
    return made


def draw(tuning: Tuning, panels: Sequence[Axes]) -> None:
    """Draw into three panels: magnitude and phase of the open loop, and the sensitivity."""
    magnitude, phase, sensitivity = panels
    frequencies = _frequencies(tuning)
    looks = [
        (tuning.at_min_slope, canvas.GREEN, "smallest slope of the hysteresis"),
        (tuning.at_max_slope, canvas.BLUE, "largest slope"),
    ]
    for margins, colour, name in looks:
        loop = tuning.open_loop(frequencies, margins.slope)
        look: dict[str, Any] = {"color": colour, "linewidth": 1.2}
        magnitude.plot(frequencies, np.abs(loop), **look)
        phase.plot(frequencies, np.degrees(np.unwrap(np.angle(loop))), **look)
        left = np.abs(tuning.sensitivity(frequencies, margins.slope))
        sensitivity.plot(frequencies, left, label=name, **look)
        if margins.crossover > 0.0:
            magnitude.plot([margins.crossover], [1.0], "o", color=colour, markersize=4.5)
    worst = tuning.worst_sensitivity(frequencies)
    orange = canvas.ORANGE
    sensitivity.plot(
        frequencies, worst, color=orange, linewidth=1.4, label="worst of all slopes and modes"
    )
    limit = tuning.peak_sensitivity_limit
    sensitivity.axhline(
        limit, color=canvas.INK, linewidth=1.0, linestyle="--", label=f"allowed: {limit:g}"
    )
    sensitivity.axvline(tuning.rejection_bandwidth, color=canvas.SOFT, linewidth=0.8, linestyle=":")
    magnitude.axhline(1.0, color=canvas.SOFT, linewidth=0.8)
    phase.axhline(-180.0, color=canvas.SOFT, linewidth=0.8)
    canvas.dress(magnitude, "open loop: magnitude", "", "|L|")
    canvas.dress(phase, "open loop: phase", "", "degrees")
    canvas.dress(sensitivity, "sensitivity 1 / (1 + L)", "frequency (Hz)", "|S|")
    phase.yaxis.set_major_locator(MultipleLocator(90.0))
    for axes in panels:
        axes.set_xscale("log")
        axes.set_xlim(frequencies[0], frequencies[-1])
    for axes in (magnitude, sensitivity):
        axes.set_yscale("log")
    magnitude.set_ylim(bottom=max(magnitude.get_ylim()[0], _LEAST))


def _frequencies(tuning: Tuning) -> Samples:
    """Return frequencies up to half of the sampling rate, evenly on a logarithmic axis.

    At half of the rate itself L is real, and its phase may be one turn more or less.
    """
    highest = 0.5 / tuning.dt * 0.995
    bandwidth = min(max(tuning.rejection_bandwidth, 1e-4 * highest), highest)
    # The peaks that the margins name are among them, however narrow.
    peaks = [tuning.at_min_slope.peak_frequency, tuning.at_max_slope.peak_frequency]
    even = np.geomspace(bandwidth / _BELOW, highest, _POINTS)
    return np.unique(np.clip([*even, *peaks], even[0], highest))
