"""Several modes in parallel, fitted behind the hysteresis."""

from __future__ import annotations

import copy
import pickle
import re
import warnings
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, run
from mpi_hyst import signals
from support import Array
from test_report import parsed, words

RATE = 1000.0
FIT: dict[str, Any] = {"operators": 6, "input_offset": 0.0, "creep": None, "loop_shift": None}
COLUMNS = ["--input", "voltage_v", "--output", "position_um"]
COMMAND = ["identify", "record.csv", *COLUMNS, "--operators", "6", "--input-offset", "0"]

Mode = tuple[float, float, float]


def hysteresis(reach: float, operators: int) -> mh.ModifiedPrandtlIshlinskii:
    """100 um over 0 to `reach` and back."""
    r = reach * np.arange(operators) / operators
    w = np.concatenate([[1.0], 0.3 / operators * np.exp(-2.0 * r[1:] / reach)])
    stroke = np.ptp(
        mh.ModifiedPrandtlIshlinskii.from_ratios(w, r, ra=0.9, rb=0.5, rc=0.6)
        .forward()
        .run([reach, 0.0])
    )
    scaled = w * 100.0 / stroke
    return mh.ModifiedPrandtlIshlinskii.from_ratios(scaled, r, ra=0.9, rb=0.5, rc=0.6)


def stage(modes: list[Mode], operators: int = 6, **parts: Any) -> mh.Stage:
    parallel = mh.plant.Modes(
        [gain for _, _, gain in modes], [mh.plant.SecondOrder(f, zeta) for f, zeta, _ in modes]
    )
    model = hysteresis(150.0, operators)
    return mh.Stage(model, limits=(-150.0, 150.0), dynamics=parallel, noise=0.02, **parts)


TWO: list[Mode] = [(60.0, 0.02, 0.8), (140.0, 0.01, 0.2)]
ONE: list[Mode] = [(60.0, 0.02, 1.0)]


def record(modes: list[Mode], seed: int = 1) -> tuple[Array, Array]:
    """Loops, then steps that make the modes ring: 1 kHz, 20 nm of noise."""
    swings = signals.decaying_triangle(75.0, 1.0, cycles=4, rate=RATE)
    levels = np.repeat([30.0, -20.0, 50.0, 0.0], 400)
    drive = np.concatenate([swings, levels])
    return drive, stage(modes).plant(1.0 / RATE, seed=seed).run(drive)[0]


def check(found: mh.results.Identification, truth: list[Mode]) -> None:
    assert len(found.modes) == len(found.modes_std) == len(truth)
    for (frequency, damping, gain), std, (f, zeta, g) in zip(
        found.modes, found.modes_std, truth, strict=True
    ):
        assert frequency == pytest.approx(f, rel=3e-3) and std[0] < 3e-3 * f
        assert damping == pytest.approx(zeta, rel=0.1) and std[1] < 0.1 * zeta
        assert gain == pytest.approx(g, rel=0.05) and std[2] < 0.05 * abs(g)


def test_two_modes_are_found_and_their_stage_has_them() -> None:
    found = mh.identify(*record(TWO), dt=1.0 / RATE, **FIT)
    check(found, TWO)
    assert isinstance(found.dynamics, mh.plant.Modes)
    assert found.stage.dynamics == found.dynamics
    assert "modes at 60.0, 140.0 Hz" in repr(found)
    assert (found.frequency_std, found.damping_std) == found.modes_std[0][:2]
    names = {f"{name}[{k}]" for name in ("frequency", "damping", "gain") for k in range(2)}
    assert names <= set(found.parameters) and "frequency" not in found.parameters
    for same in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert same.modes == found.modes and same.modes_std == found.modes_std
        drive = record(TWO)[0]
        assert np.array_equal(same.predict(drive), found.predict(drive))


def test_a_result_from_before_there_were_modes_is_restored() -> None:
    found = mh.identify(*record(ONE), dt=1.0 / RATE, **FIT)
    reduced: Any = found.__reduce__()
    restore, (values,) = reduced[:2]
    saved = values["found"]
    for part, name in (
        (saved, "modes"),
        (saved["options"], "modes"),
        (saved["standard_errors"], "modes"),
        (saved["chain"]["linear"], "further"),
        (saved["spread"]["tangent"]["linear"], "further"),
    ):
        del part[name]
    restored = restore(values)
    drive = record(ONE)[0]
    assert np.array_equal(restored.predict(drive), found.predict(drive))
    assert restored.modes == found.modes


def test_one_mode_stays_one() -> None:
    found = mh.identify(*record(ONE), dt=1.0 / RATE, **FIT)
    assert isinstance(found.dynamics, mh.plant.SecondOrder)
    assert found.modes == [(found.dynamics.frequency, found.dynamics.damping, 1.0)]
    assert found.modes_std == [(found.frequency_std, found.damping_std, 0.0)]
    assert "modes at" not in repr(found)
    none = mh.identify(*record(ONE), dt=1.0 / RATE, dynamics=None, **FIT)
    assert none.modes == none.modes_std == []


