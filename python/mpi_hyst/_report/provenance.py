"""How a page was made: version, date, command, and hashes of what went in."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path
from typing import TypeAlias

import numpy as np

import mpi_hyst as mh
from mpi_hyst._files import sha256

Provenance: TypeAlias = Sequence[tuple[str, str]]
_EPOCH = "SOURCE_DATE_EPOCH"  # of reproducible builds: seconds that stand for now


def rows(
    made_by: str | None,
    data: Iterable[tuple[str, str | None]] = (),
    stage: tuple[str, str | None] | None = None,
) -> Provenance:
    """Return names and values. `data` are names with their SHA-256, as far as it is known.

    `made_by` is the command, or the call in Python; None if neither is known.
    """
    made = [("made with", f"mpi_hyst {version('mpi_hyst')}"), ("date", _date())]
    made += [] if made_by is None else [("made by", made_by)]
    # Parts of one file have one source.
    made += [("data", _hashed(*one)) for one in dict.fromkeys(data)]
    return [*made, *([] if stage is None else [("stage", _hashed(*stage))])]


def of_file(path: Path) -> tuple[str, str | None]:
    """Return the name of a file with its SHA-256; a pipe cannot be read again and has none."""
    return str(path), sha256(path)


def of_stage(stage: mh.Stage) -> tuple[str, str]:
    """Return the hash of a stage that is in no file."""
    return "Stage.to_bytes()", hashlib.sha256(stage.to_bytes()).hexdigest()


def of_arrays(name: str, arrays: Sequence[object]) -> tuple[str, str]:
    """Return the hash of samples that are in no file: of their float64, one array after another."""
    digest = hashlib.sha256()
    for values in arrays:
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return name, digest.hexdigest()


def _hashed(name: str, sha256: str | None) -> str:
    return name if sha256 is None else f"{name}, SHA-256 {sha256}"


def _date() -> str:
    given = os.environ.get(_EPOCH)
    moment = datetime.now(timezone.utc).astimezone()
    if given is not None:
        moment = datetime.fromtimestamp(int(given), timezone.utc)
    return moment.isoformat(sep=" ", timespec="seconds")
