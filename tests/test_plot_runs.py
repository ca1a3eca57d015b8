"""Figures and reports of closed loops: what they show, and what happened in them."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

DT = 1e-3


LIMITS = (-1.0, 1.0)
FAR = {10, 20, 30, 40, 50, 60, 70}  # where the drive is at a limit
BLIND = {100, 101, 102}


class Bench:
    """A plant with events: readings that are missing, and a jump of the position."""

    dt = DT

    def __init__(self, limits: tuple[float, float] | None) -> None:
        self.limits, self.sample, self.drive = limits, -1, 0.0

    @property
    def position(self) -> float:
        k = max(self.sample, 0)
        return math.sin(0.02 * k) - 1e-3 * math.cos(0.05 * k) + 0.5 * (k == 200)

    def read(self) -> float:
        self.sample += 1
        return math.nan if self.sample in BLIND else self.position + 1e-4

    def write(self, drive: float) -> None:
        self.drive = drive


class Table:
    """A controller that knows its drives before."""

    def __init__(self) -> None:
        self.sample = -1

    def step(self, reference: float, measurement: float, /) -> float:  # noqa: ARG002 (a controller has it)
        self.sample += 1
        side = -1.0 if self.sample % 20 else 1.0
        return side if self.sample in FAR else 0.9 * reference


def run(limits: tuple[float, float] | None = LIMITS) -> mh.plant.Run:
    reference = np.sin(0.02 * np.arange(500))
    return mh.plant.simulate(Table(), Bench(limits), reference)


def test_a_run_shows_positions_error_drive_and_events() -> None:
    made = run()
    positions, errors, drives = mh.plot.run(made, dt=DT, units=("V", "nm")).axes
    lines = {line.get_label(): line for line in (*positions.get_lines(), *drives.get_lines())}
    saturated, missing = lines["saturated: 7"], lines["no reading: 3"]
    assert set(np.abs(saturated.get_ydata())) == {1.0}
    np.testing.assert_allclose(np.asarray(missing.get_xdata(), float), [0.1, 0.101, 0.102])
    np.testing.assert_array_equal(lines["true position"].get_ydata(), made.position)
    assert max(errors.get_ylim()) < 0.01
    assert re.match(r"2 of 997 points outside, to -0.5", errors.texts[0].get_text())
    labels = [axes.get_ylabel() for axes in (positions, errors, drives)]
    assert labels == ["position (nm)", "error (nm)", "drive (V)"]
    assert drives.get_xlabel() == "time (s)"


def test_without_time_and_limits_samples_are_counted() -> None:
    made = run(limits=None)
    positions, _, drives = made.plot().axes
    assert drives.get_xlabel() == "sample" and drives.get_xlim() == (0.0, 499.0)
    assert not any("saturated" in str(line.get_label()) for line in drives.get_lines())
    assert positions.get_ylabel() == "position"


def words(path: Path) -> str:
    return re.sub(r"<[^>]*>", " ", path.read_text("utf-8").partition("</style>")[2])


def test_the_report_of_a_run_has_its_numbers(tmp_path: Path) -> None:
    made, path = run(), tmp_path / "run.html"
    made.report(path, dt=DT, name="my <stage>", units=("V", "nm"))
    page = words(path)
    for said in ("my &lt;stage&gt;", "7 of 500 samples at -1 or 1", "3 of 500 samples", "1000 Hz"):
        assert said in page
    assert f"{made.metrics.max_position_error:.4f}" in page
    assert "mpi_hyst.reports.run in Python" in page and "simulation" not in page
    # The samples tell which run it is.
    other = tmp_path / "other.html"
    made.report(other, dt=DT)
    again = [re.search(r"SHA-256 ([0-9a-f]{64})", words(one)) for one in (path, other)]
    assert again[0] and again[1] and again[0][1] == again[1][1]


def test_wrong_arguments_are_named(tmp_path: Path) -> None:
    options: dict[str, Any]
    for options, said in (
        ({"dt": "fast"}, "dt: expected a number of seconds, got 'fast'"),
        ({"dt": DT, "name": 3}, "name: expected a text, got 3"),
        ({"dt": DT, "units": ("V",)}, r"units: expected the names of two units, got \('V',\)"),
    ):
        with pytest.raises(TypeError, match=rf"^{said}$"):
            mh.reports.run(run(), tmp_path / "run.html", **options)
    with pytest.raises(TypeError, match=r"^path: expected the name of a file, got 3$"):
        mh.reports.run(run(), 3, dt=DT)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("samples", [1, 2])
def test_the_shortest_runs_are_shown(samples: int) -> None:
    zeros = [0.0] * samples
    made = mh.plant.Run(zeros, zeros, zeros, zeros)
    assert len(mh.plot.run(made, dt=DT).axes) == 3
    assert "Closed loop" in made._repr_html_()
