"""Binary files and objects in memory: columns by path, refused where they are no numbers."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import mpi_hyst as mh
import numpy as np
import pandas as pd
import polars as pl
import pytest
import scipy.io
import xarray as xr
from commands import assert_refused, names_in, run
from mpi_hyst._io.formats import FORMATS, known
from mpi_hyst._io.source import PACKED
from nptdms import ChannelObject, TdmsWriter

T = np.arange(50) * 0.5
U, Y = 10.0 * np.sin(T), 3.0 * np.sin(T - 0.1)
TABLE = np.column_stack([T, U, Y])
RECORD = np.array(
    list(zip(T, U, Y, strict=True)),
    dtype=[("time_s", float), ("drive_v", float), ("pos_um", float)],
)
NESTED = {"data": {"time_s": T, "drive": U, "deep": {"pos": Y}}, "fs": 2.0, "note": "hand made"}


def write_npz(path: Path) -> None:
    np.savez(path, time_s=T, u=U.reshape(-1, 1), both=TABLE, note=np.array("x"))


def write_mat(path: Path) -> None:
    scipy.io.savemat(path, NESTED)


def write_mat_array(path: Path) -> None:
    columns = np.array([(T,), (U,), (Y,)], dtype=[("Data", object)])
    scipy.io.savemat(path, {"rec": {"Y": columns, "cells": np.array([T, U, Y[:5]], dtype=object)}})


def write_mat73_cells(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, column in {"a": T, "b": U, "c": Y}.items():
            file[f"#refs#/{name}"] = column[None, :]
        refs = [[file[f"#refs#/{name}"].ref] for name in "abc"]
        file.create_dataset("rec/Y/Data", data=refs, dtype=h5py.ref_dtype)
        itself = file.create_dataset("rec/loop", (1,), dtype=h5py.ref_dtype)
        itself[0] = itself.ref
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_mat73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, column in {"time_s": T, "drive": U, "deep/pos": Y}.items():
            file[f"data/{name}"] = column[None, :]
        file["data/all"] = TABLE.T
        file["#refs#/a"] = T
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["group/dataset"] = TABLE
        file["group/u"] = U
        file["group/u"].attrs["units"] = "kV"
        file["group/y"] = Y
        file["group/y"].attrs["units"] = np.array(["nm"], dtype=h5py.string_dtype())
        file["group/table"] = RECORD
        file["rate"] = 2.0
        file["names"] = [b"a", b"b"]


def write_tdms(path: Path) -> None:
    clock = {"wf_increment": 0.5, "wf_start_offset": 0.0}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("Rig", "Drive", U, {**clock, "unit_string": "V"}),
                ChannelObject("Rig", "Gauge", Y, {**clock, "unit_string": "µm"}),
            ]
        )


def lvm_text(segments: int = 1, comma: bool = False, x_columns: str = "One") -> str:
    lines = ["LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab"]
    lines += [f"Decimal_Separator\t{',' if comma else '.'}", f"X_Columns\t{x_columns}"]
    lines += ["Date\t2026/11/22", "Time\t10:00:00.0000000", "***End_of_Header***\t", ""]
    for part in range(segments):
        start = len(T) // segments * part
        rows = TABLE[start : start + len(T) // segments]
        lines += ["Channels\t2\t\t", f"Samples\t{len(rows)}\t{len(rows)}\t"]
        lines += ["Date\t2026/11/22\t2026/11/22\t"]
        lines += [f"Time\t10:00:{T[start]:09.6f}\t10:00:{T[start]:09.6f}\t"]
        lines += ["Y_Unit_Label\tVolts\tµm\t", "X_Dimension\tTime\tTime\t"]
        lines += ["X0\t0.0E+0\t0.0E+0\t", "Delta_X\t0.5\t0.5\t", "***End_of_Header***\t\t\t"]
        lines += ["X_Value\tDrive\tGauge\tComment"]
        for t, u, y in rows:
            x = "" if x_columns == "No" else repr(float(t - T[start]))
            text = f"{x}\t{float(u)!r}\t{float(y)!r}"
            lines.append(text.replace(".", ",") if comma else text)
        lines.append("")
    text = "\n".join(lines)
    return text.replace("0.0E+0", "0,0E+0").replace("\t0.5", "\t0,5") if comma else text


def lvm(**options: Any) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        path.write_text(lvm_text(**options), encoding="utf-8")

    return write


# Who writes it, the suffix, the columns of time, drive and position, and how the format is called.
FILES: dict[str, tuple[Callable[[Path], None], str, tuple[str, str, str], str]] = {
    "npy": (lambda path: np.save(path, TABLE), ".npy", ("0", "1", "2"), "NumPy array"),
    "npy, lying": (lambda path: np.save(path, TABLE.T), ".npy", ("0", "1", "2"), "NumPy array"),
    "structured npy": (
        lambda path: np.save(path, RECORD), ".npy", ("time_s", "drive_v", "pos_um"), "NumPy array"
    ),
    "npz": (write_npz, ".npz", ("time_s", "u", "both:2"), "NumPy archive"),
    "mat": (write_mat, ".mat", ("data.time_s", "data.drive", "data.deep.pos"), "MATLAB 5"),
    "mat, paths": (write_mat, ".mat", ("data/time_s", "data/drive", "/data/deep/pos"), "MATLAB 5"),
    "mat, structures in an array": (
        write_mat_array, ".mat", ("rec.Y.0.Data", "rec.Y.1.Data", "rec.Y.2.Data"), "MATLAB 5"
    ),
    "mat 7.3, cells": (
        write_mat73_cells, ".mat", ("rec.Y.Data.0", "rec.Y.Data.1", "rec.Y.Data.2"), "MATLAB 7.3"
    ),
    "mat 7.3": (write_mat73, ".mat", ("data.time_s", "data.drive", "data.deep.pos"), "MATLAB 7.3"),
    "mat 7.3, matrix": (write_mat73, ".mat", ("data.all:0", "data/all:1", "data.all:2"),
                        "MATLAB 7.3"),
    "hdf5": (write_hdf5, ".h5", ("group/dataset:0", "group/u", "group.dataset:2"), "HDF5"),
    "hdf5, table": (
        write_hdf5, ".h5", ("group/table/time_s", "group/table/drive_v", "/group/table/pos_um"),
        "HDF5",
    ),
    "tdms": (write_tdms, ".tdms", ("time_s", "Rig/Drive", "Rig/Gauge"), "TDMS"),
    "lvm": (lvm(), ".lvm", ("time_s", "Drive", "Gauge"), "LabVIEW measurement"),
    "lvm, no times": (
        lvm(x_columns="No"), ".lvm", ("time_s", "Drive", "Gauge"), "LabVIEW measurement"
    ),
    "lvm, commas, segments": (
        lvm(segments=5, comma=True), ".lvm", ("time_s", "Drive", "Gauge"),
        "LabVIEW measurement, 5 segments",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", FILES)
def test_binary_files_are_read(tmp_path: Path, kind: str) -> None:
    write, suffix, names, called = FILES[kind]
    path = tmp_path / f"record{suffix}"
    write(path)
    # The content tells the format, not the name.
    for place in (path, path.with_suffix(".csv")):
        path.rename(place)
        record = mh.io.read(place, names[1:], time=names[0])
        for name, expected in zip(names, (T, U, Y), strict=True):
            np.testing.assert_allclose(record[name], expected, rtol=0, atol=1e-12)
        # MATLAB keeps what cells refer to there.
        assert not any(name.startswith("#") for name in record.names)
        assert record.format == called and record.sample_time == pytest.approx(0.5)
        assert mh.io.read(place, names[1:], time=names[0], rows=7).samples == 7
        path = place


def test_units_come_with_the_file(tmp_path: Path) -> None:
    write_hdf5(tmp_path / "a.h5")
    write_tdms(tmp_path / "a.tdms")
    (tmp_path / "a.lvm").write_text(lvm_text(), encoding="latin-1")
    assert mh.io.read(tmp_path / "a.h5", "group/u").units["group/u"] == "kV"
    assert mh.io.read(tmp_path / "a.h5", "group/y").units["group/y"] == "nm"
    found = mh.io.read(tmp_path / "a.tdms")
    assert found.units == {"time_s": "s", "Rig/Drive": "V", "Rig/Gauge": "um"}
    found = mh.io.read(tmp_path / "a.lvm")
    assert found.units == {"time_s": "s", "Drive": "V", "Gauge": "um"}


def test_settings_beside_the_record_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "record.npz"
    np.savez(path, time=T, u=U, gains=np.array([1.0, 2.0]))
    assert list(mh.io.read(path).values) == ["time", "u"]
    with pytest.raises(mh.io.ReadError, match="column gains: expected as many rows as in u, 50"):
        mh.io.read(path, ["u", "gains"])


def broken(write: Callable[[Path], None]) -> Callable[[Path], None]:
    def cut(path: Path) -> None:
        write(path)
        content = path.read_bytes()
        path.write_bytes(content[: len(content) // 3])

    return cut


def zipped(path: Path) -> None:
    import zipfile

    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")


REFUSED: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "pickled npy": (lambda p: np.save(p, np.array([{}], dtype=object), allow_pickle=True), ".npy",
                    "pickled Python objects, which could run code"),
    "pickled npz": (lambda p: np.savez(p, u=np.array([{}], dtype=object), allow_pickle=True),
                    ".npz", "pickled Python objects, which could run code"),
    "pickle": (lambda p: p.write_bytes(pickle.dumps({"u": 1})), ".npy", "a pickle, which could"),
    "cut npy": (broken(lambda p: np.save(p, TABLE)), ".npy", "not a whole NumPy file"),
    "cut npz": (broken(write_npz), ".npz", "not a whole NumPy file"),
    "cut mat": (broken(write_mat), ".mat", "not a whole MATLAB file"),
    "cut mat 7.3": (broken(write_mat73), ".mat", "not a whole HDF5 file"),
    "cut hdf5": (broken(write_hdf5), ".h5", "not a whole HDF5 file"),
    "lvm without data": (lambda p: p.write_text("LabVIEW Measurement\nSeparator\tTab\n"), ".lvm",
                         "not a whole LabVIEW measurement file"),
    "workbook": (zipped, ".xlsx", "ZIP archive with xl/workbook.xml.*save the sheet as CSV"),
    "text in npy": (lambda p: np.save(p, np.array(["a", "b"])), ".npy", "no numeric column"),
    "complex": (lambda p: np.save(p, TABLE * 1j), ".npy", "no numeric column"),
    "nan": (lambda p: np.savez(p, u=np.array([1.0, np.nan, 2.0])), ".npz",
            "sample 1, column u: not finite: nan"),
    "huge": (lambda p: np.savez(p, u=np.array([1.0, 2.0, -1e200])), ".npz",
             r"sample 2, column u: larger than 1e\+100: -1e\+200"),
    "time stands": (lambda p: np.savez(p, time=np.array([0.0, 1.0, 1.0])), ".npz",
                    "sample 2, column time: time does not increase: 1 after 1"),
    "unknown": (lambda p: p.write_bytes(bytes(200) + b"\n"), ".xyz",
                r"unknown format '.xyz'; known: .*HDF5 \(.h5, .hdf5\)"),
    "no such content": (lambda p: p.write_bytes(b"\x00\x01" * 99), ".mat",
                        "the name says MATLAB 5 or MATLAB 7.3, the content does not"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_wrong_files_are_refused(tmp_path: Path, kind: str) -> None:
    write, suffix, said = REFUSED[kind]
    path = tmp_path / f"record{suffix}"
    write(path)
    with pytest.raises(mh.io.ReadError, match=said) as caught:
        mh.io.read(path)
    assert str(caught.value).startswith(str(path))


COLUMNS = {"time_s": T, "drive_v": U, "pos_um": Y}
OBJECTS: dict[str, Callable[[], object]] = {
    "dict": lambda: COLUMNS,
    "dict of lists": lambda: {name: column.tolist() for name, column in COLUMNS.items()},
    "structured array": lambda: RECORD,
    "pandas": lambda: pd.DataFrame(COLUMNS),
    "pandas, time as index": lambda: pd.DataFrame(COLUMNS).set_index("time_s"),
    "pandas, nullable": lambda: pd.DataFrame(COLUMNS).convert_dtypes(),
    "polars": lambda: pl.DataFrame(COLUMNS),
    "xarray": lambda: xr.Dataset(
        {"drive_v": ("time_s", U), "pos_um": ("time_s", Y)}, coords={"time_s": T}
    ),
}


@pytest.mark.parametrize("kind", OBJECTS)
def test_objects_with_columns_by_name_are_read(kind: str) -> None:
    record = mh.io.read(OBJECTS[kind]())
    assert set(record.values) == set(COLUMNS) and record.path is None
    assert record.time_column == "time_s"
    for name, expected in COLUMNS.items():
        np.testing.assert_array_equal(record[name], expected)
        assert record[name].dtype == np.float64 and record[name].flags.c_contiguous


def test_dates_and_durations_are_seconds() -> None:
    frame = pd.DataFrame(
        {"time": pd.date_range("2026-01-01", periods=4, freq="5ms"), "u": [1.0] * 4}
    )
    np.testing.assert_allclose(mh.io.read(frame)["time"], [0.0, 0.005, 0.01, 0.015])
    steps = np.array([3, 4, 5], dtype="timedelta64[ms]")
    np.testing.assert_allclose(mh.io.read({"time": steps})["time"], [0.003, 0.004, 0.005])


def test_units_of_xarray_are_kept() -> None:
    data = xr.Dataset({"u": ("t", U, {"units": "volt"})}, coords={"t": ("t", T, {"units": "ms"})})
    record = mh.io.read(data)
    assert record.units == {"t": "ms", "u": "V"} and record.time_column == "t"
    assert record.sample_time == pytest.approx(0.5e-3)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        (17, "source: expected a file name, or an object with columns by name .* got int"),
        (None, "source: expected a file name"),
        ({}, "dict: no numeric column; there are no columns"),
        ({"u": ["a", "b"]}, "dict: no numeric column; the columns are: u"),
        ({"u": [1.0, None]}, "dict, sample 1, column u: not finite"),
        (
            {"u": np.ones((2, 3, 4))},
            "dict, column u: expected one dimension or two, got 3: 2 x 3 x 4",
        ),
        ({"u": []}, "dict: no rows in column u"),
    ],
)
def test_wrong_objects_are_refused(source: object, said: str) -> None:
    with pytest.raises(mh.io.ReadError, match=said):
        mh.io.read(source)


def test_commands_read_every_format(there: Path) -> None:
    record = mh.io.read(there / "record.csv")
    data = {"time_s": record["time_s"], "drive": record["drive_v"], "pos": record["position_um"]}
    scipy.io.savemat(there / "record.mat", {"data": data})
    names = ["--input", "data.drive", "--output", "data/pos", "--time", "data.time_s"]
    result = run("identify", "record.mat", *names, "--operators", "4", "-o", "found.json")
    assert result.exit_code == 0, result.output
    said = [
        "record.mat: no unit in 'data.drive': V is assumed; --input-unit",
        "record.mat: no unit in 'data.pos': um is assumed; --output-unit",
    ]
    assert result.stderr == "".join(f"mpi-hyst: note: {one}\n" for one in said)
    target = mh.io.read(there / "trajectory.csv")
    np.savez(there / "target.npz", time_s=target["time_s"], target_um=target["target_um"])
    assert run("precompensate", "stage.json", "target.npz", "-o", "a.csv").exit_code == 0
    assert run("precompensate", "stage.json", "trajectory.csv", "-o", "b.csv").exit_code == 0
    assert (there / "a.csv").read_bytes() == (there / "b.csv").read_bytes()
    lines = [
        f"{1e3 * t!r};{y!r}".replace(".", ",")
        for t, y in zip(target["time_s"].tolist(), target["target_um"].tolist(), strict=True)
    ]
    text = "\n".join(["Zeit;Soll", "ms;um", *lines])
    (there / "target.txt").write_text(text, encoding="utf-16")
    result = run("simulate", "stage.json", "target.txt", "--limits", "-500,500", "-o", "run.csv")
    assert result.exit_code == 0, result.output
    assert "note: target.txt: time column Zeit is converted from ms to seconds" in result.stderr
    written = (there / "run.csv").read_text("utf-8").splitlines()[0]
    assert written.startswith("time_ms,") and "measured_um" in written


def test_records_in_other_units_are_refused(there: Path) -> None:
    text = (there / "record.csv").read_text("utf-8").replace("drive_v", "drive", 1)
    for name, unit in (("a.csv", "V"), ("b.csv", "kV")):
        lines = text.split("\n")
        (there / name).write_text("\n".join([lines[0], f"s,{unit},um", *lines[1:]]), "utf-8")
    before = names_in(there)
    given = ("--input", "drive", "--output", "position_um", "-o", "out.json")
    result = run("identify", "a.csv", "b.csv", *given)
    assert_refused(result, there, before, "b.csv, column drive: expected V as before, got kV")


READERS = {"mat": "scipy.io", "hdf5": "h5py", "tdms": "nptdms", "lvm": "lvm_read"}


@pytest.mark.parametrize("kind", ["mat", "mat 7.3", "hdf5", "tdms", "lvm"])
def test_a_missing_reader_is_named_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    write, suffix, _, called = FILES[kind]
    path = tmp_path / f"record{suffix}"
    write(path)
    extra = next(one.extra for one in FORMATS if one.name == called)
    monkeypatch.setitem(sys.modules, READERS[extra], None)
    with pytest.raises(mh.io.ReadError, match=rf"needs .*: pip install 'mpi_hyst\[{extra}\]'"):
        mh.io.read(path)


def test_the_page_of_formats_has_the_table() -> None:
    page = (Path(__file__).parents[1] / "docs" / "formats.md").read_text("utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| ")][1:]
    expected = [
        f"| {one.name} | {', '.join(one.suffixes)} | {one.columns} | "
        f"{f'`mpi_hyst[{one.extra}]`' if one.extra else ''} |"
        for one in FORMATS
    ]
    assert [row for row in rows if row in expected] == expected
    for suffix, _ in PACKED.values():
        assert suffix in page and suffix in known()


def test_the_extras_are_declared() -> None:
    project = (Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8")
    for one in FORMATS:
        assert not one.extra or f"\n{one.extra} = [" in project
