"""Factors that stand beside arrays are told, as they may not be in the numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import mpi_hyst as mh
import nptdms
import numpy as np
import pandas as pd
import pytest
import scipy.io
from commands import run

from odd_files.test_instruments import T, U, Y

FIT = {"time_s": T, "drive_v": U, "gauge_um": Y}
Settings = dict[str, Any]
NAMES = ("--input", "drive_v", "--output", "gauge_um", "--operators", "4", "--dynamics", "none")


def npz(path: Path, beside: Settings) -> Path:
    arrays: Settings = {**FIT, **beside}
    np.savez(path / "record.npz", **arrays)
    return path / "record.npz"


def mat(path: Path, beside: Settings) -> Path:
    scipy.io.savemat(path / "record.mat", {**FIT, **beside})
    return path / "record.mat"


def structure(path: Path, beside: Settings) -> Path:
    scipy.io.savemat(path / "record.mat", {"run": {**FIT, **beside}})
    return path / "record.mat"


def hdf5(path: Path, beside: Settings) -> Path:
    with h5py.File(path / "record.h5", "w") as file:
        for name, values in {**FIT, **beside}.items():
            file[name] = values
    return path / "record.h5"


def attributes(path: Path, beside: Settings) -> Path:
    with h5py.File(path / "record.h5", "w") as file:
        for name, values in FIT.items():
            file[name] = values
        file["gauge_um"].attrs.update(beside)
    return path / "record.h5"


def of_file(path: Path, beside: Settings) -> Path:
    with h5py.File(path / "record.h5", "w") as file:
        for name, values in FIT.items():
            file[name] = values
        file.attrs.update(beside)
    return path / "record.h5"


def tdms(path: Path, beside: Settings) -> Path:
    with nptdms.TdmsWriter(path / "record.tdms") as writer:
        writer.write_segment([
            nptdms.ChannelObject("R", name, values, beside if name == "gauge_um" else {})
            for name, values in FIT.items()
        ])  # fmt: skip
    return path / "record.tdms"


def memory(path: Path, beside: Settings) -> Settings:
    del path
    return {**FIT, **beside}


def frame(path: Path, beside: Settings) -> pd.DataFrame:
    del path
    made = pd.DataFrame(FIT)
    made.attrs.update(beside)
    return made


Kind = Callable[[Path, Settings], Any]
KINDS: tuple[Kind, ...] = (
    npz, mat, structure, hdf5, attributes, of_file, tdms, memory, frame
)  # fmt: skip
FACTORS = ("gauge_scale", "gain", "um_per_volt", "umPerV", "Sensitivity", "cal_factor", "offset")
NONE = ("samples_per_second", "scaled", "run", "piezo", "v_per_s")


def doubts(source: Any) -> list[str]:
    return [one.text for one in mh.io.read(source).assumed if one.level == "doubtful"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", FACTORS)
def test_a_factor_beside_the_arrays_is_told(kind: Kind, name: str, tmp_path: Path) -> None:
    (said,) = doubts(kind(tmp_path, {name: 2.5}))
    assert f"{name} 2.5" in said and "not applied" in said, said


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", NONE)
def test_other_settings_are_not(kind: Kind, name: str, tmp_path: Path) -> None:
    assert not doubts(kind(tmp_path, {name: 2.5}))


@pytest.mark.parametrize("kind", KINDS)
def test_a_factor_of_one_is_none(kind: Kind, tmp_path: Path) -> None:
    assert not doubts(kind(tmp_path, {"gauge_scale": 1.0, "offset": 0.0}))


def test_factors_of_several_channels_are_told(tmp_path: Path) -> None:
    (said,) = doubts(npz(tmp_path, {"gains": np.array([20.0, 1.0])}))
    assert "gains 20, 1" in said
    (said,) = doubts(npz(tmp_path, {"calibration": "2.5 um/V"}))
    assert "calibration 2.5 um/V" in said
    for text in ("2026-03-01", "by AB", "1.0"):
        assert not doubts(npz(tmp_path, {"calibration": text}))


def test_a_factor_is_about_its_column(tmp_path: Path) -> None:
    path = npz(tmp_path, {"gauge_scale": 10.0})
    assert "gauge_scale 10" in run("look", str(path)).stdout
    found = run("identify", str(path), *NAMES)
    assert found.stdout.startswith("verdict: amber (assumed"), found.output
    given = run("identify", str(path), *NAMES, "--output-unit", "10 um")
    assert "gauge_scale" not in given.output, given.output


def test_a_text_of_matlab_beside_an_array_is_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "record.mat"
    scipy.io.savemat(path, {"run": {"time_s": T, "gauge": 1e3 * Y, "gauge_unit": "nm"}})
    assert mh.io.read(path).units["run.gauge"] == "nm"


def text(path: Path, above: str = "", between: str = "") -> tuple[mh.io.Columns, list[str]]:
    """Return a text with a line above its table and one between its rows, and what is doubtful."""
    rows = [",".join(f"{one:.6g}" for one in row) for row in zip(T, U, Y, strict=True)]
    middle = [*rows[:20], *([between] if between else []), *rows[20:]]
    lines = [*([above] if above else []), ",".join(FIT), *middle]
    (path / "record.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    record = mh.io.read(path / "record.csv")
    return record, [one.text for one in record.assumed if one.level == "doubtful"]


@pytest.mark.parametrize(
    ("above", "told"),
    [
        ("# gain 20", "gain 20"),
        ("# amplifier gain of 15", "gain of 15"),
        ("# Verstärkung = 10", "Verstärkung = 10"),
        ("# gain 1", ""),
        ("# the stage gained 20 V", ""),
    ],
)
def test_a_gain_above_the_table_is_told(tmp_path: Path, above: str, told: str) -> None:
    _, doubts = text(tmp_path, above=above)
    assert [told in one for one in doubts] == ([True] if told else []), doubts


@pytest.mark.parametrize(
    ("between", "is_told"),
    [("# gain 10", True), ("# from here in nm", True), ("# paused 3 s", False), ("# 2", False)],
)
def test_a_comment_between_rows_that_changes_their_size_is_told(
    tmp_path: Path, between: str, *, is_told: bool
) -> None:
    record, doubts = text(tmp_path, between=between)
    np.testing.assert_allclose(record["gauge_um"], Y, rtol=1e-5)
    assert [between in one and "line 22" in one for one in doubts] == [True] * is_told, doubts


@pytest.mark.parametrize(
    "line", ["# Sample rate: 100 Hz", "Sampling frequency (kHz); 10", "# fs = 1000"]
)
def test_a_rate_above_the_table_is_said(tmp_path: Path, line: str) -> None:
    record, doubts = text(tmp_path, above=line)
    (said,) = (one.text for one in record.assumed if "--rate" in one.text)
    assert said.startswith("line 1: ") and line.lstrip("# ") in said and not doubts


def test_a_rate_beside_arrays_is_said(tmp_path: Path) -> None:
    record = mh.io.read(npz(tmp_path, {"sample_rate": 100.0, "dt": 0.01}))
    said = [one.text for one in record.assumed if "--rate" in one.text]
    assert said == [
        "sample_rate 100 is not used; --rate says how fast a record is",
        "dt 0.01 is not used; --rate says how fast a record is",
    ]
