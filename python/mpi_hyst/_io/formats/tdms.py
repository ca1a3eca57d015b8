"""TDMS files of LabVIEW, by npTDMS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mpi_hyst._io.factors import settings_of
from mpi_hyst._io.record import Assumption
from mpi_hyst._io.source import reader, whole
from mpi_hyst._io.table import Began, Table, of_arrays
from mpi_hyst._quantity import known_unit


def read_tdms(path: Path) -> Table:
    """Open a TDMS file. Columns are `Group/Channel`, and `time_s` where channels have clocks."""
    nptdms = reader(str(path), "nptdms", "tdms")
    with whole(path, "TDMS file"):
        file = nptdms.TdmsFile.read(path)
        channels = [channel for group in file.groups() for channel in group.channels()]
        arrays = {f"{one.group_name}/{one.name}": np.asarray(one[:]) for one in channels}
    named = {f"{one.group_name}/{one.name}": one for one in channels}
    units = {name: unit for name, one in named.items() if (unit := _unit(one))}
    clocks = _clocks({name: one for name, one in named.items() if len(one)})
    without = [name for name, one in named.items() if len(one) and name not in clocks]
    said: list[Assumption] = []
    if clocks and without:
        what = f"{', '.join(without)}: no clock in the file"
        said.append(Assumption("table", what))
    started = {name for name in clocks if named[name].properties.get("wf_start_time") is not None}
    unknown = [name for name in clocks if name not in started]
    if started and unknown:
        what = f"{', '.join(unknown)}: no start time in the file, unlike {', '.join(started)}"
        said.append(
            Assumption("table", f"{what}: taken to begin with the first of them", "doubtful")
        )
    settings = settings_of(file.properties)
    settings += [one for group in file.groups() for one in settings_of(group.properties)]
    settings += [s for name, one in named.items() for s in settings_of(one.properties, name)]
    return of_arrays(
        *(str(path), path, "TDMS", arrays, units),
        clocks=clocks,
        assumed=said,
        settings=settings,
    )


def _clocks(channels: dict[str, Any]) -> dict[str, Began]:
    """Return the clocks of waveforms, in seconds after the first of them began."""
    properties = {name: one.properties for name, one in channels.items()}
    clocked = {name: one for name, one in properties.items() if one.get("wf_increment")}
    starts = {name: one.get("wf_start_time") for name, one in clocked.items()}
    known = [np.datetime64(start, "ns") for start in starts.values() if start is not None]
    first = min(known, default=None)
    found = {}
    for name, one in clocked.items():
        start = starts[name]
        late = 0.0
        if start is not None and first is not None:
            late = float((np.datetime64(start, "ns") - first) / np.timedelta64(1, "ns")) * 1e-9
        offset = float(one.get("wf_start_offset", 0.0))
        found[name] = Began(late + offset, float(one["wf_increment"]))
    return found


def _unit(channel: Any) -> str:
    """Return the unit of a channel: as LabVIEW writes it, else as other programs do."""
    told = {name.lower(): value for name, value in channel.properties.items()}
    text = str(next(filter(None, map(told.get, _UNITS)), ""))
    return known_unit(text) or text


_UNITS = ("unit_string", "ni_unitdescription", "unit", "units", "unit_description", "y_unit")
