"""The stage of bytes: a file is unpacked, decoded, and handed out as lines. A pipe is read once."""

from __future__ import annotations

import bz2
import codecs
import gzip
import io
import lzma
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from errno import EINVAL
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO, cast

from mpi_hyst._io.marks import THOUSANDS
from mpi_hyst._io.record import ReadError

# Bounds for endless files such as devices.
MAX_LINE = 1_000_000  # bytes
HEAD = 1 << 12  # bytes that tell the format
# Bytes that are read at once. Larger pieces are pages that the system clears each time.
_FIRST, _LARGEST = 1 << 16, 1 << 22
_LAST = 1 << 14  # bytes of the end that come in no block

PACKED: dict[bytes, tuple[str, Callable[[BinaryIO], object]]] = {
    b"\x1f\x8b": (".gz", gzip.open),
    b"BZh": (".bz2", bz2.open),
    b"\xfd7zXZ\x00": (".xz", lzma.open),
}
# What unpackers raise for a content that is not theirs to the end.
_CORRUPT = (EOFError, zlib.error, lzma.LZMAError, gzip.BadGzipFile)
_MARKS = ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass(frozen=True)
class TextOptions:
    """What a user says of a text that it does not say itself."""

    skip_lines: int = 0
    """Lines at the top that are left out, whatever they hold."""
    thousands: str | None = None
    """What parts thousands; empty if nothing does, None if nobody says."""

    def check(self) -> None:
        """Refuse what cannot be."""
        if self.skip_lines < 0:
            raise ReadError(f"skip_lines: expected at least 0, got {self.skip_lines}")
        if self.thousands not in (None, "", *THOUSANDS):
            expected = ", ".join(map(repr, ("", *THOUSANDS)))
            raise ReadError(f"thousands: expected one of {expected}, got {self.thousands!r}")


PLAIN = TextOptions()
"""Nothing is said."""


class NulError(ReadError):
    """A NUL byte: a text ends before it."""


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
    """An iterator over the lines of a text. It says in which encoding they were.

    Inside, a text is bytes in which each line ends with a line feed: UTF-16 becomes UTF-8, and old
    line ends become new ones. So rows of plain numbers can be taken as blocks of bytes.
    """

    def __init__(self, source: str, file: io.BufferedReader, formats: str) -> None:
        """Take an open file; `formats` ends the message about what is no text."""
        self.source = source
        self.encoding = encoding(head(source, file))
        self.number = 0
        """The lines that were handed out."""
        self.last_is_open = False
        """Whether the last line has no end: known once it was handed out."""
        self._formats = formats
        self._file = file
        self._decoder = None
        if self.encoding != "utf-8":
            self._decoder = codecs.getincrementaldecoder(self.encoding)()
        self._buffer, self._at, self._ended, self._size = b"", 0, False, _FIRST
        self._held = b""

    def __iter__(self) -> Iterator[str]:
        """Return the iterator, which is the object itself."""
        return self

    def __next__(self) -> str:
        """Return the next line without its end."""
        while (end := self._buffer.find(b"\n", self._at)) < 0 and not self._ended:
            if len(self._buffer) - self._at >= MAX_LINE:
                self._refuse_length()
            self._fill()
        if end < 0:
            end = len(self._buffer)
            if self._at == end:
                raise StopIteration
            self.last_is_open = True
        line = self._buffer[self._at : end]
        if len(line) >= MAX_LINE:
            self._refuse_length()
        if b"\0" in line:
            self._refuse_nul()
        self._at = end + 1 if end < len(self._buffer) else end
        self.number += 1
        return self._decoded(line)

    def block(self, least: int) -> bytes:
        """Return whole lines that come next, about so many bytes, without reading them off.

        Empty near the end of the text, or where a line is too long for a block.
        """
        while len(self._buffer) - self._at < least and not self._ended:
            self._fill()
        # The end of a text is looked at line by line.
        last = len(self._buffer) - (_LAST if self._ended else 0)
        last = min(last, self._at + least)
        end = self._buffer.rfind(b"\n", self._at, max(self._at, last)) + 1
        return self._buffer[self._at : end] if end > self._at else b""

    def skip(self, size: int, lines: int) -> None:
        """Read off so many bytes of a block, which are so many lines."""
        self._at += size
        self.number += lines

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _place(self) -> str:
        return f"{self.source}, line {self.number + 1}"

    def _refuse_length(self) -> None:
        if self.number and b"\0" in self._buffer[self._at :]:
            self._refuse_nul()
        raise ReadError(f"{self._place()}: expected less than {MAX_LINE} characters")

    def _refuse_nul(self) -> None:
        if self.number == 0:
            raise ReadError(f"{self.source}: neither text nor a known format; {self._formats}")
        what = "NUL bytes in place of text, as in a file that was not written to its end"
        raise NulError(f"{self._place()}: {what}")

    def not_text(self) -> ReadError:
        """Return the error about a content without a table and with NUL bytes."""
        return ReadError(f"{self.source}: neither text nor a known format; {self._formats}")

    def _fill(self) -> None:
        """Read more bytes."""
        try:
            new = self._file.read1(self._size)
            self._ended = not new
            if self._decoder is not None:
                text = self._decoder.decode(new, final=self._ended)
                new = text.encode("utf-8", "surrogatepass")
        except UnicodeDecodeError as error:
            raise ReadError(f"{self._place()}: not {self.encoding} text: {error.reason}") from error
        except _CORRUPT as error:
            raise ReadError(f"{self._place()}: cannot be unpacked: {error}") from error
        self._size = min(2 * self._size, _LARGEST)
        new = self._held + new
        self._held = b""
        if b"\r" in new:
            # Half of an end of a line may come with the next bytes.
            if new.endswith(b"\r") and not self._ended:
                new, self._held = new[:-1], b"\r"
            new = new.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        if not self._buffer and self.number == 0:
            # The byte order mark that spreadsheets write.
            new = new.removeprefix(codecs.BOM_UTF8)
        self._buffer = self._buffer[self._at :] + new
        self._at = 0

    def _decoded(self, line: bytes) -> str:
        try:
            return line.decode("utf-8")
        except UnicodeDecodeError:
            self.encoding = "latin-1"
            return line.decode("latin-1")


def reader(source: str, package: str, extra: str) -> Any:
    """Import the reader of another project, or say which extra of mpi_hyst installs it."""
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
