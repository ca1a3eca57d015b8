"""Writes the licences of the crates that are linked into the package: `make licences`.

A wheel holds the compiled code of other crates, so it has to hold their licences too.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "THIRD_PARTY_LICENSES.txt"
_LINKED = ("hysteresis-python", "hysteresis-capi", "hysteresis-fmu")
_NAMES = ("LICENSE", "LICENCE", "COPYING", "UNLICENSE", "NOTICE")
_RULE = "=" * 80
_HEAD = """Licences of the crates that are linked into mpi_hyst, or that wrote code which is.
Where a crate offers several licences, the MIT licence is taken.
"""


def linked() -> list[dict[str, Any]]:
    """Return the crates of others that the package is made of, on any system."""
    command = ["cargo", "metadata", "--format-version=1", "--locked"]
    told = subprocess.run(command, capture_output=True, check=True, cwd=ROOT).stdout
    metadata = json.loads(told)
    crates = {crate["id"]: crate for crate in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    waiting = [number for number, crate in crates.items() if crate["name"] in _LINKED]
    found: set[str] = set()
    while waiting:
        number = waiting.pop()
        if number in found:
            continue
        found.add(number)
        waiting += [
            dependency["pkg"]
            for dependency in nodes[number]["deps"]
            # Neither what builds nor what tests.
            if any(kind["kind"] is None for kind in dependency["dep_kinds"])
        ]
    others = [crates[number] for number in found if crates[number]["source"] is not None]
    return sorted(others, key=title)


def title(crate: dict[str, Any]) -> str:
    """Return name, version and licence in one line."""
    return f"{crate['name']} {crate['version']} ({crate['license']})"


def texts(crate: dict[str, Any]) -> Iterator[str]:
    """Return the licences that a crate brings along."""
    directory = Path(crate["manifest_path"]).parent
    named = sorted(path for path in directory.iterdir() if path.name.upper().startswith(_NAMES))
    # Some crates have a folder of licences.
    folders = [sorted(path.iterdir()) if path.is_dir() else [path] for path in named]
    files = [file for folder in folders for file in folder]
    mit = [path for path in files if "MIT" in path.name.upper()]
    chosen = mit if mit and " AND " not in crate["license"] else files
    for path in chosen:
        lines = path.read_text("utf-8").strip().splitlines()
        yield "\n".join(line.rstrip() for line in lines)


def written() -> str:
    """Return the file: every text once, below the crates that have it."""
    crates = linked()
    of_text: dict[str, list[str]] = {}
    for crate in crates:
        authors = ", ".join(crate["authors"]) or "see its repository"
        alone = f"No text comes with it. Authors: {authors}. {crate['repository'] or ''}".strip()
        for text in list(texts(crate)) or [alone]:
            of_text.setdefault(text, []).append(title(crate))
    parts = [f"{_RULE}\n{chr(10).join(titles)}\n\n{text}\n" for text, titles in of_text.items()]
    return "\n".join([_HEAD, *parts])


if __name__ == "__main__":
    FILE.write_text(written(), encoding="utf-8")
