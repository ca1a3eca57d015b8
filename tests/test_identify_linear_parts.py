"""Dynamics and creep in the summary and in the report of `mpi-hyst identify`."""

from __future__ import annotations

import re
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, HEADER, RATE, actuator, run, write_csv
from test_report import parsed, sections, words

SECONDS = 4.6  # long enough for two terms of creep
FIT = ["--operators", "4", "--weights", "free", "--ratios", "0.9,0.3,0.4", "--input-offset", "0"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory to be in, with a record of a stage that resonates and creeps."""
    monkeypatch.chdir(tmp_path)
    creep = mh.plant.Creep.logarithmic(0.02, 0.01, 10.0, 4)
    stage = mh.Stage(actuator(), dynamics=mh.plant.SecondOrder(40.0, 0.6), creep=creep)
    drive = mh.signals.decaying_triangle(400.0, 3.0, cycles=12, rate=RATE)
    drive = np.append(drive, np.zeros(round(SECONDS * RATE) - drive.size))
    noise = np.random.default_rng(3).normal(0.0, 1e-3, drive.size)
    position = stage.forward(1.0 / RATE).run(drive) + noise
    rows = zip(
        (np.arange(drive.size) / RATE).tolist(), drive.tolist(), position.tolist(), strict=True
    )
    write_csv(tmp_path / "record.csv", HEADER, list(rows))
    return tmp_path


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--creep", "2", "--dynamics", "none"],
            [r"creep +\S+ ± \S+ %  \S+ ± \S+ % of a step", r"0\.1533 s  1\.533 s"],
        ),
        (
            ["--dynamics", "2", "--creep", "none"],
            [r"natural frequency +\d+\.\d+ ± \S+ Hz", r"damping ratio +0\.\d+ ±"],
        ),
        (
            ["--dynamics", "auto", "--creep", "auto"],
            [
                r"natural frequency +(39|40)\.\d+ ± ",
                r"creep +(1\.[6-9]|2\.[01])\d* ± \S+ % of a step per decade",
                r"creep time constants +0\.\d+ to \S+ s, \d terms",
            ],
        ),
    ],
)
def test_linear_parts_are_told(here: Path, options: list[str], said: list[str]) -> None:
    given = [*COLUMNS, *FIT, *options]
    result = run("identify", "record.csv", *given, "-o", "s.json", "--report", "report.html")
    assert result.exit_code == 0, result.output
    root = parsed(here / "report.html")
    assert sections(root)[-1] == "model"
    # The page has words, so the spaces that align the columns of the terminal are one there.
    page = words(root)
    for pattern in said:
        assert re.search(pattern, result.stdout), result.stdout
        assert re.search(pattern.replace("  ", " "), page), pattern
    stage = mh.load(here / "s.json")
    assert isinstance(stage, mh.Stage)
    for part, option in ((stage.creep, "--creep"), (stage.dynamics, "--dynamics")):
        assert (part is None) == (options[options.index(option) + 1] == "none")


def test_dynamics_that_a_record_does_not_tell_are_said_to_be_none(there: Path) -> None:
    result = run("identify", "record.csv", *COLUMNS, *FIT, "--dynamics", "1", "-o", "s.json")
    assert result.exit_code == 0, result.output
    assert "none: a dead time fits as well" in result.stdout
    stage = mh.load(there / "s.json")
    assert isinstance(stage, mh.Stage) and stage.dynamics is None
