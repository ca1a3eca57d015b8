"""HDF5 files, by h5py; MATLAB files of version 7.3 and netCDF files are such files too."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.factors import Setting, settings_of
from mpi_hyst._io.record import Assumption, ReadError
from mpi_hyst._io.source import reader, whole
from mpi_hyst._io.table import (
    ArrayTable,
    Table,
    texts_of,
    too_many_axes,
    units_not_taken,
    units_of,
)
from mpi_hyst._quantity import known_unit

_UNIT_ATTRIBUTES = ("units", "unit", "Units", "Unit", "UNITS", "UNIT")
_MATLAB_OWN = "#refs#"
_FEW_TEXTS = 100
_DEEPEST = 8  # cells in cells; a file may point at itself


def read_hdf5(path: Path) -> Table:
    """Open an HDF5 file. Columns are `group/dataset`, with `:0` and so on of two dimensions."""
    return read_as(path, "HDF5", "/")


def read_as(path: Path, format_name: str, separator: str) -> Table:
    """Open an HDF5 file under the name of a format; `separator` is what parts places in it."""
    h5py = reader(str(path), "h5py", "hdf5")
    columns: dict[str, Callable[[], npt.NDArray[Any]]] = {}
    sizes: dict[str, int] = {}
    units: dict[str, str] = {}
    other: dict[str, str] = {}
    said: list[Assumption] = []
    texts: dict[str, list[str]] = {}
    shapes: dict[str, tuple[int, ...]] = {}
    settings: list[Setting] = []
    beside: dict[str, list[str]] = {}

    def visit(place: str, item: Any) -> None:
        """Add the columns of a dataset. External links are not followed."""
        if place.startswith(_MATLAB_OWN):
            return
        name = place.replace("/", separator)
        settings.extend(settings_of(item.attrs, name if isinstance(item, h5py.Dataset) else ""))
        beside.update(_texts(item, f"{name}{separator}" if name else ""))
        if not isinstance(item, h5py.Dataset):
            if told := _units(item):
                said.append(units_not_taken(f"attribute of group {name or '/'}", told))
            return
        if h5py.check_string_dtype(item.dtype) is not None:
            if item.size is not None and 0 < item.size <= _FEW_TEXTS:
                texts[name] = texts_of(np.asarray(item[()]).reshape(-1)) or []
            return
        if item.shape:
            add(name, item)
        if item.size is not None and item.size <= _FEW_TEXTS:
            settings.append(Setting(name, item[()]))

    def add(name: str, item: Any, depth: int = 0) -> None:
        if h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            # Cells of MATLAB, and fields of its structures in an array.
            for index, one in enumerate(np.asarray(item[()]).reshape(-1)):
                cell = item.file[one] if one else None
                if isinstance(cell, h5py.Dataset) and cell.shape and depth < _DEEPEST:
                    add(f"{name}{separator}{index}", cell, depth + 1)
            return
        if _is_numeric(item) and sum(length != 1 for length in item.shape) > 2:
            other[name] = too_many_axes(item.shape, item.dtype)
        changed = [one for one in _PACKING if one in item.attrs]
        if changed:
            said.append(Assumption("table", f"{name}: {', '.join(changed)} of the file applied"))
        shapes[name] = item.shape
        parts = _parts(name, item)
        for column, part, size in parts:
            columns[column] = partial(_load, path, item.name, part)
            sizes[column] = size
        told = _units(item)
        if len(told) == 1 or len(told) == len(parts):
            every = told if len(told) > 1 else told * len(parts)
            units.update({part[0]: one for part, one in zip(parts, every, strict=True) if one})
        elif told:
            said.append(units_not_taken(f"attribute of {name}", told))

    with whole(path, "HDF5 file"), h5py.File(path, "r") as file:
        visit("", file)
        file.visititems(visit)
    told, more = units_of({**beside, **texts}, columns, shapes, units)
    units = {**told, **units}
    said += more
    return ArrayTable(
        *(str(path), path, format_name, columns, sizes, units),
        other=other,
        assumed=said,
        settings=[*settings, *(Setting(name, cells) for name, cells in texts.items())],
    )


def _parts(name: str, item: Any) -> list[tuple[str, Any, int]]:
    """Return the columns of a dataset: name, how to take it, and number of rows."""
    if item.dtype.names is not None and len(item.shape) == 1:
        fields = item.dtype.names
        return [(f"{name}/{one}", one, item.shape[0]) for one in fields if _is_numeric(item[one])]
    long = [axis for axis, length in enumerate(item.shape) if length != 1]
    if not _is_numeric(item) or len(long) > 2:
        return []
    if len(long) < 2:
        return [(name, None, int(np.prod(item.shape)))]
    # A record has more samples than columns, so the columns run along the longer side.
    along, across = long if item.shape[long[0]] >= item.shape[long[1]] else reversed(long)
    parts = []
    for number in range(item.shape[across]):
        place: list[Any] = [0] * len(item.shape)
        place[along], place[across] = slice(None), number
        parts.append((f"{name}:{number}", tuple(place), item.shape[along]))
    return parts


def _is_numeric(item: Any) -> bool:
    return item.dtype.kind in "fiub"


def _load(path: Path, place: str, part: Any) -> npt.NDArray[Any]:
    h5py = reader(str(path), "h5py", "hdf5")
    try:
        with h5py.File(path, "r") as file:
            item = file[place]
            column = np.asarray(item[() if part is None else part]).reshape(-1)
            return (
                _unpacked(column, item.attrs) if isinstance(part, (tuple, type(None))) else column
            )
    except Exception as error:  # h5py raises what it happens to meet in a broken file
        raise ReadError(f"{path}, column {place}: cannot be read: {error}") from error


# What netCDF writes beside numbers: those that stand for none, and how others are packed.
_PACKING = ("_FillValue", "missing_value", "scale_factor", "add_offset")


def _unpacked(column: npt.NDArray[Any], attributes: Any) -> npt.NDArray[Any]:
    found = {one: attributes[one] for one in _PACKING if one in attributes}
    if not found:
        return column
    values = column.astype(np.float64)
    for one in ("_FillValue", "missing_value"):
        if one in found:
            values[np.isin(column, np.asarray(found[one]))] = np.nan
    scale, offset = (np.ravel(found.get(one, default))[0] for one, default in _DEFAULTS)
    return np.asarray(values * scale + offset)


_DEFAULTS = (("scale_factor", 1.0), ("add_offset", 0.0))


def _texts(item: Any, prefix: str) -> dict[str, list[str]]:
    """Return the texts in the attributes of a dataset or a group, by their places."""
    found = {}
    for name, value in item.attrs.items():
        array = np.asarray(value, dtype=object if isinstance(value, str) else None)
        texts = texts_of(array.reshape(-1)) if name not in _UNIT_ATTRIBUTES else None
        if texts:
            found[f"{prefix}{name}"] = texts
    return found


def _units(item: Any) -> list[str]:
    """Return what the attributes of a dataset or a group say of units: one, or one for a column."""
    for name in _UNIT_ATTRIBUTES:
        value = item.attrs.get(name)
        if value is None:
            continue
        texts = texts_of(np.asarray(value, dtype=object if isinstance(value, str) else None))
        if texts and any(texts):
            return [known_unit(text) or text for text in texts]
    return []
