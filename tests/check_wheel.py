"""Looks into a wheel: `make wheel` does it with the one that it has built."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path

LICENCES = {"LICENSE", "THIRD_PARTY_LICENSES.txt"}
STACK = "mpi_hyst/_datasets/piezo_stack/"
DATA = {STACK + name for name in ("LICENSE", "major_loops.csv.gz", "decaying_loops.csv.gz")}
# The command begins outside of the package.
FILES = {
    *DATA,
    "mpi_hyst/_core.pyi",
    "mpi_hyst_command/__init__.py",
    "mpi_hyst_command/py.typed",
}


def faults(wheel: Path, places: Sequence[str]) -> list[str]:
    """Return what is wrong with a wheel that was built in these places."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        there = {name.rpartition("/")[2] for name in names if ".dist-info/licenses/" in name}
        found = [f"no licence file {name}" for name in sorted(LICENCES - there)]
        found += [f"no {name}" for name in sorted(FILES - set(names))]
        libraries = [name for name in names if name.endswith((".so", ".pyd", ".dylib"))]
        for library in ("_core", "mpi_hyst_fmu"):
            found += [] if any(library in name for name in libraries) else [f"no library {library}"]
        for name in libraries:
            code = archive.read(name)
            found += [f"{name} shows {place}" for place in places if place.encode() in code]
    return found


if __name__ == "__main__":
    wrong = faults(Path(sys.argv[1]), sys.argv[2:])
    sys.stdout.write(
        "\n".join(wrong or [f"{sys.argv[1]}: all licences, no paths of this machine", ""])
    )
    sys.exit(1 if wrong else 0)
