"""The measured records that come with the package: figures, notice and provenance."""

from __future__ import annotations

import gzip
import hashlib
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest

SHARED = Path(__file__).parents[2] / "shared" / "data" / "piezo_stack"
FIGURES = {
    "major_loops": (8027, "7794df4885b6be65704e7a470cb72166d19158424a81c8447967218d73757c7c"),
    "decaying_loops": (4200, "5e98b552fb1c9fc5d719e3200f96af9fdf9ae437167dbf8e25fef4da4e6da43e"),
}
FOLDER = files("mpi_hyst._datasets").joinpath("piezo_stack")


@pytest.fixture(params=FIGURES)
def record(request: pytest.FixtureRequest) -> mh.datasets.Record:
    return mh.datasets.piezo_stack(request.param)


def test_the_figures_are_those_of_the_authors(record: mh.datasets.Record) -> None:
    rows, digest = FIGURES[record.name]
    text = gzip.decompress(FOLDER.joinpath(f"{record.name}.csv.gz").read_bytes())
    assert hashlib.sha256(text).hexdigest() == digest
    # Read by another reader, as numbers, every bit.
    table = np.loadtxt(text.decode().splitlines(), delimiter=",", skiprows=1)
    assert table.shape == (rows, 3) and text.startswith(b"time_s,voltage_v,displacement_um\n")
    np.testing.assert_array_equal(table, np.column_stack([record.time, record.u, record.y]))
    assert record.dt == 0.005 and record.units == ("V", "um") and record.skip * record.dt == 2.0


def test_nothing_but_these_figures_and_their_notice_is_there() -> None:
    held = {entry.name for entry in FOLDER.iterdir()}
    assert held == {"LICENSE", *(f"{name}.csv.gz" for name in FIGURES)}


@pytest.mark.skipif(not SHARED.exists(), reason="the records are not beside this checkout")
@pytest.mark.parametrize("name", FIGURES)
def test_they_are_the_records_beside_the_checkout(name: str) -> None:
    ours = gzip.decompress(FOLDER.joinpath(f"{name}.csv.gz").read_bytes())
    assert ours == (SHARED / f"{name}.csv").read_bytes()
    assert FOLDER.joinpath("LICENSE").read_bytes() == (SHARED / "LICENSE").read_bytes()


def test_notice_and_provenance_come_with_a_record(record: mh.datasets.Record) -> None:
    assert "Copyright (c) 2019 Yan Naing Aye" in record.licence
    assert "shall be included in all" in record.licence
    assert "yan9a/DiscreteBacklashOperator at commit 79fd060d86cd" in record.source
    assert record.name in (mh.datasets.piezo_stack.__doc__ or "")


def test_a_record_is_what_reading_and_identification_take(record: mh.datasets.Record) -> None:
    columns = mh.io.read(record.columns)
    assert columns.time_column == "time_s" and columns.sample_time == record.dt
    assert columns.samples == record.u.size
    found = mh.identify(
        [(record.u, record.y)],
        dt=[record.dt],
        skip=[record.skip],
        operators=4,
        weights="quadratic",
        dynamics=None,
        creep=None,
        loop_shift=None,
        input_map=None,
        output_map=None,
    )
    # The loops are 13 % of the range wide; four operators leave a tenth of that.
    assert found.fit.rmse < 0.013 * found.fit.range
    assert found.fit.samples == record.u.size - record.skip


def test_every_call_reads_anew() -> None:
    first, second = (mh.datasets.piezo_stack("decaying_loops") for _ in range(2))
    first.u[0] = 99.0
    assert second.u[0] == 1.83


def test_importing_reads_no_record() -> None:
    code = (
        "import sys; opened = []\n"
        "sys.addaudithook(lambda name, what: name == 'open' and opened.append(str(what[0])))\n"
        "import mpi_hyst as mh\n"
        "assert opened and not [one for one in opened if one.endswith('.csv.gz')]\n"
        "mh.datasets.piezo_stack('decaying_loops')\n"
        "assert [one for one in opened if one.endswith('.csv.gz')]\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_unknown_record_is_refused() -> None:
    with pytest.raises(
        ValueError, match="name: expected 'major_loops' or 'decaying_loops', got 'x'"
    ):
        mh.datasets.piezo_stack("x")  # type: ignore[arg-type]
