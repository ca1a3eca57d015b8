"""MATLAB files: of version 5, by scipy; of version 7.3, which are HDF5, by h5py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mpi_hyst._io.factors import Setting
from mpi_hyst._io.formats.hdf5 import read_as
from mpi_hyst._io.source import reader, whole
from mpi_hyst._io.table import Table, of_arrays


def read_mat(path: Path) -> Table:
    """Open a MATLAB file. Columns are `name` or `structure.field`, with `:0` in matrices."""
    scipy_io = reader(str(path), "scipy.io", "mat")
    # Given a name, loadmat leaves a broken file open.
    with whole(path, "MATLAB file"), path.open("rb") as file:
        found = scipy_io.loadmat(file, simplify_cells=True)
    values: dict[str, Any] = {}
    for name, value in found.items():
        if not name.startswith("__"):
            values |= _flat(name, value)
    arrays = {name: one for name, one in values.items() if isinstance(one, np.ndarray) and one.ndim}
    settings = [Setting(name, value) for name, value in values.items() if name not in arrays]
    arrays = {name: one for name, one in arrays.items() if one.size}
    return of_arrays(str(path), path, "MATLAB 5", arrays, settings=settings)


def read_mat73(path: Path) -> Table:
    """Open a MATLAB file of version 7.3. Columns are named as in one of version 5."""
    return read_as(path, "MATLAB 7.3", ".")


def _flat(name: str, value: Any) -> dict[str, Any]:
    """Return the arrays in a structure by their paths, with numbers and texts beside them."""
    if isinstance(value, dict):
        return {k: v for key, one in value.items() for k, v in _flat(f"{name}.{key}", one).items()}
    is_cells = isinstance(value, np.ndarray) and value.dtype.kind == "O"
    # Cells, and structures in an array: scipy makes lists of some.
    if is_cells or isinstance(value, list):
        cells = value.reshape(-1) if is_cells else value
        if len(cells) and all(isinstance(one, str) for one in cells):
            return {name: np.asarray([str(one) for one in cells])}
        parts = [_flat(f"{name}.{index}", one) for index, one in enumerate(cells)]
        return {k: v for part in parts for k, v in part.items()}
    return {name: value}
