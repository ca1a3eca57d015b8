"""The example of a load cell: hysteresis, creep and a temperature, simulated by other code."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import load_cell
import mpi_hyst as mh
import numpy as np
import pytest
from commands import run, write_csv
from support import Array

Cell = Callable[[Array, Array, int], Array]
DT = 1.0
HOLD = 60
"""Samples at each load."""


def cell(loads: Array, temperature: Array, seed: int) -> Array:
    """Bouc-Wen elements of 0.3 % of hysteresis, two Kelvin elements of creep, heat that comes late.

    None of it is an operator of the package.
    """
    slips, shares = (12.0, 40.0), (0.0055, 0.0030)
    slow, taus = (0.0010, 0.0012), (25.0, 240.0)
    within, crept = [0.0, 0.0], [0.0, 0.0]
    theta, last = temperature[0], 0.0
    reading = []
    for load, degrees in zip(loads, temperature, strict=True):
        # Small steps, as a load is put on within a moment.
        for _ in range(50):
            step = (load - last) / 50
            for i, slip in enumerate(slips):
                bend = 0.5 + 0.5 * np.sign(within[i] * step)
                within[i] += step * (1.0 - bend * min(1.0, abs(within[i]) / slip))
        last = load
        hysteresis = sum(share * z for share, z in zip(shares, within, strict=True))
        crept = [q + (load - q) * DT / tau for q, tau in zip(crept, taus, strict=True)]
        creep = sum(c * q for c, q in zip(slow, crept, strict=True))
        theta += (degrees - theta) * DT / 300.0
        reading.append(1.98 * (load - hysteresis + creep) + 0.05 * (theta - 23.0))
    return np.array(reading) + np.random.default_rng(seed).normal(0.0, 0.003, len(reading))


def heat(samples: int, seed: int) -> Array:
    """10 K of drift, up and down within the hour, and a window that is opened."""
    time = np.arange(samples) / samples
    phase = np.random.default_rng(seed).uniform(0.0, 2 * np.pi)
    waves = np.sin(2 * np.pi * 1.7 * time + phase) + 0.4 * np.sin(2 * np.pi * 5.3 * time)
    waves[time > 0.6] -= 0.8
    return np.asarray(18.0 + 10.0 * (waves - waves.min()) / np.ptp(waves))


@dataclass
class Calibrated:
    """What was found, with the reading without a load and a straight line for comparison."""

    found: mh.results.PlacesIdentification
    zero: float
    line: Array


CALIBRATION = np.r_[0:101:10, 90:-1:-10, 0:61:20, 40:-1:-20, 0, 0, 80, 30, 100, 50, 0, 0].astype(
    float
)


@pytest.fixture(scope="module")
def calibrated() -> Calibrated:
    return fresh(1)


def fresh(seed: int) -> Calibrated:
    """A calibration of a cell on which nothing had lain."""
    loads = np.repeat(CALIBRATION, HOLD)
    temperature = heat(loads.size, seed)
    reading = cell(loads, temperature, seed + 1)
    found = load_cell.calibrate(loads, HOLD, temperature, reading, rested=True)
    late = np.arange(HOLD - 1, loads.size, HOLD)
    return Calibrated(found, float(reading[0]), np.polyfit(reading[late], loads[late], 1))


def other(seed: int) -> tuple[Array, Array, Array]:
    """Loads that were not calibrated, their temperatures and readings."""
    rng = np.random.default_rng(seed)
    loads = np.repeat(np.concatenate([[0.0], rng.uniform(0.0, 100.0, 24), [0.0] * 4]), HOLD)
    temperature = heat(loads.size, seed + 10)
    return loads, temperature, cell(loads, temperature, seed + 20)


@pytest.mark.parametrize("seed", range(1, 9))
def test_loads_that_were_not_calibrated(seed: int) -> None:
    calibrated = fresh(seed)
    loads, temperature, reading = other(seed + 2)
    plain = np.polyval(calibrated.line, reading) - loads
    stage = calibrated.found.stage
    assert stage.temperature is not None
    added = stage.temperature.response(temperature, DT)
    with pytest.warns(UserWarning, match="extrapolates"):
        inverse = stage.inverse(DT, (-10.0, 110.0))  # no error is cut off at an end
    error = inverse.run(reading - calibrated.zero - added) - loads
    # A load is read some seconds after it was put on.
    read = np.arange(loads.size) % HOLD >= 4
    assert np.sqrt(np.mean(error[read] ** 2)) < 0.2 * np.sqrt(np.mean(plain[read] ** 2))
    assert np.abs(error[read]).max() < 0.2 * np.abs(plain[read]).max()


def test_the_command_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Path(__file__).parents[1] / "docs" / "how-to" / "load_cell.md"
    (command,) = re.findall(r"^mpi-hyst (places .*\\\n.*)$", page.read_text("utf-8"), re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    loads = np.repeat(CALIBRATION, HOLD)
    warmth = heat(loads.size, 1)
    reading = cell(loads, warmth, 2)
    at = np.arange(loads.size).reshape(-1, HOLD)[:, [4, -1]].ravel()
    write_csv(
        tmp_path / "loads.csv",
        "time_s,load",
        list(zip(DT * np.arange(loads.size), loads, strict=True)),
    )
    np.savetxt("lengths.txt", [(0.0, 0.0, float(k), float(reading[k] - reading[0])) for k in at])
    np.savetxt("temperature.txt", warmth)
    result = run(*command.replace("\\\n", "").split())
    assert result.exit_code == 0, result.output
    assert "verdict: green" in result.stdout and "of a length, rms" in result.stdout
    stage = mh.load(tmp_path / "cell.json")
    assert isinstance(stage, mh.Stage) and stage.temperature is not None
    assert stage.units == ("kg", "mV")
    others, warmth, weighed = other(3)
    corrected = weighed - reading[0] - stage.temperature.response(warmth, DT)
    error = stage.inverse(DT).run(corrected) - others
    late = np.arange(HOLD - 1, loads.size, HOLD)
    plain = np.polyval(np.polyfit(reading[late], loads[late], 1), weighed) - others
    read = np.arange(others.size) % HOLD >= 4
    # What lay on it before is searched, and so is the law of creep.
    assert np.sqrt(np.mean(error[read] ** 2)) < 0.25 * np.sqrt(np.mean(plain[read] ** 2))


def slipping(loads: Array, temperature: Array, seed: int) -> Array:
    """Elements that stick and slip, three Kelvin elements of creep, heat that comes late."""
    slips, shares = np.array([3.0, 8.0, 20.0, 45.0]), 0.002
    taus = np.array([8.0, 40.0, 200.0])
    stretched, crept = np.zeros(4), np.zeros(3)
    theta, last = temperature[0], 0.0
    reading = []
    for load, degrees in zip(loads, temperature, strict=True):
        stretched = np.clip(stretched + (load - last), -slips, slips)
        last = load
        crept += (load - crept) * DT / taus
        theta += (degrees - theta) * DT / 200.0
        strain = load - shares * stretched.sum() + 0.0007 * crept.sum()
        reading.append(1.5 * strain - 0.04 * (theta - 23.0))
    return np.array(reading) + np.random.default_rng(seed).normal(0.0, 0.003, len(reading))


@pytest.mark.parametrize("before", [[100.0], [60.0], [100.0, 0.0, 100.0], [80.0, 20.0, 50.0]])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.parametrize("made", [cell, slipping])
def test_a_cell_that_was_loaded_before(made: Cell, before: list[float], seed: int) -> None:
    """Nothing is known of what lay on it before the calibration, nor of its warmth then."""
    history = np.repeat([0.0, *before, 0.0], HOLD)
    whole = np.concatenate([history, np.repeat(CALIBRATION, HOLD)])
    warmth = heat(whole.size, seed)
    part = slice(history.size, None)
    loads, temperature = whole[part], warmth[part]
    reading = made(whole, warmth, seed)[part]
    found = load_cell.calibrate(loads, HOLD, temperature, reading)
    zero = reading[0] - found.drift(0)[0]
    late = np.arange(HOLD - 1, loads.size, HOLD)
    line = np.polyfit(reading[late], loads[late], 1)

    drawn = np.random.default_rng(seed + 10).uniform(0.0, 100.0, 24)
    others = np.repeat(np.concatenate([[0.0, *before], drawn, [0.0] * 4]), HOLD)
    warmth = heat(others.size, seed + 10)
    weighed = made(others, warmth, seed + 20)
    stage = found.stage
    assert stage.temperature is not None
    error = stage.inverse(DT).run(weighed - zero - stage.temperature.response(warmth, DT)) - others
    read = (np.arange(others.size) % HOLD >= 4) & (np.arange(others.size) >= history.size)
    plain = np.polyval(line, weighed) - others
    assert np.sqrt(np.mean(error[read] ** 2)) < 0.2 * np.sqrt(np.mean(plain[read] ** 2))


def bent(loads: Array, temperature: Array, seed: int) -> Array:
    """Relays that are densest at half the load, so the middle line bends; creep, heat."""
    middles = 100.0 * (0.5 + np.arcsin(np.linspace(-1.0, 1.0, 400)) / np.pi)
    half = np.random.default_rng(0).exponential(12.0, middles.size)
    up, crept, theta, reading = np.zeros(middles.size, dtype=bool), np.zeros(2), temperature[0], []
    for load, degrees in zip(loads, temperature, strict=True):
        up = np.where(load >= middles + half, True, np.where(load <= middles - half, False, up))
        crept += (load - crept) * DT / np.array([15.0, 120.0])
        theta += (degrees - theta) * DT / 250.0
        strain = load + 1.2 * up.mean() + np.dot([0.0015, 0.0008], crept)
        reading.append(2.0 * strain + 0.05 * (theta - 23.0))
    return np.array(reading) + np.random.default_rng(seed).normal(0.0, 0.003, len(reading))


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_a_middle_line_that_bends_is_found(seed: int) -> None:
    loads = np.repeat(CALIBRATION, HOLD)
    temperature = heat(loads.size, seed)
    reading = bent(loads, temperature, seed)
    at = np.arange(loads.size).reshape(-1, HOLD)[:, [4, -1]].ravel()
    lengths = [(0.0, 0.0, float(k), float(reading[k] - reading[0])) for k in at]
    cut, found = (
        mh.identify_places(
            *(loads, [], lengths),
            dt=DT,
            model="conventional",
            dead_time=0.0,
            creep=[30.0, 300.0],
            temperature=temperature,
            input_map=input_map,
        )
        for input_map in (None, "auto")
    )
    assert cut.input_map is None and found.input_map is not None
    assert any(", input map" in name for name, *_ in found.candidates)
    others, warmth, _ = other(seed)
    true = bent(others, warmth, seed + 20)
    off, cut_off = (np.std(one.predict(others, temperature=warmth) - true) for one in (found, cut))
    assert off < 0.6 * cut_off
    stage = found.stage
    assert stage.input_map is not None
    assert found.predict(others) == pytest.approx(stage.forward(DT).run(others), abs=1e-9)


@pytest.mark.parametrize("error", [0.3, 5.0])
def test_a_reading_that_is_wrong_does_no_harm(error: float) -> None:
    loads = np.repeat(CALIBRATION, HOLD)
    temperature = heat(loads.size, 1)
    reading = cell(loads, temperature, 2)
    right = load_cell.calibrate(loads, HOLD, temperature, reading, rested=True)
    reading[20 * HOLD + HOLD - 1] += error  # the 42nd of the lengths
    found = load_cell.calibrate(loads, HOLD, temperature, reading, rested=True)
    assert found.wrong_lengths == [41]
    (told,) = (one for one in found.warnings if one.code == "wrong_lengths")
    assert told.message == "1 of 72 lengths contradicts the others and was left out: 41"
    off = found.predict(loads) - right.predict(loads)
    assert np.sqrt(np.mean(off**2)) < 0.02


def test_the_temperature_is_found(calibrated: Calibrated) -> None:
    term = calibrated.found.temperature
    assert term is not None and term == calibrated.found.stage.temperature
    of_sensitivity, of_lag = calibrated.found.temperature_std
    assert abs(term.sensitivity - 0.05) < 0.005 and 0 < of_sensitivity < 0.005
    assert abs(term.time_constant - 300.0) < 90.0 and 0 < of_lag < 90.0
    assert "temperature_not_told" not in [one.code for one in calibrated.found.warnings]


def test_predict_with_and_without_the_temperature(calibrated: Calibrated) -> None:
    found = calibrated.found
    loads, temperature, reading = other(6)
    warm = found.predict(loads, temperature=temperature)
    assert found.temperature is not None
    added = found.temperature.response(temperature, DT)
    assert warm - found.predict(loads) == pytest.approx(added)
    error = warm - (reading - calibrated.zero)
    assert np.sqrt(np.mean(error**2)) < 0.1
    with pytest.raises(ValueError, match=rf"temperature: expected {loads.size} samples, got 3"):
        found.predict(loads, temperature=[20.0, 21.0, 22.0])


def test_sample_by_sample_and_saved(calibrated: Calibrated, tmp_path: Path) -> None:
    calibrated.found.stage.save(tmp_path / "cell.json")
    stage = mh.load(tmp_path / "cell.json")
    assert stage == calibrated.found.stage
    assert isinstance(stage, mh.Stage) and stage.temperature is not None
    _, temperature, reading = other(7)
    whole = stage.inverse(DT).run(
        reading - calibrated.zero - stage.temperature.response(temperature, DT)
    )
    cell = load_cell.Linearizer(stage, calibrated.zero, temperature[0])
    stepped = [cell.step(*sample) for sample in zip(reading, temperature, strict=True)]
    assert stepped == pytest.approx(whole, abs=1e-9)


def test_a_load_beyond_those_of_the_calibration_is_held(calibrated: Calibrated) -> None:
    _, temperature, reading = other(7)
    stage, zero = calibrated.found.stage, calibrated.zero
    held = load_cell.Linearizer(stage, zero, temperature[0])
    assert held.step(1.5 * reading.max(), temperature[0]) == 100.0 and held.inverse.saturated
    with pytest.warns(UserWarning, match="extrapolates"):
        free = load_cell.Linearizer(stage, zero, temperature[0], (-10.0, 110.0))
    assert -10.0 < free.step(zero - 2.0, temperature[0]) < 0.0 and not free.inverse.saturated


def test_a_temperature_that_tells_nothing_is_told() -> None:
    loads = np.repeat(CALIBRATION, HOLD)
    reading = cell(loads, np.full(loads.size, 23.0), 2)
    told = 0
    for seed in range(1, 11):
        temperature = 23.0 + np.random.default_rng(seed).normal(0.0, 1e-3, loads.size)
        found = load_cell.calibrate(loads, HOLD, temperature, reading)
        told += "temperature_not_told" in [one.code for one in found.warnings]
    assert told >= 9  # one noise may look like what is left


def test_a_lag_too_short_to_be_told_does_no_harm() -> None:
    loads = np.repeat(CALIBRATION, HOLD)
    temperature = heat(loads.size, 4)
    steady = slipping(loads, np.full(loads.size, 23.0), 4)
    found = load_cell.calibrate(
        loads, HOLD, temperature, steady - 0.04 * (temperature - 23.0), rested=True
    )
    term, (_, of_lag) = found.temperature, found.temperature_std
    assert term is not None and 0.0 < term.time_constant < 2.0 * of_lag
    off = term.response(temperature, DT) + 0.04 * (temperature - temperature[0])
    assert np.std(off) < 0.05 * np.std(0.04 * temperature)
    assert "temperature_not_told" not in [one.code for one in found.warnings]


@pytest.mark.parametrize(
    ("temperature", "message"),
    [
        ([1.0, 2.0], "temperature: expected as many samples as the drive has, got 2"),
        ([[1.0, 2.0], [1.0, 2.0]], "temperature: expected one for each drive, got 2"),
        (np.full(40, 20.0), "temperature"),
        (np.full(40, np.nan), "temperature"),
    ],
)
def test_wrong_temperatures_are_named(temperature: Any, message: str) -> None:
    loads = np.repeat([0.0, 5.0, 10.0, 5.0], 10)
    lengths = [(0, 0, k, loads[k]) for k in (15, 25, 35)]
    with pytest.raises(ValueError, match=message):
        mh.identify_places(loads, [], lengths, dt=DT, temperature=temperature)


def test_precompensate_takes_the_temperature_from_the_target() -> None:
    term = mh.plant.TemperatureTerm(0.2, 5.0, 20.0)
    stage = mh.Stage(mh.PrandtlIshlinskii([1.0, 0.1], [0.0, 2.0]), temperature=term)
    reference = 5.0 + 3.0 * np.sin(np.arange(200) / 20.0)
    temperature = 20.0 + 4.0 * np.sin(np.arange(200) / 50.0)
    drive = stage.precompensate(reference, 1.0, lead_in=20.0, temperature=temperature)
    reached = stage.forward(1.0).run(drive)[-200:] + term.response(temperature, 1.0)
    assert reached == pytest.approx(reference, abs=1e-6)
    with pytest.warns(UserWarning, match=r"temperature: none was given .* stay at 20$"):
        steady = stage.precompensate(reference, 1.0, lead_in=20.0)
    assert stage.forward(1.0).run(steady)[-200:] == pytest.approx(reference, abs=1e-6)
    plain = stage.replace(temperature=None)
    with pytest.raises(ValueError, match="temperature: expected None"):
        plain.precompensate(reference, 1.0, lead_in=20.0, temperature=temperature)


def test_the_header_has_the_temperature(calibrated: Calibrated, tmp_path: Path) -> None:
    path = tmp_path / "cell.h"
    mh.export.c_header(calibrated.found.stage, path)
    text = path.read_text("utf-8")
    assert "cell_temperature" in text
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    source = tmp_path / "main.c"
    source.write_text(
        '#include <stdio.h>\n#include "cell.h"\n'
        "int main(void) {\n"
        "    const double *t = cell_temperature;\n"
        '    printf("%d %d ", CELL_HAS_TEMPERATURE, CELL_CREEP_TERMS);\n'
        '    printf("%.17g %.17g %.17g", t[0], t[1], t[2]);\n'
        "}\n"
    )
    subprocess.run([compiler, "-o", tmp_path / "main", source], check=True)
    said = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    term = calibrated.found.temperature
    assert term is not None
    told = [1, 2, term.sensitivity, term.time_constant, term.reference]
    assert [float(one) for one in said.split()] == told


def test_the_lines_of_the_page_for_a_microcontroller(
    calibrated: Calibrated, tmp_path: Path
) -> None:
    """They compile beside the header, and do what the lines in Python do: here around a gain."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    page = Path(__file__).parents[1] / "docs" / "how-to" / "load_cell.md"
    (lines,) = re.findall(r"```c\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
    stage = calibrated.found.stage
    mh.export.c_header(stage, tmp_path / "cell.h")
    term, creep = stage.temperature, stage.creep
    assert term is not None and creep is not None
    lag = -np.expm1(-DT / term.time_constant)
    shares = -np.expm1(-DT / np.asarray(creep.time_constants))
    _, temperature, reading = other(7)
    temperature[5] = np.nan
    source = tmp_path / "main.c"
    source.write_text(
        '#include <math.h>\n#include <stdio.h>\n#include "cell.h"\n'
        f"#define ZERO {calibrated.zero!r}\n#define A {float(lag)!r}\n"
        f"static const double A_CREEP[] = {{{', '.join(map(repr, shares.tolist()))}}};\n"
        "static double inverse(double h) { return h / 2.0; }\n"
        "int main(void) {\n"
        f"    double reading, temperature, load, theta = {float(temperature[0])!r};\n"
        "    double q[CELL_CREEP_TERMS] = {0};\n"
        '    while (scanf("%lf %lf", &reading, &temperature) == 2) {\n'
        f'{lines}        printf("%.17g\\n", load);\n    }}\n}}\n'
    )
    subprocess.run(
        [compiler, "-Wall", "-Werror", "-o", tmp_path / "main", source, "-lm"], check=True
    )
    given = "".join(
        f"{y!r} {t!r}\n" for y, t in zip(reading.tolist(), temperature.tolist(), strict=True)
    )
    said = subprocess.run(
        [tmp_path / "main"], check=True, capture_output=True, text=True, input=given
    ).stdout
    theta, q, expected = temperature[0], np.zeros(shares.size), []
    for y, t in zip(reading, temperature, strict=True):
        theta += lag * (t - theta) if np.isfinite(t) else 0.0
        h = y - calibrated.zero - term.sensitivity * (theta - term.reference)
        h -= float(np.dot(creep.amplitudes, q))
        expected.append(h / 2.0)
        q += shares * (h - q)
    assert np.array(said.split(), dtype=float) == pytest.approx(expected, abs=1e-9)
