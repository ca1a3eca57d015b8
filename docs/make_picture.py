"""Draws docs/compensation.svg, the picture of the README: `make picture`."""

from pathlib import Path

import matplotlib as mpl
import mpi_hyst as mh
from matplotlib.figure import Figure

OUTPUT = Path(__file__).with_name("compensation.svg")
LOOP, STRAIGHT, TARGET = "#b2452c", "#1f5a99", "#9a9a9a"


def main() -> None:
    """One actuator, one target: driven in proportion, and through the exact inverse."""
    actuator = mh.paper.table_1_recovered()
    target = mh.signals.decaying_triangle(3.0, 1.0, cycles=4, rate=500)
    gain = 500.0 / actuator.forward().step(500.0)
    open_loop = actuator.forward().run(gain * target)
    compensated = actuator.forward().run(actuator.inverse(limits=(-500.0, 500.0)).run(target))

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, position, colour, title in (
        (panels[0], open_loop, LOOP, "drive = gain × target"),
        (panels[1], compensated, STRAIGHT, "drive = exact inverse of target"),
    ):
        axes.plot([-3, 3], [-3, 3], color=TARGET, linewidth=0.8, linestyle="--")
        axes.plot(target, position, color=colour, linewidth=1.1)
        worst = 1e3 * abs(position - target).max()
        label = f"{worst:.0f} nm" if worst > 1.0 else "below 1e-6 nm"
        axes.set_title(f"{title}\nlargest error {label}", fontsize=10)
        axes.set_xlabel("target (µm)")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("position (µm)")
    with mpl.rc_context({"svg.hashsalt": "mpi_hyst"}):  # the same file every time
        figure.savefig(OUTPUT, metadata={"Date": None})


if __name__ == "__main__":
    main()
