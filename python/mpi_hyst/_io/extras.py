"""Readers of other projects: imported when a file needs them, and named when they are missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from mpi_hyst._io.columns import ReadError


def reader(source: str, package: str, extra: str) -> Any:
    """Import a package, or say which extra of mpi_hyst installs it."""
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        needed = f"needs {error.name}: pip install 'mpi_hyst[{extra}]'"
        raise ReadError(f"{source}: reading this format {needed}") from error
