"""The lines of a text file: unpacked, decoded and bounded. A pipe is read once."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zlib
from collections.abc import Callable, Iterator
from typing import BinaryIO, cast

from mpi_hyst._io.columns import ReadError

# Bounds for endless files such as devices.
MAX_LINE = 1_000_000  # characters
HEAD = 1 << 12  # bytes that tell the format

PACKED: dict[bytes, tuple[str, Callable[[BinaryIO], object]]] = {
    b"\x1f\x8b": (".gz", gzip.open),
    b"BZh": (".bz2", bz2.open),
    b"\xfd7zXZ\x00": (".xz", lzma.open),
}
# What unpackers raise for a content that is not theirs to the end.
_CORRUPT = (EOFError, zlib.error, lzma.LZMAError, gzip.BadGzipFile)
_MARKS = ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


def unpacked(file: io.BufferedReader) -> tuple[io.BufferedReader, str]:
    """Return the content of a packed file and the suffix of the packer, or the file as it is."""
    start = file.peek(HEAD)
    for magic, (suffix, unpack) in PACKED.items():
        if start.startswith(magic):
            return io.BufferedReader(cast(io.RawIOBase, unpack(file))), suffix
    return file, ""


def head(source: str, file: io.BufferedReader) -> bytes:
    """Return the first bytes without reading them off."""
    try:
        return file.peek(HEAD)[:HEAD]
    except (*_CORRUPT, OSError) as error:
        raise ReadError(f"{source}: cannot be unpacked: {error}") from error


def encoding(start: bytes) -> str:
    """Return the encoding of a text by its first bytes."""
    for mark, name in _MARKS:
        if start.startswith(mark):
            return name
    even, odd = start[::2], start[1::2]
    if not any(odd) and _is_latin(even):
        return "utf-16-le"
    if not any(even) and _is_latin(odd):
        return "utf-16-be"
    return "utf-8"


def _is_latin(characters: bytes) -> bool:
    """Whether all are printable, the signs of units in Latin-1 included: µ, °, Å."""
    printable = (one in b"\t\r\n" or 32 <= one < 127 or one >= 160 for one in characters)
    return bool(characters) and all(printable)


class Lines:
    """An iterator over the lines of a text. It says in which encoding they were."""

    def __init__(self, source: str, file: io.BufferedReader, formats: str) -> None:
        """Take an open file; `formats` ends the message about what is no text."""
        self.source = source
        self.encoding = encoding(head(source, file))
        self._formats = formats
        # utf-8-sig drops the byte order mark that spreadsheets write. Bytes that are not UTF-8
        # become surrogates, and then Latin-1: so a pipe needs no second look.
        codec, errors = self.encoding, "strict"
        if codec == "utf-8":
            codec, errors = "utf-8-sig", "surrogateescape"
        self._text = io.TextIOWrapper(file, encoding=codec, errors=errors)
        self._number = 0

    def __iter__(self) -> Iterator[str]:
        """Return the iterator, which is the object itself."""
        return self

    def __next__(self) -> str:
        """Return the next line without its end."""
        self._number += 1
        place = f"{self.source}, line {self._number}"
        try:
            line = self._text.readline(MAX_LINE)
        except UnicodeDecodeError as error:
            raise ReadError(f"{place}: not {self.encoding} text: {error.reason}") from error
        except _CORRUPT as error:
            raise ReadError(f"{place}: cannot be unpacked: {error}") from error
        if not line:
            raise StopIteration
        if len(line) == MAX_LINE:
            raise ReadError(f"{place}: expected less than {MAX_LINE} characters")
        if not line.isascii():
            line = self._decoded(line)
        if "\0" in line:
            raise ReadError(f"{self.source}: neither text nor a known format; {self._formats}")
        return line.rstrip("\n")

    def close(self) -> None:
        """Close the text and the file below it."""
        self._text.close()

    def _decoded(self, line: str) -> str:
        try:
            line.encode("utf-8")
        except UnicodeEncodeError:
            self.encoding = "latin-1"
            return line.encode("utf-8", "surrogateescape").decode("latin-1")
        return line
