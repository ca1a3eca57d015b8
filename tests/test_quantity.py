"""Names of columns, as they say a quantity and its unit."""

from __future__ import annotations

import pytest
from mpi_hyst._quantity import Quantity


@pytest.mark.parametrize(
    ("column", "label"),
    [
        ("displacement_um", "displacement (µm)"),
        ("stage_x_NM", "stage x (nm)"),
        ("voltage_v", "voltage (V)"),
        ("drive", "drive"),
        ("gauge_raw", "gauge_raw"),
        ("_v", "_v"),
        ("I/mA", "I (mA)"),
        ("U_piezo/V", "U piezo (V)"),
        ("Weg/µm", "Weg (µm)"),
        ("Zeit/s", "Zeit (s)"),
        ("scope/A", "scope/A"),
        ("statistics/min", "statistics/min"),
        ("T [degC]", "T (°C)"),
        ("T (°C)", "T (°C)"),
        ("T/°C", "T (°C)"),
        ("temp_degC", "temp (°C)"),
        ("p [bar]", "p (bar)"),
        ("H_A/m", "H (A/m)"),
        ("E [MV/m]", "E (MV/m)"),
        ("U [MV]", "U (MV)"),
        ("U (MV)", "U (MV)"),
        ("I/MA", "I (MA)"),
        ("U [mV]", "U (mV)"),
        ("DRIVE_MV", "DRIVE (mV)"),
        ("E [kV/mm]", "E (kV/mm)"),
        ("E [mV/m]", "E (mV/m)"),
        ("Pos[Å]", "Pos (Å)"),
        ("pos_arcsec", "pos (arcsec)"),
        ("d [%]", "d (%)"),
        ("stroke / V/µm", "stroke (V/µm)"),
        ("x (1/s)", "x (1/s)"),
        ("x [turns of the screw]", "x (turns of the screw)"),
        ("x_bar", "x_bar"),
        ("ai[0]", "ai[0]"),
        ("x [-]", "x [-]"),
        ("pos (raw)", "pos (raw)"),
        ("pos (ch1)", "pos (ch1)"),
        ("encoder/counts", "encoder/counts"),
    ],
)
def test_units_come_from_the_names_of_columns(column: str, label: str) -> None:
    assert Quantity(column).label == label


@pytest.mark.parametrize("name", ["Time [UTC]", "Time [samples]", "t (K)"])
def test_no_time_has_another_unit(name: str) -> None:
    assert not Quantity(name).is_time and not Quantity(name).time_unit


def test_what_a_file_states_goes_before_the_name() -> None:
    assert Quantity("x_um", "steps").suffix == "steps"
    assert Quantity("x_um", "-").suffix == "um"
    assert Quantity("U", "MV").suffix == "MV"
    assert Quantity("Time", "HH:MM:SS").is_time
