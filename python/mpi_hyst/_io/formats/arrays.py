"""Arrays: files of numpy, and objects in memory with columns by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.factors import settings_of
from mpi_hyst._io.record import Assumption, ReadError
from mpi_hyst._io.source import whole
from mpi_hyst._io.table import Table, axes, of_arrays, too_many_axes, units_not_taken
from mpi_hyst._quantity import known_unit


def read_npy(path: Path) -> Table:
    """Open a .npy file. The columns are `0`, `1` and so on, or the fields."""
    with path.open("rb") as file, _refusing(path):
        array = np.load(file, allow_pickle=False)
    return of_arrays(str(path), path, "NumPy array", {"": array})


def read_npz(path: Path) -> Table:
    """Open an .npz file. Columns are `name`, or `name:0` and so on of a two-dimensional array."""
    # Given a name, numpy leaves a broken file open.
    with path.open("rb") as file, _refusing(path), np.load(file, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    for name, array in arrays.items():
        if not isinstance(array, np.ndarray):
            raise ReadError(
                f"{path}: a ZIP archive with {name}, expected NumPy arrays; of a workbook, save "
                "the sheet as CSV"
            )
    return of_arrays(str(path), path, "NumPy archive", arrays)


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    """Turn what numpy raises for a wrong content into an error that names the file."""
    with whole(path, "NumPy file"):
        try:
            yield
        except ValueError as error:
            if "pickle" not in str(error):
                raise
            raise ReadError(
                f"{path}: holds pickled Python objects, which could run code when read; expected "
                "arrays of numbers"
            ) from error


def read_object(source: Any) -> Table:
    """Take the columns of an object. Nothing is imported to know what it is."""
    kind = type(source).__name__
    if isinstance(source, np.ndarray):
        return of_arrays(kind, None, kind, {"": source})
    names = _names(source)
    arrays: dict[str, npt.NDArray[Any]] = {}
    units: dict[str, str] = {}
    said: list[Assumption] = []
    attributes = _attributes(source)
    settings = settings_of(attributes)
    # Those of a DataFrame are those of its columns, too.
    of_source = {key: repr(value) for key, value in attributes.items()}
    of_all, not_taken = _units_of_all(source)
    said += [units_not_taken(f"attribute of the {kind}", not_taken)] if not_taken else []
    index = _index(source)
    if index is not None and (index[0] not in names):
        arrays[index[0]] = index[1]
        said.append(Assumption("table", f"the index is column {index[0]}"))
    for name in names:
        column = source[name]
        try:
            array = _array(column)
        except (TypeError, ValueError) as error:
            raise ReadError(f"{kind}, column {name}: expected an array: {error}") from error
        if axes(array) > 2:
            what = too_many_axes(array.shape, array.dtype)
            raise ReadError(
                f"{kind}, column {name}: expected one dimension or two, got {array.ndim}: {what}"
            )
        arrays[str(name)] = array
        own = {k: v for k, v in _attributes(column).items() if of_source.get(k) != repr(v)}
        settings += settings_of(own, str(name))
        # Of dates a unit is how fine they are.
        unit = of_all.get(name) or of_all.get(str(name)) or _unit(column, own)
        if array.dtype.kind in "fiub" and unit:
            units[str(name)] = unit
    return of_arrays(kind, None, kind, arrays, units, assumed=said, settings=settings)


def _attributes(source: Any) -> Mapping[str, Any]:
    """Return the attributes that a DataFrame, a Dataset or one of its columns has."""
    told = getattr(source, "attrs", None)
    return told if isinstance(told, Mapping) else {}


def _index(source: Any) -> tuple[str, npt.NDArray[Any]] | None:
    """Return name and values of the index of a DataFrame, unless it only counts the rows."""
    index = getattr(source, "index", None)
    if index is None or callable(index) or not hasattr(index, "dtype"):
        return None
    values = _array(index)
    if values.dtype.kind == "O" and not hasattr(next(iter(values), None), "timestamp"):
        return None
    name = getattr(index, "name", None)
    if name is not None:
        return str(name), values
    if values.dtype.kind in "iu" and np.array_equal(values, np.arange(values.size)):
        return None
    return ("time" if values.dtype.kind in "mMO" else "index"), values


def _array(column: Any) -> npt.NDArray[Any]:
    """Return a column as an array; what is masked stays so, and stamps lose their zone."""
    if isinstance(column, np.ma.MaskedArray):
        return column
    if isinstance(column, list | tuple) and any(one is np.ma.masked for one in column):
        return np.ma.array(
            [0.0 if one is np.ma.masked else one for one in column],
            mask=[one is np.ma.masked for one in column],
        )
    if getattr(getattr(column, "dtype", None), "tz", None) is not None:
        return np.asarray(column.to_numpy(dtype="datetime64[ns]"))
    magnitude = getattr(column, "magnitude", None)
    return np.asarray(column if magnitude is None else magnitude)


def _units_of_all(source: Any) -> tuple[dict[Any, str], list[str]]:
    """Return the units that a DataFrame tells of its columns by name, and those without a name."""
    told = next((v for k, v in _attributes(source).items() if str(k).lower() in _UNITS), None)
    if isinstance(told, Mapping):
        return {name: known_unit(str(one)) or str(one) for name, one in told.items() if one}, []
    every = [told] if isinstance(told, str) else told if isinstance(told, list | tuple) else []
    return {}, [known_unit(str(one)) or str(one) for one in every if one]


_UNITS = ("units", "unit")


def _unit(column: Any, own: Mapping[str, Any]) -> str:
    """Return the unit that a column has beside its numbers: in its own attributes, or itself."""
    told = own.get("units", "")
    for name in ("unit", "units"):
        told = told or own.get(name, "") or getattr(column, name, "")
    text = "" if callable(told) else str(told or "")
    return known_unit(text) or text


def _names(source: Any) -> list[Any]:
    """Return the names of the columns; coordinates of a Dataset are columns too."""
    if callable(getattr(source, "keys", None)) and hasattr(source, "__getitem__"):
        names = list(source.keys())
    elif isinstance(getattr(source, "columns", None), list):
        names = list(source.columns)
    else:
        raise ReadError(
            "source: expected a file name, or an object with columns by name such as a dict of "
            f"arrays or a DataFrame, got {type(source).__name__}"
        )
    coordinates = getattr(source, "coords", None)
    # An iterator over coordinates yields their names.
    return [*(name for name in coordinates or () if name not in names), *names]
