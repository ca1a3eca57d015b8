"""Files of numpy: .npy with a two-dimensional or structured array, .npz with several arrays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from mpi_hyst._io.columns import ReadError
from mpi_hyst._io.table import Table, of_arrays, whole


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
