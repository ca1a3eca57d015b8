"""TDMS files of LabVIEW, by npTDMS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mpi_hyst._io.table import Table, of_arrays, reader, whole
from mpi_hyst._quantity import known_unit


def read_tdms(path: Path) -> Table:
    """Open a TDMS file. Columns are `Group/Channel`, and `time_s` if all have the same clock."""
    nptdms = reader(str(path), "nptdms", "tdms")
    with whole(path, "TDMS file"):
        file = nptdms.TdmsFile.read(path)
        channels = [channel for group in file.groups() for channel in group.channels()]
        arrays = {f"{one.group_name}/{one.name}": np.asarray(one[:]) for one in channels}
    units = {f"{one.group_name}/{one.name}": _unit(one) for one in channels}
    clocks = {_clock(one) for one in channels if len(one)}
    clock = clocks.pop() if len(clocks) == 1 else None
    if clock is not None and "time_s" not in arrays:
        start, step, samples = clock
        arrays = {"time_s": start + step * np.arange(samples), **arrays}
    given = {name: unit for name, unit in units.items() if unit}
    return of_arrays(str(path), path, "TDMS", arrays, given)


def _clock(channel: Any) -> tuple[float, float, int] | None:
    """Return start, step and number of samples of a waveform; None of other channels."""
    step = channel.properties.get("wf_increment")
    if not step:
        return None
    return float(channel.properties.get("wf_start_offset", 0.0)), float(step), len(channel)


def _unit(channel: Any) -> str:
    text = str(
        channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription", "")
    )
    return known_unit(text) or text
