"""Files that are written whole or not at all, and only where a file may be.

A file is first written under a random name in the same directory, flushed to the disk, and then
renamed. A reader sees the old file or the new one, and nobody can prepare the temporary name. If
the process is killed, `.mpi_hyst-<16 digits>.tmp` may be left; the next file that is written in
that directory removes it. A lock tells such a leftover from the work of another process.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import secrets
import stat
from contextlib import suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: leftovers of killed processes stay
    _LOCKS = False
else:
    _LOCKS = True

_NEW = 0o666  # less the umask, as for any new file
_RANDOM = 8  # bytes of the random name
_BINARY = getattr(os, "O_BINARY", 0)  # Windows would change the ends of lines
_COPY = re.compile(r"\.mpi_hyst-[0-9a-f]{16}\.tmp")


def path_of(path: str | os.PathLike[str]) -> Path:
    """Return where a file is, or refuse what names none."""
    try:
        return Path(path)
    except TypeError as error:
        raise TypeError(f"path: expected the name of a file, got {path!r}") from error


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file completely or not at all; a replaced file passes on its permissions.

    A link stays a link: its target is replaced. Anything but a regular file is refused. Raises
    OSError with the name of the file; the old file is intact then, and nothing else is left.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    check_regular(path)
    try:
        place = Path(os.path.realpath(path))
        remove_leftovers(place.parent)
        _replace(place, data)
        _sync_directory(place.parent)
    except OSError as error:
        # The name that was given, not that of the copy.
        raise OSError(error.errno, error.strerror, str(path)) from error


def sha256(path: Path) -> str | None:
    """Return the SHA-256 of a file; None for a pipe, which reads only once."""
    if not path.is_file():
        return None
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def check_regular(path: Path) -> None:
    """Refuse anything but a regular file or a free name; one that is too long raises OSError."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        if path.is_symlink():
            raise OSError(f"{path}: is a link to a file that does not exist") from None
        return
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    # A device or pipe would be replaced by a regular file.
    if not stat.S_ISREG(mode):
        raise OSError(f"{path}: is not a regular file")


def remove_leftovers(directory: Path) -> None:
    """Remove the copies that killed processes have left; those of living ones are locked."""
    if not _LOCKS:
        return
    # One may write in a directory that one may not list.
    with suppress(PermissionError), os.scandir(directory) as entries:
        for entry in entries:
            if _COPY.fullmatch(entry.name):
                with suppress(OSError):
                    _remove_if_unlocked(Path(entry.path))


def _remove_if_unlocked(copy: Path) -> None:
    # No link is followed, and no pipe waited for.
    number = os.open(copy, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        copy.unlink()
    finally:
        os.close(number)


def _replace(place: Path, data: bytes) -> None:
    mode = stat.S_IMODE(place.stat().st_mode) if place.exists() else None
    # The copy is never readable for those who may not read the file.
    copy, number = _new_copy(place.parent, _NEW if mode is None else 0o600)
    try:
        with os.fdopen(number, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(number)
            if mode is not None:
                copy.chmod(mode)
            # Still locked: no other process takes the copy for a leftover.
            if _LOCKS:
                copy.replace(place)
        # Windows renames no open file.
        if not _LOCKS:
            copy.replace(place)
    except BaseException:
        with suppress(OSError):
            copy.unlink()
        raise


def _new_copy(directory: Path, mode: int) -> tuple[Path, int]:
    """Make a file that was not there before, and lock it."""
    while True:
        copy = directory / f".mpi_hyst-{secrets.token_hex(_RANDOM)}.tmp"
        number = os.open(copy, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, mode)
        if not _LOCKS:
            return copy, number
        # A file system without locks needs none: nothing is removed there either.
        with suppress(OSError):
            fcntl.flock(number, fcntl.LOCK_EX)
        # Another process may have removed it before it was locked.
        if os.fstat(number).st_nlink > 0:
            return copy, number
        os.close(number)


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
