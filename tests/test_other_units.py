"""Units that are not V and um: they are those of the stage, and others are refused."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import RATE, assert_refused, names_in, record_rows, run, write_csv
from odd_files.case import PLAIN

FIT = ("--input", "1", "--output", "2", *PLAIN, "-o", "found.json")


def identified(there: Path, header: str, *options: str) -> tuple[str, str]:
    write_csv(there / "other.csv", header, record_rows())
    result = run("identify", "other.csv", *FIT, *options)
    assert result.exit_code == 0, result.output
    stage = mh.load(there / "found.json")
    assert isinstance(stage, mh.Stage)
    return stage.units


@pytest.mark.parametrize(
    ("header", "units"),
    [
        ("time_s,T [degC],x [mm]", ("degC", "mm")),
        ("time_s,temp_degC,x (mm)", ("degC", "mm")),
        ("time_s,p [bar],d [%]", ("bar", "%")),
        ("time_s,H [A/m],lambda [ppm]", ("A/m", "ppm")),
        ("time_s,E [MV/m],pos [counts]", ("MV/m", "counts")),
        ("time_s,u (V),Pos[Å]", ("V", "angstrom")),
        ("time_s,u [psi],angle [arcsec]", ("psi", "arcsec")),
        ("time_s,u,pos (raw)", ("V", "um")),
        ("time_s,u,pos\ns,-,steps", ("V", "steps")),
    ],
)
def test_a_unit_that_is_stated_is_kept(there: Path, header: str, units: tuple[str, str]) -> None:
    assert identified(there, header) == units


def test_a_unit_that_no_file_states_is_given(there: Path) -> None:
    options = ("--input-unit", "°C", "--output-unit", "furlong")
    assert identified(there, "time_s,u,pos", *options) == ("degC", "furlong")


def test_a_target_in_another_unit_is_refused(there: Path) -> None:
    identified(there, "time_s,T [degC],x [µstrain]")
    # The rows of a record in another unit are not those of this one.
    rows = [[time, 0.9 * float(str(u)), y] for time, u, y in record_rows(300.0)]
    write_csv(there / "second.csv", "time_s,T [K],x [µstrain]", rows)
    target = 0.2 * (1.0 - np.cos(np.arange(100) / 10.0))
    for header in ("target_um", "target [µstrain]", "target"):
        times = np.arange(target.size) / RATE
        rows_of_target = np.column_stack([times, target]).tolist()
        write_csv(there / "target.csv", f"time_s,{header}", rows_of_target)
        given = ("precompensate", "found.json", "target.csv", "-o", "out.csv")
        before = names_in(there)
        if header == "target_um":
            said = "target_um: expected µstrain, as the stage has, got um"
            assert_refused(run(*given), there, before, said)
        else:
            result = run(*given)
            assert result.exit_code == 0, result.output
            assert (there / "out.csv").read_text("utf-8").startswith("time_s,drive_degc\n")
            (there / "out.csv").unlink()
    before = names_in(there)
    said = "second.csv, column 1: expected degC as before, got K"
    assert_refused(run("identify", "other.csv", "second.csv", *FIT), there, before, said)
