"""Records as columns of pandas, polars and xarray, and drives back into them.

`mh.io.read` takes the table as it is. Names tell the units, as in `drive_v` and `time_ms`.
"""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pandas as pd
import polars as pl
import xarray as xr


def identify(table: Any, drive: str, position: str) -> mh.results.Identification:
    """Fit the hysteresis to two columns of a table that has a column of time, too."""
    record = mh.io.read(table, [drive, position])
    return mh.identify(
        record[drive],
        record[position],
        dt=record.sample_time,
        operators=6,
        dynamics=None,
        creep=None,
        loop_shift=None,
    )


def with_drives(table: Any, target: str, stage: mh.Stage) -> Any:
    """Return the table with a column `drive_v` for the target positions in one of its columns."""
    wanted = mh.io.read(table, [target])
    assert wanted.sample_time is not None
    drive = stage.precompensate(wanted[target], wanted.sample_time)
    if isinstance(table, pl.DataFrame):
        return table.with_columns(pl.Series("drive_v", drive))
    if isinstance(table, xr.Dataset):
        return table.assign(drive_v=(table[target].dims, drive))
    return table.assign(drive_v=drive)


def record() -> dict[str, Any]:
    """Return a simulated record: yours comes from a file or a database."""
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=100)
    y = mh.paper.table_1_recovered().forward().run(u)
    return {"time_s": np.arange(u.size) / 100.0, "drive_v": u, "position_um": y}


if __name__ == "__main__":
    for table in (pd.DataFrame(record()), pl.DataFrame(record())):
        print(type(table), identify(table, "drive_v", "position_um").fit.rmse)
    columns = {name: ("time_s", values) for name, values in record().items()}
    data = xr.Dataset(columns)
    stage = identify(data, "drive_v", "position_um").stage
    print(with_drives(data, "position_um", stage.replace(limits=(-500.0, 500.0))))
