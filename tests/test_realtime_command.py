"""`mpi-hyst realtime`: its summary, what it writes, and its errors."""

from __future__ import annotations

import json
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import assert_refused, names_in, run, write_csv

FILES = {"stage.json", "reference.csv"}
REALTIME = ["realtime", "stage.json", "--rate", "1000", "--seconds", "0.2"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    mh.paper.plant("A1").stage.save(tmp_path / "stage.json")
    write_csv(tmp_path / "reference.csv", "target_um", [[0.01 * k] for k in range(100)])
    return tmp_path


def test_it_says_what_the_loop_did(here: Path) -> None:
    more = ["--reference", "reference.csv", "-o", "x.npy", "--json", "x.json", "--plot", "x.png"]
    result = run(*REALTIME, *more)
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    report, record = json.loads((here / "x.json").read_text()), np.load(here / "x.npy")
    assert (report["end"], report["at_rest"]) == ("time_over", True)
    assert len(record) == report["deadlines"]["taken"]
    first = record["reference"][:100]
    np.testing.assert_allclose(np.diff(first), 0.01 * np.diff(np.rint(100 * first)), atol=1e-12)
    assert names_in(here) == FILES | {"x.npy", "x.json", "x.png"}
    for said in (
        "stage.json at 1000 Hz",
        "time over, at the rest drive",
        f"{report['deadlines']['taken']}, {report['deadlines']['skipped']} deadlines skipped",
        "p99.99",
        "written  x.npy",
        "written  x.png",
    ):
        assert said in result.stdout


def test_a_reference_is_made_that_stays_in_range(here: Path) -> None:
    result = run(*REALTIME, "-o", "x.npy", "--misses", "catch_up", "--rest", "5")
    assert result.exit_code == 0, result.output
    low, high = mh.paper.plant("A1").stage.position_range or (0.0, 0.0)
    record = np.load(here / "x.npy")
    assert low < record["reference"].min() < record["reference"].max() < high
    assert record["drive"][-1] == 5.0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--rest", "900"], "--rest: expected a drive within the limits"),
        (["--rest-rate", "0"], "--rest-rate: expected a rate above 0"),
        (["--seconds", "0"], "--seconds: expected a time"),
        (["--watchdog", "2,1"], "--watchdog: expected a time from 0 to rest_after"),
        (["--fifo", "100"], "--fifo: expected a priority from 1 to 99"),
        (["--udp", "127.0.0.1:1"], "--local: expected HOST:PORT beside --udp"),
        (
            ["--udp", "127.0.0.1:1", "--local", "127.0.0.1:0", "--shared-memory", "m"],
            "--udp: expected none beside --shared-memory",
        ),
        (["--reference", "none.csv"], "none.csv"),
        (["-o", "stage.json"], "stage.json: is an input file"),
        (["--plot", "x.tiff"], "--plot: expected a name that ends in .svg, .png or .pdf"),
    ],
)
def test_what_cannot_be_is_refused(here: Path, more: list[str], said: str) -> None:
    assert_refused(run(*REALTIME, *more), here, FILES, said)
