"""What `precompensate` and `simulate` write says its units, and is read back without options."""

from __future__ import annotations

from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest
from commands import RATE, actuator, column, run
from mpi_hyst._quantity import stated_unit

LIMITS = ("--limits", "-500,500")
TARGET = 1.0 - np.cos(np.arange(60) / 10.0)
MILLISECONDS = np.arange(TARGET.size) * 1e3 / RATE


def trajectory(path: Path, header: str, times: np.ndarray | None) -> None:
    columns = [TARGET] if times is None else [times, TARGET]
    rows = [
        ";".join(map(repr, row)) for row in zip(*(one.tolist() for one in columns), strict=True)
    ]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


def header(path: Path) -> str:
    return path.read_text("utf-8").splitlines()[0]


@pytest.mark.parametrize(
    ("given", "times", "options", "written"),
    [
        ("time_s;target_um", MILLISECONDS / 1e3, [], "time_s"),
        ("t_ms;target_um", MILLISECONDS, [], "t_ms"),
        ("Zeit [ms];target_um", MILLISECONDS, [], "Zeit [ms]"),
        ("Zeit;Soll\nms;um", MILLISECONDS, [], "time_ms"),
        ("time_s;Soll\nms;um", MILLISECONDS, [], "time_ms"),
        ("time;target", MILLISECONDS / 1e3, [], "time_s"),
        ("clock;target", MILLISECONDS / 1e3, ["--time", "clock"], "time_s"),
        ("clock_us;target", 1e3 * MILLISECONDS, ["--time", "clock_us"], "time_us"),
        ("target_um", None, ["--rate", f"{RATE:g}"], "time_s"),
    ],
)
@pytest.mark.parametrize("lead_in", [[], ["--lead-in", "0.05"]])
def test_times_are_those_of_the_trajectory_in_a_unit_that_is_told(
    there: Path,
    given: str,
    times: np.ndarray | None,
    options: list[str],
    written: str,
    lead_in: list[str],
) -> None:
    trajectory(there / "target.csv", given, times)
    for command in ("precompensate", "simulate"):
        to = ("stage.json", "target.csv", "-o", "out.csv", *LIMITS, *options, *lead_in)
        result = run(command, *to)
        assert result.exit_code == 0, result.output
        assert header(there / "out.csv").startswith(f"{written},")
        back = mh.io.read(there / "out.csv")
        assert back.time_column == written and back.seconds is not None
        before = 10 if lead_in else 0
        # Of numbers in a file nothing but rounding is lost.
        np.testing.assert_allclose(
            back.seconds, (np.arange(TARGET.size + before) - before) / RATE, rtol=0, atol=1e-12
        )


@pytest.mark.parametrize(
    ("units", "drive", "others"),
    [
        (("V", "um"), "drive", "_um"),
        (("mV", "nm"), "drive_mv", "_nm"),
        (("mA", "µm"), "drive_ma", "_um"),
        (("", ""), "drive", ""),
        (("counts", "steps"), "drive_counts", " [steps]"),
        (("°C", "%"), "drive_degc", " [%]"),
        (("MV/m", "Å"), "drive [MV/m]", "_angstrom"),
    ],
)
def test_columns_say_the_units_of_the_stage(
    there: Path, units: tuple[str, str], drive: str, others: str
) -> None:
    mh.Stage(actuator(), units=units).save(there / "stage.json")
    trajectory(there / "target.csv", "time_s;target", MILLISECONDS / 1e3)
    assert run("precompensate", "stage.json", "target.csv", "-o", "drive.csv").exit_code == 0
    assert header(there / "drive.csv") == f"time_s,{drive}"
    assert run("simulate", "stage.json", "target.csv", "-o", "run.csv", *LIMITS).exit_code == 0
    names = [f"reference{others}", drive, f"measured{others}", f"position{others}"]
    assert header(there / "run.csv") == ",".join(["time_s", *names])
    back, stated = mh.io.read(there / "run.csv"), stated_unit(units[1])
    assert back.quantity(names[0]).suffix == stated
    again = ("simulate", "stage.json", "run.csv", "--column", names[0], *LIMITS)
    assert run(*again).exit_code == 0


def test_a_reference_with_a_unit_keeps_it(there: Path) -> None:
    mh.Stage(actuator(), units=("", "")).save(there / "stage.json")
    trajectory(there / "target.csv", "time_s;target_nm", MILLISECONDS / 1e3)
    assert run("simulate", "stage.json", "target.csv", "-o", "run.csv", *LIMITS).exit_code == 0
    expected = "time_s,reference_nm,drive,measured_nm,position_nm"
    assert header(there / "run.csv") == expected


def test_a_drive_without_any_time_has_none(there: Path) -> None:
    trajectory(there / "target.csv", "target_um", None)
    assert run("precompensate", "stage.json", "target.csv", "-o", "drive.csv").exit_code == 0
    assert header(there / "drive.csv") == "drive"


def test_what_is_written_is_read_by_the_other_commands(there: Path) -> None:
    trajectory(there / "target.csv", "Zeit;Soll\nms;um", MILLISECONDS)
    assert run("precompensate", "stage.json", "target.csv", "-o", "drive.csv").exit_code == 0
    assert run("simulate", "stage.json", "target.csv", "-o", "run.csv", *LIMITS).exit_code == 0
    looked = run("look", "drive.csv").stdout
    assert "no command to suggest" in looked and "precompensate" not in looked
    assert "--input drive --output " in run("look", "run.csv").stdout
    again = ("simulate", "stage.json", "run.csv", "--column", "reference_um", "-o", "again.csv")
    assert run(*again, *LIMITS).exit_code == 0
    assert (there / "again.csv").read_bytes() == (there / "run.csv").read_bytes()
    drive = ("precompensate", "stage.json", "run.csv", "--column", "reference_um", "-o", "2.csv")
    assert run(*drive).exit_code == 0
    assert (there / "2.csv").read_bytes() == (there / "drive.csv").read_bytes()
    fit = ("--input", "drive", "--output", "position_um", "--operators", "4", "-o", "found.json")
    assert run("identify", "run.csv", *fit).exit_code in (0, 3)
    found = mh.load(there / "found.json")
    assert isinstance(found, mh.Stage) and found.units == ("V", "um")
    assert column(there / "run.csv", "drive").size == TARGET.size


@pytest.mark.parametrize("units", [("V", "um"), ("", "")])
def test_a_drive_alone_is_not_taken_for_a_trajectory(there: Path, units: tuple[str, str]) -> None:
    mh.Stage(actuator(), units=units).save(there / "stage.json")
    trajectory(there / "target.csv", "time_s;target", MILLISECONDS / 1e3)
    assert run("precompensate", "stage.json", "target.csv", "-o", "drive.csv").exit_code == 0
    assert "no command to suggest" in run("look", "drive.csv").stdout
    refused = run("precompensate", "stage.json", "drive.csv", "-o", "again.csv")
    assert refused.exit_code == 2 and "drive.csv" in refused.stderr
