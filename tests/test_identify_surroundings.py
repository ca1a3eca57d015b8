"""What surrounds the hysteresis in a fit: maps, creep and an amplifier."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, run
from stages import BENCHES, Bench
from support import Array

SMALL: dict[str, Any] = {"operators": 8, "dynamics": None, "creep": None, "loop_shift": None}


def behind_tanh() -> Bench:
    return next(bench for bench in BENCHES if bench.name == "behind tanh")


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_saturating_stage_gets_a_map_that_predicts_better() -> None:
    bench = behind_tanh()
    u, skip = bench.drive()
    y = bench.position(u) + np.random.default_rng(1).normal(
        0.0, 1e-4 * np.ptp(bench.position(u)), u.size
    )
    unseen = bench.cycles(3) * 0.8 + 0.2 * bench.low
    truth = bench.position(np.r_[u, unseen])[-unseen.size :]
    left = {}
    none: dict[str, Any] = {"input_map": None, "output_map": None}
    for name, maps in (("auto", {}), ("none", none)):
        found = mh.identify(u, y, dt=1e-3, skip=skip, **SMALL, **maps)
        predicted = found.stage.forward(1e-3).run(np.r_[u, unseen])[-unseen.size :]
        left[name] = rms(predicted - truth - np.mean(predicted - truth)) / np.ptp(truth)
        assert (found.input_map is None and found.output_map is None) == (name == "none")
        assert (found.stage.input_map, found.stage.output_map) == (
            found.input_map,
            found.output_map,
        )
    assert left["auto"] < 0.5 * left["none"], left


def lagged(x: Array, dt: float, time: float) -> Array:
    share, out, last = -np.expm1(-dt / time), np.empty(x.size), x[0]
    for k, now in enumerate(x.tolist()):
        out[k] = last
        last += share * (now - last)
    return out


def rested(corners: list[float], rest: int) -> Array:
    """Return a way in 100 samples to each corner, and a rest there."""
    parts, last = [np.zeros(1)], 0.0
    for corner in corners:
        parts += [np.linspace(last, corner, 101)[1:], np.full(rest, corner)]
        last = corner
    return np.concatenate(parts)


def test_creep_by_a_power_of_time_has_an_amplitude_for_every_decade() -> None:
    dt, thresholds = 0.02, np.linspace(0.0, 45.0, 19)
    weights = np.r_[0.6, 0.04 * np.exp(-thresholds[1:] / 25.0)]
    plays = mh.PrandtlIshlinskii(weights, thresholds)

    def position(u: Array) -> Array:
        x = plays.forward().run(u)
        creep = [
            0.004 * time**0.4 * lagged(x, dt, time) for time in (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
        ]
        return np.asarray(x + np.sum(creep, axis=0))

    u = rested([50.0, -50.0, 40.0, -30.0, 20.0, -10.0, 45.0, -45.0, 0.0], 500)
    y = position(u) + np.random.default_rng(1).normal(0.0, 0.02, u.size)
    other = rested([30.0, -40.0, 10.0, -20.0, 48.0, 0.0], 1000)

    def off(found: mh.results.Identification) -> float:
        return float(np.std(found.predict(other, dt=dt) - position(other)))

    # Plays that relax do what such creep does, and 0.026 % is left.
    alone: dict[str, Any] = {"dt": dt, "relaxing_plays": None}
    found = mh.identify(u, y, **alone)
    assert found.creep is not None
    assert found.creep.time_constants.tolist() == [1.0, 10.0, 100.0]
    assert found.creep.amplitudes.tolist() == sorted(found.creep.amplitudes)
    # 0.036 and 0.166 % of the range were measured.
    assert off(found) < 0.4 * off(mh.identify(u, y, creep="log", **alone))
    assert off(mh.identify(u, y, dt=dt)) < 1.1 * off(found)


HEATED = mh.PrandtlIshlinskii(np.r_[0.6, np.linspace(0.04, 0.005, 18)], np.linspace(0.0, 45.0, 19))


def heated(u: Array, dt: float, time: float) -> Array:
    """Return where plays are that see the drive behind a lag: of a charge amplifier, or of heat."""
    return HEATED.forward().run(lagged(u, dt, time))


def turned(sizes: list[float], samples: int) -> Array:
    """Return straight ways to these places."""
    ways = [np.linspace(a, b, samples, endpoint=False) for a, b in pairwise(sizes)]
    return np.concatenate([*ways, sizes[-1:]])


@pytest.mark.parametrize(("dt", "time"), [(2e-3, 0.01), (0.05, 0.7)])
def test_a_lag_in_front_of_the_hysteresis_is_none_behind_it(dt: float, time: float) -> None:
    u = turned([0.0, 50.0, -50.0, 40.0, -30.0, 20.0, -45.0, 35.0, -20.0, 50.0, 0.0], 150)
    y = heated(u, dt, time)
    y = y + np.random.default_rng(1).normal(0.0, 5e-4 * np.ptp(y), u.size)
    other = turned([0.0, 45.0, -40.0, 15.0, -25.0, 48.0, 0.0], 220)
    found = mh.identify(u, y, dt=dt)
    off = rms(np.asarray(found.predict(other, dt=dt)) - heated(other, dt, time)) / np.ptp(y)
    assert off < 5e-4, found.stage
    amplifier = found.stage.amplifier_bandwidth
    assert amplifier is not None
    assert 1.0 / (2.0 * np.pi * amplifier) == pytest.approx(time, rel=0.05)
    # The stage does what the fit predicts, also with a bandwidth that is given.
    for one in (found, mh.identify(u, y, dt=dt, amplifier=amplifier, dynamics=None)):
        stream = one.stage.forward(dt)
        stream.settle(other[0])
        np.testing.assert_allclose(stream.run(other), one.predict(other, dt=dt), rtol=0, atol=1e-9)
        assert one.stage.amplifier_bandwidth == pytest.approx(amplifier)


def test_a_lag_in_front_is_found_beside_a_dead_time_that_is_given() -> None:
    dt, time = 2e-3, 0.01
    u = turned([0.0, 50.0, -50.0, 40.0, -30.0, 20.0, -45.0, 35.0, -20.0, 50.0, 0.0], 150)
    y = heated(u, dt, time)
    y = y + np.random.default_rng(1).normal(0.0, 5e-4 * np.ptp(y), u.size)
    # Nothing else is left open.
    settled: dict[str, Any] = {
        **{"creep": None, "loop_shift": None, "slow_gain": None, "smoothness": 1e-3},
        **{"input_map": None, "output_map": None, "weights": "free"},
    }
    amplifier = mh.identify(u, y, dt=dt, dead_time=0.0, **settled).stage.amplifier_bandwidth
    assert amplifier is not None
    assert 1.0 / (2.0 * np.pi * amplifier) == pytest.approx(time, rel=0.05)


@pytest.mark.parametrize("lag", [0.0, 0.01])
def test_a_lag_behind_the_hysteresis_or_none_is_not_found_in_front(lag: float) -> None:
    dt = 2e-3
    u = turned([0.0, 50.0, -50.0, 40.0, -30.0, 20.0, -45.0, 35.0, -20.0, 50.0, 0.0], 150)
    x = HEATED.forward().run(u)
    y = lagged(x, dt, lag) if lag else np.r_[[x[0]] * 3, x[:-3]]  # three samples of dead time
    y = y + np.random.default_rng(1).normal(0.0, 5e-4 * np.ptp(y), u.size)
    assert mh.identify(u, y, dt=dt).stage.amplifier_bandwidth is None


def test_a_position_that_leads_its_drive_has_no_lag_in_front() -> None:
    u = turned([0.0, 50.0, -50.0, 40.0, -30.0, 20.0, -45.0, 35.0, -20.0, 50.0, 0.0], 150)
    x = HEATED.forward().run(u) ** 2 / 50.0
    y = np.r_[x[1:], x[-1]] + np.random.default_rng(1).normal(0.0, 0.1, u.size)
    assert mh.identify(u, y, dt=2e-3, dynamics="auto").stage.amplifier_bandwidth is None


def test_a_lag_in_front_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    u = turned([0.0, 50.0, -50.0, 40.0, -30.0, 20.0, -45.0, 0.0], 150)
    rows = np.c_[2e-3 * np.arange(u.size), u, heated(u, 2e-3, 0.01)]
    np.savetxt("loops.csv", rows, delimiter=",", header="time_s,voltage_v,position_um", comments="")
    columns = ["--input", "voltage_v", "--output", "position_um", "--operators", "6"]
    result = run("identify", "loops.csv", *columns, "--dynamics", "none", "--amplifier", "16")
    assert result.exit_code == 0, result.output
    assert "amplifier bandwidth" in result.stdout and "16.00 Hz" in result.stdout
    assert "a dead time fits as well" not in result.stdout


@pytest.mark.parametrize("name", ["input_map", "output_map"])
def test_a_map_that_is_asked_for_is_there(name: str) -> None:
    asked: dict[str, Any] = {name: "smooth"}
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=200)
    y = mh.paper.table_1_recovered().forward().run(u)
    noise = np.random.default_rng(2).normal(0.0, 0.01, u.size)
    found = mh.identify(u, y + noise, dt=5e-3, **SMALL, **asked)
    points = getattr(found, name)
    assert points is not None
    x, mapped = (np.asarray(values) for values in points)
    assert np.all(np.diff(x) > 0.0) and np.all(np.diff(mapped) > 0.0)
    assert found.fit.rmse < 0.02


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"amplifier": -1.0, "dynamics": 2},
            "amplifier: expected a bandwidth in Hz above 0, got -1",
        ),
        (
            {"amplifier": 400.0, "dynamics": 1},
            "amplifier: expected none but beside second-order dynamics",
        ),
        ({"amplifier": "fast"}, 'amplifier: expected None, "auto" or a bandwidth in Hz'),
        ({"input_map": "cubic"}, 'input_map: expected None, "auto" or "smooth"'),
        ({"output_map": 3}, 'output_map: expected None, "auto" or "smooth"'),
    ],
)
def test_what_is_none_is_refused(given: dict[str, Any], said: str) -> None:
    u = np.sin(np.arange(400) / 10.0)
    with pytest.raises((ValueError, TypeError), match=said):
        mh.identify(u, u, dt=1e-3, **given)


def test_the_command_line_has_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    bench = behind_tanh()
    u, skip = bench.drive()
    rows = np.c_[np.arange(u.size) / 1000.0, u, bench.measured(u)]
    np.savetxt("loops.csv", rows, delimiter=",", header="time_s,voltage_v,position_um", comments="")
    columns = ["--input", "voltage_v", "--output", "position_um", "--skip", str(skip)]
    command = ["identify", "loops.csv", *columns, "--operators", "6", "--dynamics", "none"]
    result = run(*command, "--output-map", "smooth", "--input-map", "none", "-o", "stage.json")
    assert result.exit_code == 0, result.output
    assert "output map" in result.stdout and "input map" not in result.stdout
    stage = mh.load(tmp_path / "stage.json")
    assert isinstance(stage, mh.Stage) and stage.output_map is not None
    kept = {"loops.csv", "stage.json"}
    assert_refused(run(*command, "--amplifier", "fast"), tmp_path, kept, "--amplifier", "'fast'")
    first_order = run(*command, "--dynamics", "1", "--amplifier", "300")
    assert_refused(first_order, tmp_path, kept, "--amplifier", "dynamics")
    assert_refused(run(*command, "--input-map", "cubic"), tmp_path, kept, "--input-map", "'cubic'")
