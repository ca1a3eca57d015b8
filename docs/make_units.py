"""Builds the library of functional mock-up units, and puts it where the Python package packs it.

    python docs/make_units.py [--target aarch64-unknown-linux-gnu]

Cargo builds in CARGO_TARGET_DIR and with RUSTFLAGS, as always. The folder is named as FMI 2.0
names platforms: by system and word size, not by processor.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BINARIES = ROOT / "python" / "mpi_hyst" / "_fmu" / "binaries"
_SYSTEMS = {"linux": "linux", "macos": "darwin", "windows": "win"}


def platform(facts: Mapping[str, str]) -> str:
    """Return what FMI 2.0 calls the target of which rustc says these facts.

    >>> platform({"target_os": "linux", "target_pointer_width": "64"})
    'linux64'
    >>> platform({"target_os": "windows", "target_pointer_width": "32"})
    'win32'
    """
    system = facts["target_os"]
    if system not in _SYSTEMS:
        raise SystemExit(f"target: expected one of {', '.join(_SYSTEMS)}, got {system}")
    return _SYSTEMS[system] + facts["target_pointer_width"]


def facts_of(target: list[str]) -> dict[str, str]:
    """Return what rustc says of a target."""
    told = _output(["rustc", "--print", "cfg", *target])
    return dict(re.findall(r'^(\w+)="(.*)"$', told, flags=re.MULTILINE))


def build(target: list[str], facts: Mapping[str, str]) -> Path:
    """Build the library and return where cargo has put it."""
    flags = ["-C", "strip=symbols"]
    if facts["target_env"] == "musl":
        flags += ["-C", "target-feature=-crt-static"]  # else there are no shared libraries
    what = ["--release", "--package=hysteresis-fmu", "--lib", "--crate-type=cdylib", *target]
    messages = ["--quiet", "--message-format=json-render-diagnostics"]
    told = _output(["cargo", "rustc", *messages, *what, "--", *flags])
    made = [json.loads(line) for line in told.splitlines()]
    files = [
        Path(file)
        for one in made
        if one["reason"] == "compiler-artifact" and one["target"]["name"] == "mpi_hyst_fmu"
        for file in one["filenames"]
    ]
    return next(file for file in files if file.suffix in {".so", ".dylib", ".dll"})


def _output(command: list[str]) -> str:
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def main() -> None:
    """Build for a target, by default that of CARGO_BUILD_TARGET or this machine."""
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    words.add_argument("--target", default=os.environ.get("CARGO_BUILD_TARGET"))
    asked = words.parse_args().target
    target = ["--target", asked] if asked else []
    facts = facts_of(target)
    built = build(target, facts)
    folder = BINARIES / platform(facts)
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy2(built, folder / f"mpi_hyst_fmu{built.suffix}")


if __name__ == "__main__":
    main()
