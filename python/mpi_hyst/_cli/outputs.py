"""Output files: checked before the long work, each written whole or not at all after it.

A file is first written beside its place under a random name, which nobody can have planted, then
put on the disk, and only then renamed: whoever looks sees the old file or the new one.
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
    """One file to write and how: `write` puts it there, whole or not at all."""

    path: Path
    write: Callable[[Path], object]

    @classmethod
    def of_text(cls, path: Path, text: str) -> Output:
        """Make a file that holds this text."""
        return cls(path, lambda place: write_file(place, text))


def check_outputs(outputs: Sequence[Path | None], inputs: Sequence[Path] = ()) -> None:
    """Refuse what would fail after the work, and what would overwrite an input file."""
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
    """Refuse a directory that can neither be written to nor made."""
    if directory.exists() and not directory.is_dir():
        raise CommandError(f"{directory}: is not a directory")
    there = next(place for place in (directory, *directory.absolute().parents) if place.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        raise CommandError(f"{there}: cannot write in this directory")


def write_outputs(outputs: Sequence[Output], directory: Path | None = None) -> None:
    """Make the directory and write the files in their order; an error says which are there.

    From here on Ctrl-C waits: a command must not say that nothing is written when something is.
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


def write_file(path: Path, text: str) -> None:
    """Write a file whole or not at all; one that is replaced leaves its permissions."""
    _check_regular(path)
    # A link stays a link: the file that it points at is replaced.
    place = Path(os.path.realpath(path))
    mode = stat.S_IMODE(place.stat().st_mode) if place.exists() else None
    copy = place.with_name(f".{secrets.token_hex(_RANDOM)}.tmp")
    # Who may not read the file may not read its copy either, at no time.
    number = os.open(copy, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _NEW if mode is None else 0o600)
    try:
        with os.fdopen(number, "w", encoding="utf-8", newline="") as file:
            file.write(text)
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
    """Put the new name on the disk, where a directory can be opened for that."""
    if os.name == "nt":
        return
    number = os.open(directory, os.O_RDONLY)
    try:
        # Some network file systems refuse this; the file itself is on the disk.
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
    # Of a link: the directory of the file that it points at.
    directory = Path(os.path.realpath(path)).parent
    if not os.access(directory, os.W_OK | os.X_OK):
        raise CommandError(f"{path}: cannot write in the directory {directory}")


def _check_regular(path: Path) -> None:
    """Refuse what is no plain file; a name that is too long is an OSError."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.is_symlink():
            raise CommandError(f"{path}: is a link to a file that does not exist") from None
        return
    # A device or pipe would be replaced by a plain file.
    if not stat.S_ISREG(mode):
        raise CommandError(f"{path}: is not a regular file")


def _same_file(path: Path, source: Path) -> bool:
    return path.exists() and source.exists() and path.samefile(source)
