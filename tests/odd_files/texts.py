"""Text files of all dialects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from support import Array

from odd_files.bench import Record
from odd_files.case import Write

Change = Callable[[str], str]


def table(columns: Sequence[Array], digits: int = 9, separator: str = ",") -> str:
    """Return the rows of a table."""
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = [separator.join(f"{value:.{digits}g}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def text(
    record: Record,
    header: str = "time_s,drive_v,position_um",
    *,
    change: Change | None = None,
    encoding: str = "utf-8",
    name: str = "record.csv",
    digits: int = 9,
) -> Write:
    """Write time, drive and position, and change the whole text."""
    content = f"{header}\n" if header else ""
    content += table([record.t, record.u, record.y], digits)
    return raw((change(content) if change else content).encode(encoding), name)


def raw(content: bytes, name: str = "record.csv") -> Write:
    """Write these bytes."""

    def write(place: Path) -> list[Path]:
        path = place / name
        path.write_bytes(content)
        return [path]

    return write


def both(*writes: Write) -> Write:
    """Write several files."""
    return lambda place: [path for write in writes for path in write(place)]


def columns(drive: str = "drive_v", position: str = "position_um") -> list[str]:
    """Return the options that name the columns."""
    return ["--input", drive, "--output", position]