def test_what_was_asked_for_and_is_not_there_is_said() -> None:
    found = mh.identify(*record(ONE), dt=1.0 / RATE, modes=2, **FIT)
    assert "mode_not_told" in [warning.code for warning in found.warnings]
    assert len(found.modes) == 1
    found = mh.identify(*record(TWO), dt=1.0 / RATE, modes=2, **FIT)
    assert "mode_not_told" not in [warning.code for warning in found.warnings]
    check(found, TWO)
    assert len(mh.identify(*record(TWO), dt=1.0 / RATE, modes=1, **FIT).modes) == 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"modes": 0}, "modes: expected 1, 2 or 3, got 0"),
        ({"modes": 4}, "modes: expected 1, 2 or 3, got 4"),
        ({"modes": -1}, 'modes: expected "auto", 1, 2 or 3, got -1'),
        ({"modes": "many"}, 'modes: expected "auto", 1, 2 or 3, got'),
        ({"modes": 1.5}, 'modes: expected "auto", 1, 2 or 3, got'),
        ({"modes": 2, "dynamics": 1}, "modes: expected 1 without second-order dynamics"),
        ({"modes": 3, "dynamics": None}, "modes: expected 1 without second-order dynamics"),
        ({"modes": 2, "dt": None}, "dt: expected the sampling interval"),
    ],
)
def test_what_is_no_number_of_modes_is_refused(given: dict[str, Any], said: str) -> None:
    u = np.sin(np.arange(400) / 10.0)
    for fit in (mh.identify, mh.compare):
        with pytest.raises((ValueError, TypeError), match=said):
            fit(u, u, **{"dt": 1e-3, **given})


@pytest.mark.slow
def test_an_experiment_tells_the_modes_of_a_creeping_stage() -> None:
    truth = stage(
        [(800.0, 0.02, 0.8), (1900.0, 0.01, 0.2)],
        operators=30,
        dead_time=1e-4,
        creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8),
    )
    parts = signals.experiment(0.0, 150.0, slew=2e3, rate=1e3, fast_rate=1e4)[::-1]
    records = [
        (part.drive, truth.plant(1.0 / part.rate, seed=seed).run(part.drive)[0])
        for seed, part in enumerate(parts)
    ]
    found = mh.identify(records, dt=[1.0 / part.rate for part in parts])
    check(found, [(800.0, 0.02, 0.8), (1900.0, 0.01, 0.2)])
    assert found.dead_time == pytest.approx(1e-4, abs=5e-6)
    # A record has its own sampling interval, not that of the first one.
    for place, part in enumerate(parts):
        left = found.residuals(*records[place], record=place)
        assert np.array_equal(
            left, found.residuals(*records[place], record=place, dt=1.0 / part.rate)
        )
    # 10 Hz and 70 um, corners rounded: the drive that this stage asks for moves the true one along.
    t = 1e-4 * np.arange(5000)
    rounded = np.arcsin(0.98 * np.sin(2 * np.pi * 10.0 * t)) / np.arcsin(0.98)
    reference = 15.0 + 35.0 * (1.0 + rounded)
    drive = found.stage.precompensate(reference, dt=1e-4, lead_in=0.1)
    error = truth.forward(1e-4).run(drive)[-reference.size :] - reference
    assert np.sqrt(np.mean(error**2)) < 0.1
    controller = found.stage.replace(limits=(-150.0, 150.0)).controller(1e-4)
    assert np.isfinite(controller.step(10.0, 0.0))


def test_the_command_line_has_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    drive, position = record(TWO)
    rows = np.c_[np.arange(drive.size) / RATE, drive, position]
    header = "time_s,voltage_v,position_um"
    np.savetxt("record.csv", rows, delimiter=",", header=header, comments="")
    result = run(*COMMAND, "--modes", "2", "-o", "stage.json", "--report", "report.html")
    assert result.exit_code == 0, result.output
    page = words(parsed(tmp_path / "report.html"))
    for pattern in (
        r"natural frequency, mode 1 +60\.\d+ ± \S+ Hz",
        r"damping ratio, mode 2 +0\.01\d* ±",
        r"static gain, mode 1 +0\.(8|79)\d* ±",
    ):
        assert re.search(pattern, result.stdout), result.stdout
        assert re.search(pattern, page), pattern
    saved = mh.load(tmp_path / "stage.json")
    assert isinstance(saved, mh.Stage) and isinstance(saved.dynamics, mh.plant.Modes)
    one = run(*COMMAND, "--modes", "1", "-o", "stage.json")
    assert "natural frequency  " in one.stdout and "mode 2" not in one.stdout
    kept = {"record.csv", "stage.json", "report.html"}
    assert_refused(run(*COMMAND, "--modes", "4"), tmp_path, kept, "--modes", "'4'")
    assert_refused(
        run(*COMMAND, "--modes", "2", "--dynamics", "1"), tmp_path, kept, "--modes", "dynamics"
    )


def test_ringing_is_not_within_reach() -> None:
    """Steps over the whole range ring by half of it: a reference is planned by what stays."""
    swings = signals.decaying_triangle(150.0, 1.0, cycles=4, rate=RATE)
    drive = np.concatenate([swings, np.repeat([150.0, -150.0, 40.0, 150.0, 0.0], 600)])
    made = stage(ONE)
    position = made.plant(1.0 / RATE, seed=1).run(drive)[0]
    found = mh.identify(drive, position, dt=1.0 / RATE, **FIT)
    assert made.position_range is not None and found.stage.position_range is not None
    low, high = found.stage.position_range
    stroke = high - low
    assert np.abs(np.subtract((low, high), made.position_range)).max() < 0.005 * stroke
    assert found.position_range == (position.min(), position.max())
    assert position.max() > high + 0.3 * stroke and position.min() < low - 0.3 * stroke
    slow = 0.5 * (low + high) + 0.4999 * stroke * np.sin(2.0 * np.pi * np.arange(8000) / 4000.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of drives that are held back
        planned = found.stage.precompensate(slow, 1.0 / RATE, lead_in=0.5)
    assert np.abs(made.forward(1.0 / RATE).run(planned)[500:] - slow).max() < 0.01 * stroke
