"""HDF5 files, by h5py; MATLAB files of version 7.3 are such files too."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.columns import ReadError
from mpi_hyst._io.table import ArrayTable, Table, reader, whole
from mpi_hyst._quantity import known_unit

_UNIT_ATTRIBUTES = ("units", "unit", "Units", "Unit", "UNITS", "UNIT")
_MATLAB_OWN = "#refs#"
_DEEPEST = 8  # cells in cells; a file may point at itself


def read_hdf5(path: Path) -> Table:
    """Open an HDF5 file. Columns are `group/dataset`, with `:0` and so on of two dimensions."""
    return _read(path, "HDF5", "/")


def read_mat73(path: Path) -> Table:
    """Open a MATLAB file of version 7.3. Columns are named as in one of version 5."""
    return _read(path, "MATLAB 7.3", ".")


def _read(path: Path, format_name: str, separator: str) -> Table:
    h5py = reader(str(path), "h5py", "hdf5")
    columns: dict[str, Callable[[], npt.NDArray[Any]]] = {}
    sizes: dict[str, int] = {}
    units: dict[str, str] = {}

    def visit(place: str, item: Any) -> None:
        """Add the columns of a dataset. External links are not followed."""
        if not isinstance(item, h5py.Dataset) or place.startswith(_MATLAB_OWN) or not item.shape:
            return
        add(place.replace("/", separator), item)

    def add(name: str, item: Any, depth: int = 0) -> None:
        if h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            # Cells of MATLAB, and fields of its structures in an array.
            for index, one in enumerate(np.asarray(item[()]).reshape(-1)):
                cell = item.file[one] if one else None
                if isinstance(cell, h5py.Dataset) and cell.shape and depth < _DEEPEST:
                    add(f"{name}{separator}{index}", cell, depth + 1)
            return
        for column, part, size in _parts(name, item):
            columns[column] = partial(_load, path, item.name, part)
            sizes[column] = size
            if unit := _unit(item):
                units[column] = unit

    with whole(path, "HDF5 file"), h5py.File(path, "r") as file:
        file.visititems(visit)
    return ArrayTable(str(path), path, format_name, columns, sizes, units)


def _parts(name: str, item: Any) -> list[tuple[str, Any, int]]:
    """Return the columns of a dataset: name, how to take it, and number of rows."""
    if item.dtype.names is not None and len(item.shape) == 1:
        fields = item.dtype.names
        return [(f"{name}/{one}", one, item.shape[0]) for one in fields if _is_numeric(item[one])]
    if not _is_numeric(item) or len(item.shape) > 2:
        return []
    if len(item.shape) == 1 or 1 in item.shape:
        return [(name, None, int(np.prod(item.shape)))]
    # A record has more samples than columns, so the columns run along the longer side.
    along = 0 if item.shape[0] >= item.shape[1] else 1
    count, rows = item.shape[1 - along], item.shape[along]
    places = [
        (slice(None), number) if along == 0 else (number, slice(None)) for number in range(count)
    ]
    return [(f"{name}:{number}", place, rows) for number, place in enumerate(places)]


def _is_numeric(item: Any) -> bool:
    return item.dtype.kind in "fiub"


def _load(path: Path, place: str, part: Any) -> npt.NDArray[Any]:
    h5py = reader(str(path), "h5py", "hdf5")
    try:
        with h5py.File(path, "r") as file:
            return np.asarray(file[place][() if part is None else part]).reshape(-1)
    except Exception as error:  # h5py raises what it happens to meet in a broken file
        raise ReadError(f"{path}, column {place}: cannot be read: {error}") from error


def _unit(item: Any) -> str:
    for name in _UNIT_ATTRIBUTES:
        value = item.attrs.get(name)
        # Some writers make an array of one text.
        value = value.flat[0] if isinstance(value, np.ndarray) and value.size == 1 else value
        text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
        if isinstance(text, str) and text:
            return known_unit(text) or text
    return ""
