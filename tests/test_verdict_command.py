"""The verdict on the terminal and in the report, and the options about it."""

from __future__ import annotations

import html
import re
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, run, write_csv
from stages import BENCHES, RATE
from support import Array

BENCH = BENCHES[0]
DRIVE, SKIP = BENCH.drive()
POSITION = BENCH.measured(DRIVE)
FIT = ["--operators", "8", "--weights", "free", "--skip", str(SKIP)]


def record(path: Path, position: Array, drive: Array = DRIVE, time: Array | None = None) -> str:
    seconds = np.arange(drive.size) / RATE if time is None else time
    rows = np.stack([seconds, drive, position], axis=1)[:4000]
    return str(write_csv(path, "time_s,drive_v,position_um", rows.tolist()))


def test_strict_tells_amber_and_red_by_the_exit_status(tmp_path: Path) -> None:
    clean = record(tmp_path / "clean.csv", POSITION)
    drifting = record(tmp_path / "drift.csv", POSITION + 0.3 * np.arange(DRIVE.size) / DRIVE.size)
    turned = record(tmp_path / "turned.csv", -POSITION)
    for path, verdict, status in ((clean, "green", 0), (drifting, "amber", 1), (turned, "red", 1)):
        stage = tmp_path / f"{verdict}.json"
        result = run("identify", path, *COLUMNS, *FIT, "-o", str(stage), "--strict")
        assert result.exit_code == status, result.output
        assert result.stdout.splitlines()[0].startswith(f"verdict: {verdict}")
        assert mh.load(str(stage)).identified is not None
        said = "" if status == 0 else f"mpi-hyst: --strict: the verdict is {verdict}\n"
        assert result.stderr.endswith(said) and ("--strict" in result.stderr) == bool(said)
        assert run("identify", path, *COLUMNS, *FIT).exit_code == 0


def test_the_sign_is_turned_by_an_option(tmp_path: Path) -> None:
    path = record(tmp_path / "turned.csv", -POSITION)
    report = tmp_path / "report.html"
    result = run("identify", path, *COLUMNS, *FIT, "--report", str(report))
    first = result.stdout.splitlines()[0]
    assert first == "verdict: red (wrong_sign, poor_fit)"
    assert "  red wrong_sign: the position falls where the drive rises" in result.stdout
    assert "    try: turn the sign of the position: --negate-output" in result.stdout
    top = html.unescape(report.read_text(encoding="utf-8")).partition('<div class="cards">')[0]
    assert '<div class="verdict red" role="status"><b>red</b>' in top
    assert re.search("<li>wrong_sign: .*Try: turn the sign of the position", top)
    result = run("identify", path, *COLUMNS, *FIT, "--negate-output", "--report", str(report))
    assert result.stdout.splitlines()[0] == "verdict: green" and "warnings: none" in result.stdout
    page = report.read_text(encoding="utf-8")
    assert '<div class="verdict green" role="status"><b>green</b>' in page


def test_uneven_times_are_located_and_not_refused(tmp_path: Path) -> None:
    seconds = np.arange(DRIVE.size) / RATE
    late = np.where(np.arange(DRIVE.size) < 2000, seconds, seconds + 0.05)
    path = record(tmp_path / "gap.csv", POSITION, time=late)
    result = run("identify", path, *COLUMNS, *FIT)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[0] == "verdict: amber (time_gap)"
    assert "intervals of 0.001000 s before sample 2000 (2.050000 s)" in result.stdout
    rows = ["--rows", "2000"]
    assert run("identify", path, *COLUMNS, *FIT, *rows).stdout.startswith("verdict: green")


@pytest.mark.parametrize("timed", [True, False])
def test_no_number_without_meaning_is_printed(tmp_path: Path, timed: bool) -> None:
    """A constant slope: no record of it tells thresholds or offset."""
    u = DRIVE[:1200]
    y = 0.01 * u + np.random.default_rng(1).normal(0.0, 0.2, u.size)
    header = "time_s,drive_v,position_um" if timed else "drive_v,position_um"
    columns = [np.arange(u.size) / RATE, u, y] if timed else [u, y]
    path = write_csv(tmp_path / "line.csv", header, np.stack(columns, axis=1).tolist())
    report = tmp_path / "report.html"
    result = run("identify", str(path), *COLUMNS, "--operators", "8", "--report", str(report))
    assert result.exit_code == 0, result.output
    assert "not determined" in result.stdout
    numbers = re.findall(r"± ([0-9.e+-]+)", result.stdout)
    assert all(float(number) < 1e4 for number in numbers)
    assert "nan" not in result.stdout.lower() and "inf" not in result.stdout.replace("info", "")
