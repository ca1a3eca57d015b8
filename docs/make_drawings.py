"""Draws the pictures of docs/explanation: `make picture`."""

from __future__ import annotations

from doctest import DocTestParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib as mpl
import mpi_hyst as mh
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

FOLDER = Path(__file__).with_name("explanation")
BLUE, RED, GREY = "#1f5a99", "#b2452c", "#9a9a9a"


def save(figure: Figure, name: str) -> None:
    """Write a figure: the same bytes every time."""
    with mpl.rc_context({"svg.hashsalt": "mpi_hyst"}):
        figure.savefig(FOLDER / f"{name}.svg", metadata={"Date": None})


def plain(axes: Axes, xlabel: str, ylabel: str) -> None:
    """Take away what tells nothing."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)


def operators() -> None:
    """Draw a play and a coupled play, each over a large and a small loop, with their thresholds."""
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    drive = np.concatenate(
        [np.linspace(a, b, 200) for a, b in ((0, 25), (25, -25), (-25, 25), (25, 4), (4, 25))]
    )
    play, coupled = mh.Play(6.0), mh.CoupledPlay(10.0, ra=8.0, rb=3.0, rc=4.0)
    ticks = {
        "play": (play, {"-r": -6, "r": 6}),
        "coupled play": (coupled, {"-ra": -8, "-rb": -3, "rc": 4, "r": 10}),
    }
    for axes, (title, (operator, marks)) in zip(figure.subplots(1, 2), ticks.items(), strict=True):
        axes.plot(drive, [operator.step(float(x)) for x in drive], color=BLUE, linewidth=1.4)
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.axvline(0.0, color=GREY, linewidth=0.6)
        axes.set_xticks(list(marks.values()), list(marks))
        axes.set_yticks([0])
        axes.set_title(title, fontsize=10)
        plain(axes, "drive x", "output z")
    save(figure, "operators")


def memory() -> None:
    """Draw a drive with its remembered turning points, and the loops that they make."""
    corners = [0.0, 9.0, 1.5, 7.0, 3.0, 5.5, 2.4]
    drive = np.concatenate([np.linspace(a, b, 60, endpoint=False) for a, b in pairwise(corners)])
    model = mh.PrandtlIshlinskii([0.5] + [0.25] * 10, np.arange(11) * 0.5)
    position = model.forward().run(drive)
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(drive, color=BLUE, linewidth=1.4)
    for i, name in (
        (1, "9 V kept"),
        (2, "1.5 V kept"),
        (3, "7 V kept"),
        (4, "3 V wiped out"),
        (5, "5.5 V wiped out"),
    ):
        kept = "kept" in name
        left.plot(60 * i, corners[i], "o", color=BLUE if kept else RED, markersize=5)
        left.annotate(
            name,
            (60 * i, corners[i]),
            xytext=(0, 6 if i % 2 else -13),
            textcoords="offset points",
            fontsize=8,
            ha="center",
        )
    left.set(xlim=(-20, 400), ylim=(-0.6, 10.0))
    plain(left, "sample", "drive (V)")
    right.plot(drive, position, color=BLUE, linewidth=1.2)
    plain(right, "drive (V)", "position (µm)")
    save(figure, "memory")


def inverse() -> None:
    """Draw a branch of the model and of its inverse: the same polyline with the axes exchanged."""
    model = mh.PrandtlIshlinskii([0.4, 0.35, 0.3, 0.25], [0.0, 1.0, 2.2, 3.2])
    stream = model.forward()
    stream.run(np.linspace(0.0, 8.0, 100))
    drive = np.linspace(8.0, 0.0, 400)
    position = stream.run(drive)
    slope = np.diff(position) / np.diff(drive)
    kinks = np.flatnonzero(abs(np.diff(slope)) > 1e-3 * abs(slope).max()) + 1
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    for axes, x, y, names in (
        (figure.add_subplot(121), drive, position, ("drive (V)", "position (µm)")),
        (figure.add_subplot(122), position, drive, ("target (µm)", "drive (V)")),
    ):
        axes.plot(x, y, color=BLUE, linewidth=1.4)
        axes.plot(x[kinks], y[kinks], "o", color=RED, markersize=4)
        plain(axes, *names)
    figure.axes[0].set_title("falling branch of the model", fontsize=10)
    figure.axes[1].set_title("the same pieces, exchanged: the inverse", fontsize=10)
    save(figure, "inverse")


def boxes(name: str, labels: list[str], ends: tuple[str, str], colours: dict[int, str]) -> None:
    """Draw a chain of boxes from left to right in two rows, if there are many."""
    columns = 5
    rows = -(-len(labels) // columns)
    figure = Figure(figsize=(8.0, 0.4 + 0.9 * rows))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-0.75, columns + 0.55), ylim=(-rows, 0.15))
    axes.axis("off")
    for i, label in enumerate(labels):
        x, y = i % columns + 0.1, -(i // columns) - 0.75
        axes.add_patch(
            FancyBboxPatch(
                (x, y),
                0.72,
                0.5,
                boxstyle="round,pad=0.02",
                facecolor=colours.get(i, "#ffffff"),
                edgecolor=BLUE,
            )
        )
        axes.text(x + 0.36, y + 0.25, label, ha="center", va="center", fontsize=9)
        axes.annotate(
            "",
            (x - 0.03, y + 0.25),
            (x - 0.24, y + 0.25),
            arrowprops={"arrowstyle": "->", "color": GREY},
        )
    last = len(labels) - 1
    x, y = last % columns + 0.84, -(last // columns) - 0.5
    axes.annotate("", (x + 0.22, y), (x, y), arrowprops={"arrowstyle": "->", "color": GREY})
    axes.text(-0.16, -0.5, ends[0], ha="right", va="center", fontsize=9)
    axes.text(x + 0.25, y, ends[1], ha="left", va="center", fontsize=9)
    save(figure, name)


def time() -> None:
    """Drives that are held, positions that are read, and a dead time of one sample."""
    figure = Figure(figsize=(8.0, 3.0), layout="constrained")
    axes = figure.subplots()
    u = np.array([0.0, 2.0, 3.0, 2.5, 1.0])
    axes.step(
        range(6),
        [*u, u[-1]],
        where="post",
        color=BLUE,
        label="drive u(k), put out at t(k) and held",
    )
    axes.plot(range(5), 4.2 + 0.4 * u, "o", color=GREY, label="position y(k), dead time 0")
    axes.plot(
        range(5),
        4.2 + 0.4 * np.array([0.0, *u[:-1]]),
        "s",
        color=RED,
        markersize=5,
        label="position y(k), dead time of one sample",
    )
    axes.set_xticks(range(6), [f"t({k})" for k in range(6)])
    axes.set_yticks([])
    axes.legend(fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    plain(axes, "time", "")
    save(figure, "time")


def tuning() -> None:
    """Draw what a loop leaves of disturbances, at both ends of the slope, under its bound."""
    stage = mh.Stage(
        mh.paper.table_1_recovered(), dynamics=mh.plant.SecondOrder(800.0, 0.02), dead_time=1e-4
    )
    found = stage.tune(1e-4)
    frequencies = np.geomspace(5.0, 5000.0, 800)
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for margins, colour, name in (
        (found.at_min_slope, GREY, "smallest slope"),
        (found.at_max_slope, BLUE, "largest slope"),
    ):
        axes.loglog(
            frequencies,
            abs(found.sensitivity(frequencies, margins.slope)),
            color=colour,
            label=name,
        )
    axes.loglog(
        frequencies,
        found.worst_sensitivity(frequencies),
        color=RED,
        linewidth=0.9,
        label="worst case",
    )
    axes.axhline(
        found.peak_sensitivity_limit, color=RED, linestyle="--", linewidth=0.9, label="bound"
    )
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(0.02, 0.9))
    axes.set_yticks(
        [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2], ["0.02", "0.05", "0.1", "0.2", "0.5", "1", "2"]
    )
    axes.minorticks_off()
    plain(axes, "frequency (Hz)", "sensitivity |S|")
    save(figure, "tuning")


def uncertainty() -> None:
    """Draw between which positions the truth lies, from an unknown history on."""
    bracket = mh.paper.table_1_recovered().bracket(limits=(-500.0, 500.0))
    drive = mh.signals.triangle(500.0, 1.0, seconds=1.2, rate=500.0)
    between = np.array([bracket.step(float(u)) for u in drive])
    time_axis = np.arange(drive.size) / 500.0
    figure = Figure(figsize=(8.0, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.fill_between(time_axis, between[:, 0], between[:, 1], color=BLUE, alpha=0.5)
    left.plot(time_axis, between.mean(axis=1), color=BLUE, linewidth=0.9)
    plain(left, "time (s)", "position (µm)")
    right.plot(time_axis, 1e3 * (between[:, 1] - between[:, 0]), color=BLUE)
    plain(right, "time (s)", "width (nm)")
    save(figure, "uncertainty")


def learning() -> None:
    """Draw the error of twenty periods, of a loop that believes in another gain and resonance."""
    actuator = mh.paper.table_1_recovered()
    stage = mh.Stage(
        actuator,
        limits=(-500.0, 500.0),
        dead_time=1e-4,
        noise=0.002,
        dynamics=mh.plant.SecondOrder(800.0, 0.02),
    )
    worn = stage.replace(
        hysteresis=mh.ModifiedPrandtlIshlinskii.from_ratios(
            1.02 * actuator.weights, actuator.r, ra=0.95, rb=0.30, rc=0.35
        ),
        dynamics=mh.plant.SecondOrder(780.0, 0.03),
    )
    period = 250  # samples
    wave = mh.signals.sine(2.0, 1e4 / period, seconds=0.5, rate=1e4)
    figure = Figure(figsize=(8.0, 2.8), layout="constrained")
    axes = figure.subplots()
    for name, colour, learns in (
        ("preview and feedback", GREY, None),
        ("with repetitive control as well", BLUE, period),
    ):
        controller = stage.controller(1e-4, feedforward="preview", period=learns)
        run = mh.plant.simulate(controller, worn.plant(1e-4), wave)
        errors = (run.position - wave).reshape(-1, period)
        rms = 1e3 * np.sqrt(np.mean(errors**2, axis=1))
        axes.semilogy(
            1 + np.arange(rms.size), rms, marker="o", markersize=4, color=colour, label=name
        )
    axes.set_xticks(range(2, 21, 2))
    axes.set_yticks([0.5, 1, 2, 5, 10], ["0.5", "1", "2", "5", "10"])
    axes.minorticks_off()
    axes.legend(fontsize=8, loc="lower left")
    plain(axes, "period", "rms error (nm)")
    save(figure, "learning")


def inside() -> None:
    """Draw hysteresis that acts on the motion, and how well it is identified."""
    dt = 1e-3
    hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    plant = mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)
    record = mh.signals.chirp(60.0, 5.0, 100.0, seconds=2.0, rate=1 / dt)
    found = mh.identify_oscillator(record, plant.response(record, dt=dt), dt=dt)
    t = dt * np.arange(600)
    drive = 40.0 * (np.sin(2 * np.pi * 11.0 * t) + np.sin(2 * np.pi * 29.0 * t))
    y = plant.response(drive, dt=dt)
    # Without hysteresis, as stiff as the oscillator is about 0.
    flat = mh.Duhem([-1.0, 1.0], [1e-6, 1e-6], [1e-6, 1e-6])
    linear = mh.plant.HystereticOscillator(0.5, 5.0, 5e4, flat).response(drive, dt=dt)
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(1e3 * y, plant.hysteresis.run(y), color=BLUE, linewidth=1.0)
    plain(left, "position y (mm)", "hysteresis z (m/s²)")
    for name, response, colour in (
        ("hysteresis left out", linear, GREY),
        ("identified", found.model.response(drive, dt=dt), BLUE),
    ):
        right.semilogy(t, 1e6 * abs(response - y) + 1e-6, color=colour, linewidth=0.9, label=name)
    right.legend(fontsize=8, loc="lower right")
    plain(right, "time (s)", "error on an unseen drive (µm)")
    save(figure, "inside")


def slack() -> None:
    """Draw what the page on slack computes: the slack, and how the motor crosses it."""
    page: dict[str, Any] = {}
    text = (FOLDER.parent / "how-to" / "slack_and_friction.md").read_text("utf-8")
    for example in DocTestParser().get_examples(text.split("## A stage that sticks")[0]):
        exec(compile(example.source, "slack_and_friction.md", "exec"), page)
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(
        1e3 * page["motor"][-4000::20], 1e3 * page["measured"][-4000::20], color=BLUE, linewidth=1.0
    )
    plain(left, "motor (µm)", "carriage, measured (µm)")
    shown = slice(900, 1300)
    seconds = page["dt"] * np.arange(page["slow"].size)[shown]
    for name, place, color in (("motor", page["slow"], RED), ("carriage", page["reached"], BLUE)):
        right.plot(seconds, 1e3 * place[shown], color=color, linewidth=1.2, label=name)
    right.legend(fontsize=8)
    plain(right, "time (s)", "place (µm)")
    save(figure, "slack")


def main() -> None:
    """Draw everything."""
    operators()
    memory()
    inverse()
    time()
    boxes(
        "stage",
        [
            "limits",
            "dead time",
            "amplifier",
            "input map",
            "hysteresis",
            "output map",
            "loop shift",
            "creep",
            "modes",
            "sensor",
        ],
        ("drive", "reading"),
        {4: "#dfeaf5"},
    )
    boxes(
        "inverse_chain",
        ["inverse of\nthe modes", "creep⁻¹", "loop shift⁻¹", "maps⁻¹", "hysteresis⁻¹"],
        ("target", "drive"),
        {4: "#dfeaf5"},
    )
    tuning()
    uncertainty()
    learning()
    inside()
    slack()


if __name__ == "__main__":
    main()
