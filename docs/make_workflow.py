"""Writes the workflow that builds and publishes a release: `make workflow`.

maturin generates it from `[tool.maturin.generate-ci.github]` of pyproject.toml. What it cannot be
told there is changed here: when it runs, the units that a wheel holds, and a try of each wheel.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / ".github" / "workflows" / "release.yml"
_MANIFEST = "crates/hysteresis-python/Cargo.toml"
_HEAD = """name: Release

on:
  push:
    tags:
      - 'v*'
  workflow_dispatch:
"""
_GENERATED_HEAD = re.compile(r"^name: CI\n\non:\n(?:  .*\n)+", re.MULTILINE)
_FREE_THREADED = re.compile(
    r"(?:      - uses: actions/setup-python@\S+\n"
    r"        with:\n"
    r"          python-version: \"3\.\d+t\"\n"
    r"(?:          architecture: .*\n)?)?"
    r"      - name: Build free-threaded wheels\n"
    r"(?:        .*\n)+"
)
_UNITS = """      - name: Build the library of units
        shell: bash
        run: python docs/make_units.py
"""
_TRY = """      - name: Try the wheel
        if: ${{ matrix.platform.target != 'aarch64' || runner.arch == 'ARM64' }}
        shell: bash
        run: |
          python tests/check_wheel.py dist/*.whl "$PWD"
          python -m pip install "$(ls dist/*.whl)[cli,report]"
          cd "$RUNNER_TEMP" && mpi-hyst demo
"""


def generated() -> str:
    """Return what maturin makes of pyproject.toml."""
    command = ["maturin", "generate-ci", "github", "--manifest-path", _MANIFEST]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def changed(workflow: str) -> str:
    """Return the workflow that this project needs."""
    workflow = re.sub(r"#    maturin generate-ci .*", "#    make workflow", workflow, count=1)
    workflow = _GENERATED_HEAD.sub(_HEAD, workflow, count=1)
    # No interpreter without a lock has run the tests.
    workflow = _FREE_THREADED.sub("", workflow)
    jobs = re.split(r"(?m)^(?=  \w+:$)", workflow)
    return "".join(map(_job, jobs))


def _job(text: str) -> str:
    name = text.split(":", 1)[0].strip()
    if name in {"windows", "macos"}:  # on Linux the script in front of maturin builds them
        text = text.replace("      - name: Build wheels\n", _UNITS + "      - name: Build wheels\n")
    if name in {"linux", "windows", "macos"}:
        text = text.replace("      - name: Upload wheels\n", _TRY + "      - name: Upload wheels\n")
    return text


if __name__ == "__main__":
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text(changed(generated()), "utf-8")
