"""The bytes of a functional mock-up unit: a zip file of texts, and the library that reads them.

`binaries` has the library, in a folder for each platform.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

from mpi_hyst._core import Stage, fmu_texts

_BINARIES = Path(__file__).parent / "binaries"  # a folder for each platform, as in a unit
_FIRST_DAY = (1980, 1, 1, 0, 0, 0)  # of zip files: the same contents give the same bytes


def packed(
    stage: Stage,
    kind: str,
    name: str,
    *,
    dt: float,
    feedforward: str = "inverse",
    gains: tuple[float, float] | None = None,
) -> bytes:
    """Return a unit; `mpi_hyst.export.fmu` has the arguments."""
    made = fmu_texts(stage, kind, name, dt, feedforward, gains)
    identifier, description, settings, model = made
    contents: dict[str, str | bytes] = {"modelDescription.xml": description}
    for library in _libraries():
        place = f"binaries/{library.parent.name}/{identifier}{library.suffix}"
        contents[place] = library.read_bytes()
    contents["resources/settings.json"] = settings
    contents["resources/stage.json"] = model
    return _zipped(contents)


def _libraries() -> list[Path]:
    """Return the library for units of every platform that this package has."""
    found = sorted(path for path in _BINARIES.glob("*/mpi_hyst_fmu.*") if path.is_file())
    if not found:
        raise FileNotFoundError(
            f"{_BINARIES}: expected the library of units, got none: `make` builds it, and "
            "`make wheel` a wheel with it"
        )
    return found


def _zipped(contents: dict[str, str | bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zipped:
        for name, content in contents.items():
            entry = zipfile.ZipInfo(name, _FIRST_DAY)
            entry.compress_type = zipfile.ZIP_DEFLATED
            # Readable by all, and a library may be run.
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            zipped.writestr(entry, content)
    return file.getvalue()
