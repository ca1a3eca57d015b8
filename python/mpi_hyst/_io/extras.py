"""Readers of other projects: imported when a file needs them, and named when they are missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from errno import EINVAL
from importlib import import_module
from pathlib import Path
from typing import Any

from mpi_hyst._io.columns import ReadError


def reader(source: str, package: str, extra: str) -> Any:
    """Import a package, or say which extra of mpi_hyst installs it."""
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        needed = f"needs {error.name}: pip install 'mpi_hyst[{extra}]'"
        raise ReadError(f"{source}: reading this format {needed}") from error


@contextmanager
def whole(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a reader happens to meet in a broken file into an error that names the file.

    What the machine refuses stays as it is: memory, and errors of the system with a number. Only an
    invalid argument is a place in the file that cannot be.
    """
    try:
        yield
    except Exception as error:
        ours = isinstance(error, ReadError | MemoryError)
        if ours or getattr(error, "errno", None) not in (None, EINVAL):
            raise
        raise ReadError(f"{path}: not a whole {what}: {error or repr(error)}") from error
