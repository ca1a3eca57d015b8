"""Docstrings of the compiled core as reStructuredText: tables of the Rust documentation become tables here."""

from __future__ import annotations

import re
from typing import Any

RULE = re.compile(r"^\|( *:?-+:? *\|)+$")


def table(rows: list[list[str]]) -> list[str]:
    """Return rows as a table that keeps what stands in its cells as it is written."""
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in rows:
        lines += [f"   {'* -' if first else '  -'} ``{cell}``" if cell else f"   {'* -' if first else '  -'}"
                  for first, cell in zip([True, *[False] * len(row)], row, strict=False)]
    return ["", *lines, ""]


def with_tables(lines: list[str]) -> list[str]:
    """Return a docstring with every table of bars rewritten."""
    made: list[str] = []
    rows: list[list[str]] = []
    for line in [*lines, ""]:
        bare = line.strip()
        if bare.startswith("|") and bare.endswith("|") and len(bare) > 1:
            if not RULE.match(bare):
                rows.append([cell.strip() for cell in bare[1:-1].split("|")])
            continue
        if rows:
            made += table(rows)
            rows = []
        made.append(line)
    return made[:-1]


def process(_app: Any, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """Rewrite a docstring in place, before numpydoc reads its sections."""
    lines[:] = with_tables(lines)


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx; numpydoc has the priority 500."""
    app.connect("autodoc-process-docstring", process, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
