"""Objects in memory with columns by name: dict, DataFrame, Dataset, structured array."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._io.columns import ReadError
from mpi_hyst._io.table import Table, of_arrays
from mpi_hyst._quantity import known_unit


def read_object(source: Any) -> Table:
    """Take the columns of an object. Nothing is imported to know what it is."""
    kind = type(source).__name__
    if isinstance(source, np.ndarray):
        return of_arrays(kind, None, kind, {"": source})
    names = _names(source)
    arrays: dict[str, npt.NDArray[Any]] = {}
    units = {}
    index = getattr(source, "index", None)
    name = getattr(index, "name", None)
    if name is not None and name not in names:
        arrays[str(name)] = np.asarray(index)
    for name in names:
        column = source[name]
        try:
            array = np.asarray(column)
        except (TypeError, ValueError) as error:
            raise ReadError(f"{kind}, column {name}: expected an array: {error}") from error
        if array.ndim > 2:
            raise ReadError(
                f"{kind}, column {name}: expected one dimension or two, got {array.ndim}"
            )
        arrays[str(name)] = array
        unit = getattr(column, "attrs", {}).get("units", "")
        if unit:
            units[str(name)] = known_unit(str(unit)) or str(unit)
    return of_arrays(kind, None, kind, arrays, units)


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
