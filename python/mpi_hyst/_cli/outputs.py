"""Output files: checked before the work starts, written completely or not at all.

A file is first written under a random name in the same directory, flushed to the disk, and then
renamed. A reader sees the old file or the new one, and nobody can prepare the temporary name.
"""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.interrupts import hold_interrupts

_NEW = 0o666  # less the umask, as for any new file
_RANDOM = 8  # bytes of the random name


@dataclass(frozen=True)
class Output:
    """A file to write, and the function that writes it completely or not at all."""

    path: Path
    write: Callable[[Path], object]

    @classmethod
    def of_text(cls, path: Path, text: str) -> Output:
        """Make an output with this text."""
        return cls(path, lambda place: write_file(place, text))


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path] = ()) -> None:
    """Refuse files that could not be written after the work, or would overwrite an input."""
    seen: set[str] = set()
    for path in outputs:
        if path is None:
            continue
        _check_place(path)
        if any(_same_file(path, source) for source in inputs):
            raise CommandError(f"{path}: is an input file and would be overwritten")
        place = os.path.realpath(path)
        if place in seen:
            raise CommandError(f"{path}: named for two outputs")
        seen.add(place)


def check_directory(directory: Path) -> None:
    """Refuse a directory that cannot be written to or made."""
    if directory.exists() and not directory.is_dir():
        raise CommandError(f"{directory}: is not a directory")
    there = next(place for place in (directory, *directory.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        raise CommandError(f"{there}: cannot write in this directory")


def write_outputs(outputs: Sequence[Output], directory: Path | None = None) -> None:
    """Make the directory and write the files in order; an error lists those already written.

    Ctrl-C is ignored from here on, so that no command says "nothing written" after writing.
    """
    hold_interrupts()
    if directory is not None:
        directory.mkdir(parents=True, exist_ok=True)
    written: list[str] = []
    for output in outputs:
        try:
            output.write(output.path)
        except OSError as error:
            before = f"; written before: {', '.join(written)}" if written else ""
            reason = error.strerror or str(error)
            raise CommandError(f"{output.path}: {reason}{before}") from error
        written.append(str(output.path))


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file completely or not at all; a replaced file passes on its permissions."""
    data = content.encode("utf-8") if isinstance(content, str) else content
    _check_regular(path)
    # A link stays a link: its target is replaced.
    place = Path(os.path.realpath(path))
    mode = stat.S_IMODE(place.stat().st_mode) if place.exists() else None
    copy = place.with_name(f".{secrets.token_hex(_RANDOM)}.tmp")
    # The copy is never readable for those who may not read the file.
    number = os.open(copy, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _NEW if mode is None else 0o600)
    try:
        with os.fdopen(number, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(number)
        if mode is not None:
            copy.chmod(mode)
        copy.replace(place)
    except BaseException:
        with suppress(OSError):
            copy.unlink()
        raise
    _sync_directory(place.parent)


def _sync_directory(directory: Path) -> None:
    """Flush the new name to the disk, on systems that can open a directory."""
    if os.name == "nt":
        return
    number = os.open(directory, os.O_RDONLY)
    try:
        # Some network file systems refuse this. The content is on the disk anyway.
        with suppress(OSError):
            os.fsync(number)
    finally:
        os.close(number)


def _check_place(path: Path) -> None:
    if path.is_dir():
        raise CommandError(f"{path}: is a directory, expected a file name")
    directory = path.parent
    if not directory.is_dir():
        raise CommandError(f"{path}: the directory {directory} does not exist")
    _check_regular(path)
    # The directory of the file itself, if the path is a link.
    directory = Path(os.path.realpath(path)).parent
    if not os.access(directory, os.W_OK | os.X_OK):
        raise CommandError(f"{path}: cannot write in the directory {directory}")


def _check_regular(path: Path) -> None:
    """Refuse anything but a regular file; a name that is too long raises OSError."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.is_symlink():
            raise CommandError(f"{path}: is a link to a file that does not exist") from None
        return
    # A device or pipe would be replaced by a regular file.
    if not stat.S_ISREG(mode):
        raise CommandError(f"{path}: is not a regular file")


def _same_file(path: Path, source: Path) -> bool:
    return path.exists() and source.exists() and path.samefile(source)
