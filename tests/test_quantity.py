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
    ],
)
def test_units_come_from_the_names_of_columns(column: str, label: str) -> None:
    assert Quantity(column).label == label
