"""Reports from Python: those of the command line, with version, date, command and hashes."""

from __future__ import annotations

import hashlib
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, HEADER, RATE, column, record_rows, run, write_csv
from test_report import parsed, sections, words


@pytest.fixture(autouse=True)
def the_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_report_from_python_is_that_of_the_command_line(tmp_path: Path) -> None:
    paths = [
        write_csv(tmp_path / f"{volts}.csv", HEADER, record_rows(volts)) for volts in (400.0, 300.0)
    ]
    of_command, of_python = tmp_path / "command.html", tmp_path / "python.html"
    fixed = ["--operators", "6", "--dead-time", "0", "--skip", "50"]
    run("identify", *map(str, paths), *COLUMNS, *fixed, "--report", str(of_command))
    pairs = [(column(path, "drive_v"), column(path, "position_um")) for path in paths]
    options: dict[str, Any] = {"dt": 1.0 / RATE, "operators": 6, "dead_time": 0.0, "skip": 50}
    found, other = (
        mh.identify(pairs, model=kind, **options) for kind in ("modified", "conventional")
    )
    names = [path.name for path in paths]
    found.report(of_python, pairs, skip=50, names=names, units=("V", "um"), beside=other)
    command, python = parsed(of_command), parsed(of_python)
    assert sections(python) == sections(command)
    for mine, its in zip(python.iter("section"), command.iter("section"), strict=True):
        # What was given to the command is marked as such.
        assert words(mine) == words(its).replace(" (given)", "")
        pictures = [[image.get("src") for image in one.iter("img")] for one in (mine, its)]
        assert len(pictures[0]) == len(pictures[1])


def test_records_that_were_held_out_are_shown(tmp_path: Path) -> None:
    paths = [
        write_csv(tmp_path / f"{volts}.csv", HEADER, record_rows(volts)) for volts in (400.0, 300.0)
    ]
    of_command, of_python = tmp_path / "command.html", tmp_path / "python.html"
    fixed = ["--operators", "6", "--dead-time", "0", "--validate", str(paths[1])]
    run("identify", str(paths[0]), *COLUMNS, *fixed, "--report", str(of_command))
    fit, held_out = ((column(path, "drive_v"), column(path, "position_um")) for path in paths)
    options: dict[str, Any] = {"dt": 1.0 / RATE, "operators": 6, "dead_time": 0.0}
    found, other = (
        mh.identify(*fit, validate=(*held_out, 0), model=kind, **options)
        for kind in ("modified", "conventional")
    )
    shown: dict[str, Any] = {"names": ["400.0.csv"], "units": ("V", "um"), "beside": other}
    found.report(of_python, *fit, **shown, validate=held_out)
    command, python = parsed(of_command), parsed(of_python)
    its = {one.get("id"): one for one in command.iter("section")}
    mine = {one.get("id"): one for one in python.iter("section")}
    assert mine.keys() == its.keys()
    for name in ("errors", "residuals"):
        expected = words(its[name]).replace("300.0.csv", "validation record 1")
        assert words(mine[name]) == expected
    assert "Validation errors" in words(mine["errors"])
    for wrong in ([held_out] * 2, []):
        said = rf"^validate: expected the 1 records that were held out, got {len(wrong)}$"
        with pytest.raises(ValueError, match=said):
            found.report(of_python, *fit, validate=wrong)
    with pytest.raises(TypeError, match=r"^validate: expected None without the records u and y"):
        found.report(of_python, validate=held_out)
    no_pair: list[Any] = [held_out[0]]
    with pytest.raises(TypeError, match=r"^validate\[0\]: expected \(u, y\) or \(u, y, skip\)"):
        found.report(of_python, *fit, validate=no_pair)
    no_list: Any = 3
    with pytest.raises(TypeError, match=r"^validate: expected \(u, y\), .* got 3$"):
        found.report(of_python, *fit, validate=no_list)


