"""Compares what the libraries of a wheel need of Linux with its name, for `make wheel-audit`."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

_TAG = re.compile(r"following platform tag:\s+\"([^\"]+)\"")


def fault(name: str, told: str) -> str:
    """Return what auditwheel finds wrong with the name of a wheel; nothing if it is right."""
    found = _TAG.search(told)
    if found is None:
        return f"auditwheel names no platform: {told}"
    tags = Path(name).stem.rpartition("-")[2].split(".")
    return "" if found[1] in tags else f"{name}: needs {found[1]}"


if __name__ == "__main__":
    path = sys.argv[1]
    command = ["auditwheel", "show", path]
    wrong = fault(path, subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    sys.stdout.write(f"{wrong or f'{path}: needs no newer Linux than its name says'}\n")
    sys.exit(1 if wrong else 0)
