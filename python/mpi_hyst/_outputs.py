"""Output files: looked at before the long work, written all at once after it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mpi_hyst._core import write_file
from mpi_hyst._errors import CommandError


@dataclass(frozen=True)
class Output:
    """One file to write and how: `write` puts it there, complete or not at all."""

    path: Path
    write: Callable[[Path], object]

    @classmethod
    def of_text(cls, path: Path, text: str) -> Output:
        """Make a file that holds this text."""
        return cls(path, lambda place: write_file(place, text))


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path] = ()) -> None:
    """Refuse what would fail after the work, and what would overwrite an input file."""
    seen: set[Path] = set()
    for path in outputs:
        if path is None:
            continue
        _check_place(path)
        if any(_same_file(path, source) for source in inputs):
            raise CommandError(f"{path}: is an input file and would be overwritten")
        if path.resolve() in seen:
            raise CommandError(f"{path}: named for two outputs")
        seen.add(path.resolve())


def check_directory(directory: Path) -> None:
    """Refuse a directory that can neither be written to nor made."""
    if directory.exists() and not directory.is_dir():
        raise CommandError(f"{directory}: is not a directory")
    there = next(place for place in (directory, *directory.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        raise CommandError(f"{there}: cannot write in this directory")


def write_outputs(outputs: Sequence[Output]) -> None:
    """Write the files, whose contents are all there by now."""
    for output in outputs:
        output.write(output.path)


def _check_place(path: Path) -> None:
    if path.is_dir():
        raise CommandError(f"{path}: is a directory, expected a file name")
    # A device or pipe would be replaced by a plain file.
    if path.exists() and not path.is_file():
        raise CommandError(f"{path}: is not a regular file")
    directory = path.parent
    if not directory.is_dir():
        raise CommandError(f"{path}: the directory {directory} does not exist")
    if not os.access(directory, os.W_OK | os.X_OK):
        raise CommandError(f"{path}: cannot write in the directory {directory}")


def _same_file(path: Path, source: Path) -> bool:
    return path.exists() and source.exists() and path.samefile(source)
