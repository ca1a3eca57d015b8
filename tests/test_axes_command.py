"""The command axes: records with several drives and positions in files; stage and report out."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, names_in, run

DT = 1e-3
PLANT = mh.MultiAxisStage(
    [[0.8, 0.1], [0.0, 0.7]],
    [[0.2, 0.0], [0.0, 0.3]],
    np.eye(2),
    np.zeros((2, 2)),
    bw=np.zeros((2, 0)),
    cq=np.zeros((0, 2)),
    dq=np.zeros((0, 2)),
    operators=[],
    dt=DT,
)


@pytest.fixture
def room(tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    for number in range(2):
        u = rng.standard_normal((900, 2))
        y = PLANT.forward().run(u) + 1e-3 * rng.standard_normal((900, 2))
        table = np.column_stack([DT * np.arange(900), u, y])
        np.savetxt(
            tmp_path / f"record{number}.csv",
            table,
            delimiter=",",
            header="time_s,left_v,right_v,x_um,y_um",
            comments="",
        )
    return tmp_path


def given(room: Path) -> list[str]:
    return [
        "axes",
        *(str(room / f"record{number}.csv") for number in range(2)),
        *("--drives", "left_v,right_v", "--positions", "x_um,y_um"),
        *("--order", "2", "--hysteresis", "none"),
    ]


def test_records_give_a_stage_and_a_page(room: Path) -> None:
    result = run(*given(room), "-o", str(room / "axes.json"), "--report", str(room / "axes.html"))
    assert result.exit_code == 0, result.output
    assert "verdict:" in result.stdout and "states" in result.stdout
    assert "plays" not in result.stdout and "duhem" not in result.stdout.lower()
    stage = mh.MultiAxisStage.load(room / "axes.json")
    u = np.random.default_rng(9).standard_normal((300, 2))
    missed = stage.forward().run(u) - PLANT.forward().run(u)
    assert np.abs(missed).max() < 5e-3
    page = (room / "axes.html").read_text("utf-8")
    assert "What was tried" in page and "left_v, right_v to x_um, y_um" in page


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--drives", "left_v,left_v"], "expected names of different columns"),
        (["--positions", "left_v,x_um"], "--positions: expected no column of --drives, got left_v"),
        (["--positions", "x_um,z_um"], "z_um"),
        (["--order", "0"], "a whole number of at least 1"),
        (["--skip", "900"], "skip: expected fewer than the 900 samples"),
        (["--rate", "-5"], "--rate"),
    ],
)
def test_wrong_input_is_refused(room: Path, change: list[str], message: str) -> None:
    before = names_in(room)
    assert_refused(run(*given(room), *change, "-o", str(room / "no.json")), room, before, message)
