"""Times without a unit are seconds as long as nothing speaks against it."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import run

from odd_files.test_instruments import N, T, U, Y, rows

K = np.arange(N)
COLUMNS = ("--input", "drive_v", "--output", "gauge_um", "--operators", "4", "--dynamics", "none")
# The times of a file, and what decides it.
UNLIKELY = {
    "days of a spreadsheet": (46348.5 + T / 86400.0, "d"),
    "days of a spreadsheet, every minute": (46348.5 + K / 1440.0, "d"),
    "days of MATLAB": (739943.25 + T / 86400.0, "d"),
    "days since the start": (T / 86400.0, "d"),
    "hours": (T / 3600.0, "h"),
    "hours, ten a second": (10.0 * T / 3600.0, "h"),
    "hours, one a second": (5.0 + K / 3600.0, "h"),
    "minutes": (T / 60.0, "min"),
    "hours, rounded": (np.round(K / 3600.0, 6), "h"),
    "nanoseconds in seconds": (1e-8 * K, ""),
    "milliseconds": (1e3 * T, "ms"),
}
LIKELY = {
    "100 Hz": T,
    "since 1970": 1.79e9 + T,
    "a camera": K / 25.0,
    "another camera": np.round(K / 60.0, 4),
    "50 kHz": K / 5e4,
    "1024 Hz": K / 1024.0,
    "44.1 kHz": K / 44100.0,
    "a late start": 50000.0 + T,
}


def record(path: Path, times: np.ndarray, name: str = "time") -> Path:
    path.write_text(
        f"{name},drive_v,gauge_um\n" + rows(times, U, Y, form="{:.17g}"), encoding="utf-8"
    )
    return path


def doubts(path: Path) -> list[str]:
    return [one.text for one in mh.io.read(path).assumed if one.level == "doubtful"]


@pytest.mark.parametrize("kind", UNLIKELY)
@pytest.mark.parametrize("name", ["time", "t"])
def test_times_that_are_hardly_seconds_are_doubtful(kind: str, name: str, tmp_path: Path) -> None:
    times, unit = UNLIKELY[kind]
    path = record(tmp_path / "record.csv", times, name)
    (said,) = doubts(path)
    assert "has no unit" in said and f"hardly seconds: --time-unit {unit}".strip() in said
    assert f"doubtful: {said}" in run("look", str(path)).stdout


@pytest.mark.parametrize("kind", LIKELY)
def test_times_that_may_be_seconds_are_assumed_so(kind: str, tmp_path: Path) -> None:
    path = record(tmp_path / "record.csv", LIKELY[kind])
    assert not doubts(path)
    assert "seconds are assumed; --time-unit" in str(mh.io.read(path).assumed)


def test_a_unit_that_is_given_decides(tmp_path: Path) -> None:
    days = record(tmp_path / "days.csv", 46348.5 + T / 86400.0)
    found = run("identify", str(days), *COLUMNS)
    assert found.stdout.startswith("verdict: amber (assumed"), found.output
    given = run("identify", str(days), *COLUMNS, "--time-unit", "d")
    assert given.stdout.startswith("verdict: green"), given.output
    assert not doubts(record(tmp_path / "told.csv", T / 3600.0, "time_h"))
    # A reference that is shifted by a factor of 86400 is no reference.
    mh.paper.plant("A1").stage.save(tmp_path / "stage.json")
    words = ("precompensate", str(tmp_path / "stage.json"), str(days), "--column", "gauge_um")
    refused = run(*words, "-o", str(tmp_path / "out.csv"))
    assert refused.exit_code == 2 and "hardly seconds: --time-unit d" in refused.output