def test_a_report_says_how_it_was_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_csv(tmp_path / "my record.csv", HEADER, record_rows())
    options = ["--operators", "4", "-o", "stage.json", "--report", "fit.html"]
    run("identify", "my record.csv", *COLUMNS, *options)
    made = words(parsed(tmp_path / "fit.html"))
    command = "mpi-hyst identify 'my record.csv' --input drive_v --output position_um"
    for said in (
        f"made with mpi_hyst {version('mpi_hyst')} date 2023-11-14 22:13:20+00:00",
        f"made by {command} --operators 4 -o stage.json --report fit.html",
        f"data my record.csv, SHA-256 {sha256(tmp_path / 'my record.csv')}",
        f"stage stage.json, SHA-256 {sha256(tmp_path / 'stage.json')}",
    ):
        assert said in made
    target = [[sample / 1e3, np.sin(sample / 30.0)] for sample in range(200)]
    write_csv(tmp_path / "target.csv", "time_s,target_um", target)
    run("simulate", "stage.json", "target.csv", "--report", "run.html")
    made = words(parsed(tmp_path / "run.html"))
    for said in (
        f"data target.csv, SHA-256 {sha256(tmp_path / 'target.csv')}",
        f"stage stage.json, SHA-256 {sha256(tmp_path / 'stage.json')}",
        "made by mpi-hyst simulate stage.json target.csv --report run.html",
    ):
        assert said in made


@pytest.fixture(scope="module")
def fitted() -> tuple[mh.results.Identification, list[float], list[float]]:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=4, rate=200.0)
    y = mh.paper.table_1_recovered().forward().run(u)
    found = mh.identify(u, y, operators=5, input_offset=0.0, dead_time=0.0, validate=0.2)
    return found, u.tolist(), y.tolist()


def test_without_its_records_a_report_has_what_the_result_knows(
    fitted: tuple[mh.results.Identification, list[float], list[float]], tmp_path: Path
) -> None:
    found, u, y = fitted
    found.report(tmp_path / "bare.html")
    root = parsed(tmp_path / "bare.html")
    assert sections(root)[:3] == ["loops", "errors", "warnings"] and sections(root)[-1] == "model"
    page = words(root)
    assert found.validation is not None and f"{found.validation.rmse_percent:.3f}" in page
    assert "Loops of the model" in page and "Residuals over input" not in page
    stage = hashlib.sha256(found.stage.to_bytes()).hexdigest()
    assert f"Stage.to_bytes(), SHA-256 {stage}" in page
    found.report(tmp_path / "whole.html", u, y)
    whole = words(parsed(tmp_path / "whole.html"))
    data = hashlib.sha256(np.array([u, y], dtype="<f8").tobytes()).hexdigest()
    assert f"record 1, u and y as float64, SHA-256 {data}" in whole
    assert "Residuals over input" in whole


def test_a_report_is_replaced_whole_or_not_at_all(
    fitted: tuple[mh.results.Identification, list[float], list[float]], tmp_path: Path
) -> None:
    found, u, y = fitted
    path = tmp_path / "report.html"
    path.write_text("before", encoding="utf-8")
    wrong: dict[str, Any]
    for wrong, said in (
        ({"u": [(u, y)] * 2}, r"^u: expected the 1 records that were fitted, got 2$"),
        ({"u": [(u, y[:-1])]}, r"^y\[0\]: expected as many samples as u has, got 800 and 799$"),
        ({"u": u, "y": [[1.0]]}, r"^y\[0\]: expected at least 2 finite samples in one row$"),
        ({"u": u, "y": y, "skip": len(u)}, r"^skip\[0\]: expected 0 to 798, got 800$"),
        ({"names": ["a", "b"]}, r"^names: expected 1, one for each record, got 2$"),
    ):
        with pytest.raises(ValueError, match=said):
            found.report(path, **wrong)
    for wrong, said in (
        ({"y": y}, r"^u: expected the drive at which y was measured, got None$"),
        ({"u": u, "y": y, "skip": "2s"}, r"^skip\[0\]: expected a number of samples, got '2s'$"),
        ({"names": [3]}, r"^names\[0\]: expected a text, got 3$"),
        ({"beside": 3}, r"^beside: expected an Identification, got 3$"),
        ({"units": "V"}, r"^units: expected the names of two units, got 'V'$"),
    ):
        with pytest.raises(TypeError, match=said):
            found.report(path, **wrong)
    with pytest.raises(OSError, match="no_such"):
        found.report(tmp_path / "no_such" / "report.html")
    assert path.read_text("utf-8") == "before"
    assert [one.name for one in tmp_path.iterdir()] == ["report.html"]
    found.report(path, u, y)
    assert re.search("Residuals", path.read_text("utf-8"))
