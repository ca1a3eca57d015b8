"""The formats that can be read: one list. Errors name them by it, a test compares docs/formats.md.

Each file beside this one reads one family of formats into a table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from mpi_hyst._io.formats.arrays import read_npy, read_npz
from mpi_hyst._io.formats.hdf5 import read_hdf5
from mpi_hyst._io.formats.lvm import read_lvm
from mpi_hyst._io.formats.matlab import read_mat, read_mat73
from mpi_hyst._io.formats.tdms import read_tdms
from mpi_hyst._io.formats.text import TextTable
from mpi_hyst._io.formats.workbook import is_workbook, read_workbook
from mpi_hyst._io.record import ReadError
from mpi_hyst._io.source import HEAD, PACKED, PLAIN, Lines, TextOptions, head, unpacked
from mpi_hyst._io.table import Table

OfText: TypeAlias = Callable[[Path, Lines, str, TextOptions], Table]
OfFile: TypeAlias = Callable[[Path], Table]


@dataclass(frozen=True)
class Format:
    """A format: how it is known, and who reads it."""

    name: str
    suffixes: tuple[str, ...]
    columns: str
    """How columns are named, for the documentation."""
    magic: bytes = b""
    """What the content begins with; empty for other text."""
    extra: str = ""
    """The extra of the package that installs the reader; empty if it needs none."""
    of_text: OfText | None = None
    of_file: OfFile | None = None


FORMATS = (
    Format("MATLAB 5", (".mat",), "`name`, `structure.field`, `matrix:0`", b"MATLAB 5.0",
           extra="mat", of_file=read_mat),
    Format("MATLAB 7.3", (".mat",), "`name`, `structure.field`, `matrix:0`", b"MATLAB 7.3",
           extra="hdf5", of_file=read_mat73),
    Format("HDF5", (".h5", ".hdf5"), "`group/dataset`, `group/dataset:0`", b"\x89HDF\r\n\x1a\n",
           extra="hdf5", of_file=read_hdf5),
    Format("TDMS", (".tdms",), "`Group/Channel`, `time_s`", b"TDSm",
           extra="tdms", of_file=read_tdms),
    Format("NumPy array", (".npy",), "`0`, `1`, or fields", b"\x93NUMPY", of_file=read_npy),
    Format("NumPy archive", (".npz",), "`name`, `name:0`, `name/field`", b"PK\x03\x04",
           of_file=read_npz),
    Format("workbook", (".xlsx",), "names of the header, or `0`, `1`",
           b"PK\x03\x04", extra="xlsx", of_file=read_workbook),
    Format("LabVIEW measurement", (".lvm",), "`Channel`, `time_s`", b"LabVIEW Measurement",
           extra="lvm", of_text=read_lvm),
    Format("text", (".csv", ".tsv", ".txt", ".dat", ".asc"), "names of the header, or `0`, `1`",
           of_text=TextTable),
)  # fmt: skip
_MARK = b"\xef\xbb\xbf"
_OURS = re.compile(rb'\s*\{[^[]*"schema":\s*"mpi_hyst/(\w+)/')
_PICKLE = tuple(bytes([0x80, version]) for version in range(2, 6))


def known() -> str:
    """List the formats for a message."""
    names = [f"{one.name} ({', '.join(one.suffixes)})" for one in FORMATS]
    packers = ", ".join(suffix for suffix, _ in PACKED.values())
    return f"known: {', '.join(names)}; text also packed: {packers}"


def recognise(start: bytes) -> Format:
    """Return the format of a content by its first bytes; what has no other mark is text."""
    bare = start.removeprefix(_MARK)
    return next(one for one in FORMATS if bare.startswith(one.magic))


def _of_archive(path: Path, found: Format) -> Format:
    """Return the format of an archive, by what is in it: that of numpy, or a workbook."""
    if found.of_file is not read_npz or not path.is_file() or not is_workbook(path):
        return found
    return next(one for one in FORMATS if one.of_file is read_workbook)


@contextmanager
def opened_file(path: Path, options: TextOptions = PLAIN) -> Iterator[Table]:
    """Recognise a file by its content, and open it; its name matters in messages only."""
    options.check()
    with path.open("rb") as raw:
        start = raw.peek(HEAD)
        if start.startswith(_PICKLE):
            raise ReadError(f"{path}: a pickle, which could run code when read; {known()}")
        if (ours := _OURS.match(start)) is not None:
            raise ReadError(
                f"{path}: expected a record, got a saved {ours[1].decode()} of mpi_hyst"
            )
        file, packed = unpacked(raw)
        found = recognise(head(str(path), file))
        if found.of_text is not None:
            with closing(Lines(str(path), file, _not_text(path, packed))) as lines:
                if found.of_text is not TextTable:
                    _refuse_options(path, found, options)
                yield found.of_text(path, lines, packed, options)
            return
    found = _of_archive(path, found)
    if packed:
        raise ReadError(f"{path}: expected text in it, got {found.name}: unpack it first")
    if not path.is_file():
        raise ReadError(f"{path}: {found.name} cannot be read from a pipe; expected a file")
    _refuse_options(path, found, options)
    assert found.of_file is not None
    yield found.of_file(path)


def _refuse_options(path: Path, found: Format, options: TextOptions) -> None:
    """Refuse what is said of texts where none is read."""
    if options != PLAIN:
        what = "skipped lines and marks of thousands are said of texts"
        raise ReadError(f"{path}: {what}, got {found.name}; save it as text")


def _not_text(path: Path, packed: str) -> str:
    """Return what is said of a content that is neither text nor has the mark of a format."""
    suffix = path.with_suffix("").suffix if packed else path.suffix
    meant = [one.name for one in FORMATS if suffix.lower() in one.suffixes]
    if meant:
        return f"the name says {' or '.join(meant)}, the content does not; {known()}"
    return f"unknown format {suffix!r}; {known()}"
