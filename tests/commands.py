"""What tests of the command line share: a small record, and how a refusal looks."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt
from click.testing import CliRunner, Result
from mpi_hyst._cli.commands import commands

Array = npt.NDArray[np.float64]

COLUMNS = ["--input", "drive_v", "--output", "position_um"]
RATIOS = {"ra": 0.9, "rb": 0.3, "rc": 0.4}
RATE = 200.0


def actuator() -> mh.ModifiedPrandtlIshlinskii:
    return mh.ModifiedPrandtlIshlinskii.from_ratios(
        [4e-3, 3e-4, 2e-4, 4e-4], [0.0, 100.0, 200.0, 300.0], **RATIOS
    )


def write_csv(path: Path, header: str, rows: Sequence[Sequence[object]]) -> Path:
    lines = [header, *(",".join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def record_rows(amplitude: float = 400.0) -> list[list[object]]:
    drive = mh.signals.decaying_triangle(amplitude, 1.0, cycles=5, rate=RATE)
    position = actuator().forward().run(drive)
    return [
        [sample / RATE, *pair]
        for sample, pair in enumerate(zip(drive.tolist(), position.tolist(), strict=True))
    ]


HEADER = "time_s,drive_v,position_um"


def run(*arguments: str) -> Result:
    return CliRunner().invoke(commands, arguments, catch_exceptions=False)


def column(path: Path, name: str) -> Array:
    with path.open(newline="", encoding="utf-8") as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


def assert_refused(result: Result, directory: Path, before: set[str], *said: str) -> None:
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.startswith("mpi-hyst: error: ")
    assert result.stderr.count("\n") == 1 and result.stderr.endswith("\n")
    for words in said:
        assert words in result.stderr
    assert {path.name for path in directory.iterdir()} == before


def names_in(directory: Path) -> set[str]:
    return {path.name for path in directory.iterdir()}
