"""Channels, names and units that stand elsewhere than in a header above their columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import mpi_hyst as mh
import numpy as np
import pandas as pd
import pytest
import scipy.io
import xarray as xr
from nptdms import ChannelObject, TdmsWriter

from odd_files.test_instruments import T, U, Y, comma, rows

N = T.size
NM = 1e3 * Y


def doubts(record: mh.io.Columns) -> list[str]:
    return [one.text for one in record.assumed if one.level == "doubtful"]


def written(place: Path, text: str, name: str = "record.csv") -> mh.io.Columns:
    (place / name).write_text(text, encoding="utf-8")
    return mh.io.read(place / name)


@pytest.mark.parametrize("comment", ["\tComment", ""])
def test_no_channel_is_lost_where_the_header_has_no_tabs_at_its_ends(
    comment: str, tmp_path: Path
) -> None:
    head = (
        "LabVIEW Measurement\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "X_Columns\tMulti\n***End_of_Header***\n\nChannels\t3\n"
        "Samples\t136\t\t136\t\t136\nY_Unit_Label\tVolts\t\tVolts\t\tnm\n"
        "X_Dimension\tTime\t\tTime\t\tTime\n***End_of_Header***\n"
        f"X_Value\tHV\tX_Value\tMonitor\tX_Value\tGauge{comment}\n"
    )
    body = rows(T, U, T, U / 10, T, NM, separator="\t")
    record = written(tmp_path, head + body, "record.lvm")
    assert record.units == {"time_s": "s", "HV": "V", "Monitor": "V", "Gauge": "nm"}
    np.testing.assert_allclose(record["Gauge"], NM, rtol=1e-5)


def test_texts_beside_arrays_of_matlab_are_told(tmp_path: Path) -> None:
    path = tmp_path / "record.mat"
    units = np.array(["s", "V", "nm"], dtype=object)
    scipy.io.savemat(path, {"run": {"t": T, "u": U, "y": NM, "units": units}})
    assert "run.units holds 's', 'V', 'nm', and no unit is taken" in doubts(mh.io.read(path))[0]
    matrix = np.column_stack([T, U, NM])
    scipy.io.savemat(path, {"rec": matrix, "units": units})
    assert mh.io.read(path).units == {"rec:0": "s", "rec:1": "V", "rec:2": "nm"}


def test_names_beside_a_matrix_tell_its_units(tmp_path: Path) -> None:
    matrix = np.column_stack([T, U, NM])
    names = ["time_s", "drive (V)", "gauge_nm"]
    np.savez(tmp_path / "a.npz", rec=matrix, names=np.array(names))
    scipy.io.savemat(tmp_path / "a.mat", {"rec": matrix, "rec_names": np.array(names, object)})
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("rec", data=matrix).attrs["columns"] = names
    for name in ("a.npz", "a.mat", "a.h5"):
        record = mh.io.read(tmp_path / name)
        assert record.units == {"rec:0": "s", "rec:1": "V", "rec:2": "nm"}, name
        assert any("rec:2 is gauge_nm" in one.text for one in record.assumed), name
        assert not doubts(record), name


def test_names_of_other_columns_are_told(tmp_path: Path) -> None:
    labels = np.array(["drive_v", "gauge_nm"])
    np.savez(tmp_path / "a.npz", t=T, u=U, y=NM, labels=labels)
    assert "labels holds 'V', 'nm'" in doubts(mh.io.read(tmp_path / "a.npz"))[0]


def test_names_and_units_that_columns_have_are_no_doubt(tmp_path: Path) -> None:
    record: dict[str, Any] = {"time_s": T, "drive_v": U, "gauge_nm": NM}
    names, units = np.array(list(record)), np.array(["s", "V", "nm"])
    for beside in ({"names": names}, {"units": units}):
        np.savez(tmp_path / "a.npz", **{**record, **beside})
        assert not doubts(mh.io.read(tmp_path / "a.npz"))
    np.savez(tmp_path / "a.npz", t=T, drive_v=U, gauge_nm=NM, units=units)
    assert not doubts(mh.io.read(tmp_path / "a.npz"))
    np.savez(tmp_path / "a.npz", **{**record, "units": np.array(["s", "V", "um"])})
    assert "units holds 's', 'V', 'um'" in doubts(mh.io.read(tmp_path / "a.npz"))[0]
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, column in record.items():
            told = file.create_dataset(name.partition("_")[0], data=column)
            told.attrs["units"] = name.partition("_")[2]
        file.attrs["columns"] = list(record)
    assert not doubts(mh.io.read(tmp_path / "a.h5"))


def test_an_attribute_of_a_group_tells_the_unit_of_a_dataset(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["drive"], file["gauge"] = U, NM
        file.attrs["gauge_unit"] = "nm"
        file.attrs["operator"] = "V"
    record = mh.io.read(path)
    assert record.units == {"gauge": "nm"} and not doubts(record)


def test_units_in_the_attributes_of_a_frame_are_used_or_told() -> None:
    frame = pd.DataFrame({"t": T, "u": U, "y": NM})
    frame.attrs = {"units": {"u": "V", "y": "nanometers"}}
    assert mh.io.read(frame).units == {"u": "V", "y": "nm"}
    frame.attrs = {"unit": "nm"}
    record = mh.io.read(frame)
    assert not record.units
    assert "attribute of the DataFrame holds 'nm', and no unit is taken" in doubts(record)[0]


def test_a_unit_of_a_dataset_takes_none_from_its_columns() -> None:
    columns = {"u": ("time", U, {"units": "V"}), "y": ("time", NM, {"units": "nm"})}
    record = mh.io.read(xr.Dataset(columns, {"time": ("time", T)}, {"units": "mixed"}))
    assert record.units == {"u": "V", "y": "nm"}


@pytest.mark.parametrize("name", ["unit_string", "NI_UnitDescription", "unit", "Units"])
def test_a_unit_of_a_channel_has_several_names(name: str, tmp_path: Path) -> None:
    path = tmp_path / "record.tdms"
    with TdmsWriter(str(path)) as file:
        file.write_segment([ChannelObject("R", "Gauge", NM, {name: "nm"})])
    assert mh.io.read(path).units == {"R/Gauge": "nm"}


def test_a_row_without_units_hides_none(tmp_path: Path) -> None:
    text = "Time [ms],Drive [V],Gauge\n[-],[-],[nm]\n" + rows(1e3 * T, U, NM)
    assert written(tmp_path, text).units == {"Time [ms]": "ms", "Drive [V]": "V", "Gauge": "nm"}


def stamps(late: float = 0.0) -> list[str]:
    return ["22.11.2026 10:00:" + comma(f"{t + late:06.3f}") for t in T]


def waveforms(late: float, header: str, each: bool) -> str:
    body = comma(rows(U, Y, separator="\t")).splitlines()
    lines = []
    for first, second, line in zip(stamps(), stamps(late), body, strict=True):
        drive, gauge = line.split("\t")
        lines.append("\t".join([first, drive, second, gauge] if each else [first, drive, gauge]))
    above = f"waveform\t[0]\t[1]\nt0\t{stamps()[0]}\t{stamps(late)[0]}\n"
    return f"{above}delta t\t0,010000\t0,010000\n\n{header}\n" + "\n".join(lines) + "\n"


def test_starts_of_waveforms_that_are_apart_are_told(tmp_path: Path) -> None:
    record = written(tmp_path, waveforms(0.05, "time\tY[0]\tY[1]", each=False))
    assert "channels begin 50.00 ms apart" in doubts(record)[0]
    assert not doubts(written(tmp_path, waveforms(0.0, "time\tY[0]\tY[1]", each=False)))


def test_stamps_of_two_columns_that_are_apart_are_told(tmp_path: Path) -> None:
    for late, apart in ((0.05, "50.00 ms behind"), (-0.02, "20.00 ms before"), (0.0, "")):
        table = zip(stamps(0.1), U, stamps(0.1 + late), Y, strict=True)
        lines = [
            f"{one};{comma(f'{drive:g}')};{other};{comma(f'{gauge:g}')}"
            for one, drive, other, gauge in table
        ]
        text = "Time A;Drive (V);Time B;Gauge (um)\n" + "\n".join(lines) + "\n"
        (tmp_path / "record.csv").write_text(text, encoding="utf-8")
        found = doubts(mh.io.read(tmp_path / "record.csv", ["Drive (V)", "Gauge (um)"], time=0))
        assert any(f"Time B begins {apart} Time A" in one for one in found) == bool(apart), found


HEAD = "Source,CH1\nVertical Units,V\nHorizontal Units,s\n"


@pytest.mark.parametrize(
    "text",
    [
        f"{HEAD}TIME,CH1\n{rows(T, U)}",
        f"Vertical Units,V\nTIME (s),CH1\n{rows(T, U)}",
        f"Vertical Units,V,V\nSource,C1,C2\nTime,C1,C2\n{rows(T, U, Y)}",
    ],
)
def test_a_setting_that_is_used_is_no_second_header(text: str, tmp_path: Path) -> None:
    record = written(tmp_path, text)
    assert not doubts(record)
    assert record.quantity(record.names[1]).suffix == "V"


def test_a_column_of_remarks_that_comes_first_has_a_name(tmp_path: Path) -> None:
    body = rows(T, U, NM).splitlines()
    lines = [("bump," if k == 80 else ",") + line for k, line in enumerate(body)]
    record = written(tmp_path, "Note,time_s,drive_v,gauge_nm\n" + "\n".join(lines) + "\n")
    assert record.units == {"time_s": "s", "drive_v": "V", "gauge_nm": "nm"}


def test_a_late_table_of_more_columns_is_told(tmp_path: Path) -> None:
    above = "".join(f"{k},{k / 7:.3f}\n" for k in range(600))
    with pytest.raises(mh.io.ReadError, match=r"line 601: .*--skip-lines 600"):
        written(tmp_path, f"{above}Time (s),Drive (V),Gauge (nm)\n{rows(T, U, NM)}")
