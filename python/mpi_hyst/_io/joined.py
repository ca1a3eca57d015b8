"""Files of single channels that are one record: a directory, or names with a plus between them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mpi_hyst._io.cells import seconds_between
from mpi_hyst._io.formats import opened_file
from mpi_hyst._io.record import Assumption, ReadError
from mpi_hyst._io.source import TextOptions
from mpi_hyst._io.table import Table, numeric, of_arrays
from mpi_hyst._quantity import Quantity
from mpi_hyst._text import digits
from mpi_hyst._types import Samples


class _Channel(NamedTuple):
    """A column of one of the files."""

    path: Path
    name: str
    unit: str
    values: Samples


def joined_files(path: Path) -> list[Path] | None:
    """Return the files of a directory, or those of `a.txt+b.txt`; None of one file."""
    if path.is_dir():
        files = sorted(one for one in path.iterdir() if one.is_file())
        files = [one for one in files if not one.name.startswith(".")]
        return files if files else None
    if path.exists() or "+" not in str(path):
        return None
    parts = [Path(one.strip()) for one in str(path).split("+")]
    # `data/a.txt+b.txt` are beside each other.
    parts = [one if one.exists() else parts[0].parent / one for one in parts]
    return parts if all(one.is_file() for one in parts) else None


def joined(paths: Sequence[Path], options: TextOptions, *, is_directory: bool) -> Table:
    """Join files of single channels: columns that all of them share are there once.

    A column alone in its file is called as in its header, or else like its file.
    """
    channels: list[_Channel] = []
    said: list[Assumption] = []
    begins: dict[Path, str] = {}
    if is_directory:
        paths, said = _without_notes(paths, options)
    for path in paths:
        with opened_file(path, options) as table:
            begins[path] = table.begins
            indices = list(numeric(table))
            loaded = table.load(indices, None, None, lambda *_: None)
            for index, values in zip(indices, loaded, strict=True):
                unit = table.units.get(index, "") or Quantity(table.names[index]).suffix
                channels.append(_Channel(path, table.names[index], unit, values))
            said += [one for one in table.assumed if one.level != "said"]
    if len({one.values.size for one in channels}) > 1:
        counts = ", ".join(dict.fromkeys(f"{one.path} {one.values.size}" for one in channels))
        raise ReadError(f"expected files of as many rows each, got {counts}")
    kept = _called(channels, paths)
    leaves = [(Quantity(one.name.rpartition("/")[2], one.unit), one) for one in kept.values()]
    times = [one for leaf, one in leaves if leaf.is_time]
    if len(times) > 1:
        apart = max(float(np.abs(one.values - times[0].values).max()) for one in times[1:])
        between = f" by up to {digits(apart)}{times[0].unit and f' {times[0].unit}'}"
        which = " and ".join(str(one.path) for one in times)
        raise ReadError(f"the times of {which} differ{between}: read them apart")
    what = " + ".join(map(str, paths))
    said += _starts(begins)
    said.append(Assumption("bytes", f"{len(paths)} files are joined, row by row", "assumed"))
    return of_arrays(
        what, None, what, {name: one.values for name, one in kept.items()},
        {name: one.unit for name, one in kept.items()}, assumed=said,
    )  # fmt: skip


def _called(channels: Sequence[_Channel], paths: Sequence[Path]) -> dict[str, _Channel]:
    """Return the channels by their names, those that all files share once."""
    shared = [_is_shared(one, channels, paths) for one in channels]
    own = [one for one, is_shared in zip(channels, shared, strict=True) if not is_shared]
    names = [one.name for one in own]
    kept: dict[str, _Channel] = {}
    for one, is_shared in zip(channels, shared, strict=True):
        if is_shared:
            kept.setdefault(one.name if not one.name.isdigit() else "time", one)
        elif sum(other.path == one.path for other in own) > 1:
            kept[f"{one.path.stem}/{one.name}"] = one
        else:
            is_named = names.count(one.name) == 1 and not one.name.isdigit()
            kept[one.name if is_named else one.path.stem] = one
    return kept


def _is_shared(one: _Channel, channels: Sequence[_Channel], paths: Sequence[Path]) -> bool:
    """Whether a channel that grows, as a time does, is in each of several files."""
    return (
        len(paths) > 1
        and bool((np.diff(one.values) > 0.0).all())
        and {other.path for other in channels if np.array_equal(one.values, other.values)}
        >= set(paths)
    )


def _starts(begins: Mapping[Path, str]) -> Iterator[Assumption]:
    """Say if files that are joined tell different times above their tables."""
    told = {path: stamp for path, stamp in begins.items() if stamp}
    if len(set(told.values())) < 2:
        return
    (one, first), (other, second) = next((a, b) for a, b in pairwise(told.items()) if a[1] != b[1])
    # Between a date and a time of the day a file may have commas.
    between = seconds_between(
        *(re.sub(r"[,;]\s*(?=\d+:)", " ", stamp) for stamp in (first, second))
    )
    apart = "" if between is None else f", {digits(1e3 * abs(between))} ms apart"
    said = (
        f"{one.name} tells {first}, {other.name} tells {second}{apart}: rows are joined by their "
        "numbers, and a difference of starts becomes a dead time or a lead; cut the earlier file"
    )
    yield Assumption("table", said, "doubtful")


def _without_notes(
    paths: Sequence[Path], options: TextOptions
) -> tuple[list[Path], list[Assumption]]:
    """Leave out the files of a directory that hold no columns of numbers, and say so."""
    kept = []
    for path in paths:
        try:
            with opened_file(path, options) as table:
                kept += [path] if table.numeric else []
        except ReadError as error:
            # Where numbers are refused there are some.
            if error.rows is not None or path.suffix.lower() not in _NOTES:
                raise
    left = [path.name for path in paths if path not in kept]
    if not left or not kept:
        return list(paths), []
    what = f"no columns of numbers in {', '.join(left)}: left out of the files that are joined"
    return kept, [Assumption("bytes", what, "assumed")]


_NOTES = (".txt", ".md", ".log", ".json", ".ini", ".pdf", ".png", ".jpg", ".svg", ".docx", "")
