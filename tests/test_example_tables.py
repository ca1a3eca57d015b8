"""Examples that need no device: python-control, scipy, pandas, polars, xarray, HCIPy."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pandas as pd
import polars as pl
import pytest
import with_control
import with_tables
import xarray as xr
from support_stage import DT, stage

LIGHT = stage().replace(dynamics=mh.plant.SecondOrder(150.0, 0.05), dead_time=1e-4)


def test_margins_are_those_of_the_loop() -> None:
    integral = 1.0
    gain, phase = with_control.margins(LIGHT, integral)
    # Behind a light mode |L| = slope ki / (2 zeta w) at its frequency w, where L is negative.
    slope, w = LIGHT.slope_range[1], 2.0 * np.pi * 150.0
    assert gain == pytest.approx(
        2.0 * 0.05 * w / (slope * integral), rel=0.1
    )  # the dead time is small
    assert 85.0 < phase < 90.0
    louder, _ = with_control.margins(LIGHT, 2.0 * integral)
    assert louder == pytest.approx(gain / 2.0)
    without_delay = with_control.margins(LIGHT.replace(dead_time=0.0), integral)[0]
    assert without_delay == pytest.approx(2.0 * 0.05 * w / (slope * integral), rel=1e-9)


def test_scipy_finds_the_mode() -> None:
    frequency, damping = with_control.resonance(LIGHT)
    assert frequency == pytest.approx(150.0, rel=1e-9)
    assert damping == pytest.approx(0.05, rel=1e-9)


RECORD = with_tables.record()
TABLES = {
    "pandas": pd.DataFrame(RECORD),
    "polars": pl.DataFrame(RECORD),
    "xarray": xr.Dataset({name: ("sample", values) for name, values in RECORD.items()}),
}


@pytest.mark.parametrize("library", TABLES)
def test_tables_give_what_arrays_give(library: str) -> None:
    table: Any = TABLES[library]
    found = with_tables.identify(table, "drive_v", "position_um")
    assert found.fit.rmse < 1e-3 * found.fit.range
    limited = found.stage.replace(limits=(-500.0, 500.0))
    target = 0.5 * RECORD["position_um"]
    column = ("sample", target) if library == "xarray" else target
    if library == "polars":
        table = table.with_columns(pl.Series("target_um", target))
    else:
        table = table.assign(target_um=column)
    driven = with_tables.with_drives(table, "target_um", limited)
    assert type(driven) is type(table)
    expected = limited.precompensate(target, 0.01)
    np.testing.assert_array_equal(np.asarray(driven["drive_v"]), expected)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
def test_a_mirror_of_hcipy_takes_the_strokes_that_are_asked_for() -> None:
    pytest.importorskip("hcipy", reason="LEFT OUT: HCIPy is not installed")
    import with_hcipy

    device = with_hcipy.mirror(across=4)
    random = np.random.default_rng(1)
    for _ in range(20):
        strokes = random.uniform(-2e-6, 2e-6, 16)  # m
        device.command(strokes)
    np.testing.assert_allclose(device.mirror.actuators, strokes, rtol=0.0, atol=1e-18)
    expected = device.mirror.influence_functions.linear_combination(strokes)
    np.testing.assert_allclose(device.mirror.surface, expected, rtol=0.0, atol=1e-16)
    # The same volts after another history: the hysteresis that a command takes away.
    volts = device.command(strokes)
    for far in (500.0, -500.0):
        device.drive(np.full(16, far))
    device.drive(volts)
    assert np.median(np.abs(device.mirror.actuators - strokes)) > 1e-8


def test_the_shared_stage_is_followed() -> None:
    # Not back to zero: hysteresis would need a drive below the limit there.
    target = 30.0 * np.sin(np.linspace(0.0, 0.8 * np.pi, 400)) ** 2
    drive = stage().precompensate(target, DT)
    assert np.abs(stage().forward(DT).run(drive) - target).max() < 0.02  # um
