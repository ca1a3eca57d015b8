"""Glitches of the position are left out of a fit: the keyword `loss`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import mpi_hyst as mh
import numpy as np
import pytest
from commands import run
from support import Array

RATE = 1000.0
PLAIN: dict[str, Any] = {"operators": 8, "dynamics": None, "creep": None, "loop_shift": None}


def record(seed: int) -> tuple[Array, Array]:
    """Return drive and position of the actuator of the paper, with 5 nm of noise."""
    u = mh.signals.decaying_triangle(500.0, 4.0, cycles=12, rate=RATE)
    y = mh.paper.table_1_recovered().forward().run(u)
    return u, y + np.random.default_rng(seed).normal(0.0, 0.005, u.size)


def glitched(y: Array, share: float, seed: int) -> tuple[Array, Array]:
    """Return the position with spikes, drop-outs and runs, and where they are."""
    rng = np.random.default_rng(seed)
    y, count = y.copy(), int(share * y.size)
    spikes = rng.choice(np.arange(20, y.size - 20), count // 2, replace=False)
    y[spikes] += rng.uniform(-1.0, 1.0, spikes.size) * np.ptp(y)
    y[spikes[::3]] = 0.0
    runs = [
        np.arange(first, first + 3 + first % 8) for first in rng.choice(y.size - 100, count // 13)
    ]
    places = np.unique(np.concatenate([spikes, *runs]))
    for one in runs:
        y[one] = rng.uniform(y.min(), y.max())
    return y, places


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("share", [0.01, 0.03])
def test_glitches_cost_no_accuracy(seed: int, share: float) -> None:
    u, y = record(seed)
    spoilt, places = glitched(y, share, seed + 10)
    unseen = 400.0 * np.sin(np.arange(3000) / 70.0) * np.linspace(0.1, 1.0, 3000)
    truth = mh.paper.table_1_recovered().forward().run(unseen)

    def error(y: Array, loss: Literal["auto", "squares"]) -> float:
        found = mh.identify(u, y, dt=1.0 / RATE, loss=loss, **PLAIN)
        return float(np.std(found.predict(unseen) - truth))

    clean = error(y, "auto")
    assert error(spoilt, "auto") < 1.2 * clean
    assert error(spoilt, "squares") > 2.0 * clean
    found = mh.identify(u, spoilt, dt=1.0 / RATE, **PLAIN)
    assert set(found.left_out_samples[0]) <= set(places.tolist())
    assert found.fit.samples == u.size - len(found.left_out_samples[0])
    assert found.fit.rmse < 1.2 * 0.006


def test_a_clean_record_gives_the_same_bits() -> None:
    u, y = record(4)
    auto = mh.identify(u, y, dt=1.0 / RATE, loss="auto", **PLAIN)
    squares = mh.identify(u, y, dt=1.0 / RATE, loss="squares", **PLAIN)
    assert auto.model == squares.model
    assert auto.left_out_samples == squares.left_out_samples == [[]]


def test_models_are_compared_without_glitches() -> None:
    u, y = record(5)
    spoilt, _ = glitched(y, 0.01, 6)
    clean, found = (mh.compare(u, y, operators=6, smoothness=0.0) for y in (y, spoilt))
    assert len(found.left_out_samples[0]) > 20 and found.simplest == clean.simplest
    for one, other in zip(found.rows, clean.rows, strict=True):
        assert one.held_out == pytest.approx(other.held_out, rel=0.2)


def test_the_choices_are_named() -> None:
    u, y = record(6)
    wrong: Any = "l1"
    with pytest.raises(
        ValueError, match=r'^loss: expected "auto", "squares" or "robust", got "l1"'
    ):
        mh.identify(u, y, loss=wrong)


def test_the_command_line_tells_how_many(tmp_path: Path) -> None:
    u, y = record(7)
    y[[300, 700, 701]] = -40.0
    path = tmp_path / "record.csv"
    np.savetxt(path, np.c_[u, y], delimiter=",", header="drive,position", comments="")
    plain = ["--rate", "1000", "--operators", "8", "--creep", "none", "--dynamics", "none"]
    command = ["identify", str(path), "--input", "drive", "--output", "position", *plain]
    assert "3 glitches left out" in run(*command).output
    assert "left out" not in run(*command, "--loss", "squares").output.partition("\n\n")[2][:200]


def test_geometric_thresholds() -> None:
    u, y = record(8)
    found = mh.identify(u, y, thresholds="geometric", operators=8, input_offset=0.0)
    assert isinstance(found.model, mh.ModifiedPrandtlIshlinskii)
    r = found.model.r
    assert r[0] == 0.0 and r[1] == pytest.approx(0.01 * np.abs(u).max())
    assert np.allclose(r[2:] / r[1:-1], 100.0 ** (1.0 / 7.0)) and r[-1] < np.abs(u).max()
