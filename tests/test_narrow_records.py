"""A stage whose records do not reach its limits: every command says why its drives stop there."""

from __future__ import annotations

import warnings
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, HEADER, RATE, record_rows, run, write_csv

REACHED = "-400.0 to 400.0 V of the limits -500 to 500 V"
SAID = "(the records do not reach the limits -500 to 500 V; --limits -500,500 goes there)"
FIT = (*COLUMNS, "--operators", "4", "-o", "found.json")


def stage_of(there: Path, *limits: str) -> str:
    write_csv(there / "narrow.csv", HEADER, record_rows(400.0))
    result = run("identify", "narrow.csv", *FIT, *limits)
    assert result.exit_code == 0, result.output
    rows = [[k / RATE, 2.6 * (1.0 - np.cos(k / 20.0))] for k in range(200)]
    write_csv(there / "far.csv", "time_s,target_um", rows)
    return result.stdout


def test_identify_says_that_the_records_do_not_reach_the_limits(there: Path) -> None:
    said = stage_of(there, "--limits", "-500,500")
    assert f"note: the records reach {REACHED}" in said and "--limits -500,500 too" in said


@pytest.mark.parametrize("limits", ["-400.1,400.1", "-300,400", None])
def test_identify_is_silent_where_the_records_fill_the_limits(
    there: Path, limits: str | None
) -> None:
    assert "note:" not in stage_of(there, *(() if limits is None else ("--limits", limits)))


def test_precompensate_and_simulate_name_the_option_that_goes_beyond(there: Path) -> None:
    stage_of(there, "--limits", "-500,500")
    drive = run("precompensate", "found.json", "far.csv", "-o", "drive.csv")
    assert drive.exit_code == 0 and SAID in drive.stdout, drive.output
    assert "held back by the drives that were identified, (-400.0, 400.0)" in drive.stdout
    assert "--limits may be given to go beyond" in drive.stdout
    looped = run("simulate", "found.json", "far.csv")
    assert looped.exit_code == 0 and SAID in looped.stdout, looped.output
    for command in (("precompensate", "found.json", "far.csv", "-o", "2.csv"), ("simulate",)):
        given = command if len(command) > 1 else ("simulate", "found.json", "far.csv")
        wider = run(*given, "--limits", "-450,450")
        assert wider.exit_code == 0 and "the records" not in wider.stdout, wider.output
        beyond = "warning: --limits: (-450.0, 450.0) is beyond the identified drives, -400 to 400 V"
        assert wider.output.count(beyond) == 1, wider.output


def test_a_stage_without_limits_says_that_others_may_be_given(there: Path) -> None:
    stage_of(there)
    drive = run("precompensate", "found.json", "far.csv", "-o", "drive.csv")
    assert "(the records reach no further; --limits goes beyond)" in drive.stdout, drive.output


@pytest.mark.parametrize("limits", [(-400.0, 400.0), (-300.0, 300.0)])
def test_limits_that_bind_are_called_so(there: Path, limits: tuple[float, float]) -> None:
    low, high = limits
    stage_of(there, "--limits", f"{low:g},{high:g}")
    stage = mh.load(there / "found.json")
    assert isinstance(stage, mh.Stage)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        stage.precompensate(np.linspace(0.0, 9.0, 50), 1 / RATE)
    said = [str(one.message) for one in caught]
    assert any(f"held back by the limits ({low:.1f}, {high:.1f})" in one for one in said), said
    drive = run("precompensate", "found.json", "far.csv", "-o", "drive.csv")
    assert "the records" not in drive.stdout, drive.output


def test_a_target_without_a_unit_has_that_of_the_stage(there: Path) -> None:
    stage_of(there, "--limits", "-400,400")
    rows = [[k / RATE, 0.5 * (1.0 - np.cos(k / 20.0))] for k in range(200)]
    write_csv(there / "bare.csv", "t,target", rows)
    drive = run("precompensate", "found.json", "bare.csv", "-o", "drive.csv")
    line = next(one for one in drive.stdout.splitlines() if "max |model - target|" in one)
    assert line.endswith(" µm"), drive.output
    assert "max (µm)" in run("simulate", "found.json", "bare.csv").stdout


def test_a_held_out_record_beyond_the_others_is_a_finding_and_no_python_warning(
    there: Path,
) -> None:
    write_csv(there / "narrow.csv", HEADER, record_rows(300.0))
    write_csv(there / "wide.csv", HEADER, record_rows(400.0))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        held_out = ("--validate", "wide.csv", "--report", "fit.html")
        result = run("identify", "narrow.csv", *FIT, *held_out)
    assert result.exit_code == 0 and "extrapolation" in result.stdout, result.output
    assert [str(one.message) for one in caught] == []
