"""Prints the oldest versions of what the package needs that it allows: `make lowest`."""

from __future__ import annotations

import re
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent / "pyproject.toml"


def lowest(text: str) -> list[str]:
    """Return constraints for pip, one for each package with a lower bound.

    >>> lowest('dependencies = ["numpy>=1.24"]')
    ['numpy==1.24']
    """
    needs = re.search(r"(?m)^dependencies = \[.*\]$", text)
    extras = re.search(r"(?ms)^\[project\.optional-dependencies\]\n(.*?)\n\n", text + "\n\n")
    lines = (needs[0] if needs else "") + (extras[1] if extras else "")
    return sorted({one.replace(">=", "==") for one in re.findall(r"[\w.-]+>=[\d.]+", lines)})


if __name__ == "__main__":
    sys.stdout.write("\n".join([*lowest(PROJECT.read_text("utf-8")), ""]))
