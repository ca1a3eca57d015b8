"""The verdict on the terminal and in the report, and the options about it."""

from __future__ import annotations

import html
import re
from pathlib import Path

import mpi_hyst as mh
import numpy as np
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
    strokes = BENCH.cycles(6)
    plain = record(tmp_path / "strokes.csv", BENCH.measured(strokes), strokes)
    turned = record(tmp_path / "turned.csv", -POSITION)
    for path, verdict, status in ((clean, "green", 0), (plain, "amber", 1), (turned, "red", 1)):
        stage = tmp_path / f"{verdict}.json"
        result = run("identify", path, *COLUMNS, *FIT, "-o", str(stage), "--strict")
        assert result.exit_code == status, result.output
        assert result.stdout.splitlines()[0].startswith(f"verdict: {verdict}")
        loaded = mh.load(str(stage))
        assert isinstance(loaded, mh.Stage) and loaded.identified is not None
        said = "" if status == 0 else f"mpi-hyst: --strict: the verdict is {verdict}\n"
        assert result.stderr.endswith(said) and ("--strict" in result.stderr) == bool(said)


def test_the_sign_is_turned_by_an_option(tmp_path: Path) -> None:
    path = record(tmp_path / "turned.csv", -POSITION)
    report = tmp_path / "report.html"
    result = run("identify", path, *COLUMNS, *FIT, "--report", str(report))
    assert result.exit_code == 0
    first = result.stdout.splitlines()[0]
    assert first == "verdict: red (wrong_sign, poor_fit)"
    assert "  red wrong_sign: the position falls where the drive rises" in result.stdout
    assert "    try: turn the sign of the position: --negate-output" in result.stdout
    top = html.unescape(report.read_text(encoding="utf-8")).partition('<div class="cards">')[0]
    assert '<div class="verdict red" role="status"><b>red</b>' in top
    assert re.search("<li>wrong_sign: .*Try: turn the sign of the position", top)
    result = run("identify", path, *COLUMNS, *FIT, "--negate-output")
    assert result.stdout.splitlines()[0] == "verdict: green" and "warnings: none" in result.stdout


def test_uneven_times_are_located_and_not_refused(tmp_path: Path) -> None:
    seconds = np.arange(DRIVE.size) / RATE
    late = np.where(np.arange(DRIVE.size) < 3500, seconds, seconds + 0.05)
    path = record(tmp_path / "gap.csv", POSITION, time=late)
    result = run("identify", path, *COLUMNS, *FIT)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[0] == "verdict: amber (time_gap)"
    assert "intervals of 0.001000 s before sample 3500 (3.550000 s)" in result.stdout
    rows = ["--rows", "3500"]
    assert "time_gap" not in run("identify", path, *COLUMNS, *FIT, *rows).stdout


def test_no_number_without_meaning_is_printed(tmp_path: Path) -> None:
    """A straight line in noise: nothing tells thresholds, offset or dead time."""
    u = DRIVE[:1000]
    y = 0.01 * u + np.random.default_rng(1).normal(0.0, 0.2, u.size)
    rows = np.stack([u, y], axis=1).tolist()
    path = write_csv(tmp_path / "line.csv", "drive_v,position_um", rows)
    result = run(
        "identify", str(path), *COLUMNS, "--operators", "6", "--weights", "free", "--ratios", "fit"
    )
    assert result.exit_code == 0, result.output
    assert "not determined" in result.stdout
    errors = re.findall(r"± ([0-9.e+-]+)", result.stdout)
    assert all(float(error) < 1e3 for error in errors)
    assert not re.search(r"\b(nan|inf)\b", result.stdout)
