"""Draws docs/cost_against_n.svg from benches/reference.json: `make picture`."""

import json
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

REFERENCE = Path(__file__).parents[1] / "benches" / "reference.json"
OUTPUT = Path(__file__).with_name("cost_against_n.svg")
STYLES = {
    "plain-loop": ("#9a9a9a", "plain loop"),
    "fused-loop": ("#8a7a3c", "fused loop, {portable}"),
    "fused-loop-v3": ("#3f7f4f", "fused loop, x86-64-v3"),
    "fused-loop-v4": ("#7a4f8f", "fused loop, x86-64-v4"),
    "bank": ("#5aa0d8", "bank"),
    "inverse": ("#b2452c", "exact inverse"),
    "forward": ("#1f5a99", "forward"),
}
SIGNALS = {
    "1 Hz sine": "smooth: 1 Hz sine at 10 kHz",
    "50 Hz sine + 0.1 V noise": "noisy: 50 Hz sine with 0.1 V of noise",
    "white noise, full range": "rough: white noise over the full range",
}


def main() -> None:
    """Time per sample against the number of operators: smooth, noisy and the worst case."""
    reference = json.loads(REFERENCE.read_text(encoding="utf-8"))
    cases = reference["cases"]
    portable = reference["machine"]["target"].split("-")[0].replace("_", "-")
    measured = {case["what"] for case in cases}  # v3 and v4 where the processor has them
    styles = {what: style for what, style in STYLES.items() if what in measured}
    figure = Figure(figsize=(13.2, 4.2), layout="constrained")
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, (signal, title) in zip(panels, SIGNALS.items(), strict=True):
        costs = {
            what: {
                case["operators"]: case["nanoseconds"]
                for case in cases
                if (case["signal"], case["what"], case["mode"]) == (signal, what, "step")
            }
            for what in styles
        }
        last = max(max(cost) for cost in costs.values())
        heights = apart({what: cost[last] for what, cost in costs.items() if last in cost})
        # Where a line ends sooner, its name has room below.
        heights |= {what: 0.6 * cost[max(cost)] for what, cost in costs.items() if last not in cost}
        for what, (colour, label) in styles.items():
            operators = sorted(costs[what])
            times = [costs[what][n] for n in operators]
            axes.loglog(operators, times, color=colour, linewidth=1.4, marker="o", markersize=4)
            axes.annotate(
                label.format(portable=portable),
                (operators[-1], heights[what]),
                xytext=(7, 0),
                textcoords="offset points",
                color=colour,
                va="center",
                fontsize=9,
            )
        axes.set_title(title, fontsize=10)
        axes.set_xlabel("operators n")
        axes.set_xticks(operators, [f"{n:,}".replace(",", " ") for n in operators])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlim(0.7, 2_500_000)  # room for the names of the lines
        axes.grid(axis="y", color="#e4e4e4", linewidth=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines["bottom"].set_bounds(operators[0], operators[-1])
    panels[0].set_ylabel("time per sample")
    panels[0].yaxis.set_major_formatter(FuncFormatter(duration))
    panels[0].yaxis.set_minor_locator(NullLocator())
    with mpl.rc_context({"svg.hashsalt": "mpi_hyst"}):  # the same file every time
        figure.savefig(OUTPUT, metadata={"Date": None})


def apart(ends: dict[str, float]) -> dict[str, float]:
    """Heights for the names beside the ends of lines, at least a line of text apart."""
    heights: dict[str, float] = {}
    lowest = 0.0
    for what in sorted(ends, key=ends.__getitem__):
        heights[what] = max(ends[what], lowest)
        lowest = 1.6 * heights[what]
    return heights


def duration(nanoseconds: float, _position: int) -> str:
    """Nanoseconds as a tick label."""
    return f"{nanoseconds:g} ns" if nanoseconds < 1000.0 else f"{nanoseconds / 1000.0:g} µs"


if __name__ == "__main__":
    main()
