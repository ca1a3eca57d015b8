"""Docstrings of the compiled core as reStructuredText: tables and signs are rewritten."""

from __future__ import annotations

import re
from typing import Any

RULE = re.compile(r"^\|( *:?-+:? *\|)+$")
# Sphinx would look for any object of that name, in all modules.
ATTRIBUTE = re.compile(r"(?<!`)`(\.\w+)`(?!`)")


def table(rows: list[list[str]]) -> list[str]:
    """Return rows as a table that keeps what stands in its cells as it is written."""
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in rows:
        starts = ["   * -", *["     -"] * (len(row) - 1)]
        lines += [f"{start} ``{cell}``" for start, cell in zip(starts, row, strict=True)]
    return ["", *lines, ""]


def with_tables(lines: list[str]) -> list[str]:
    """Return a docstring with every table of bars rewritten."""
    made: list[str] = []
    rows: list[list[str]] = []
    for line in [*lines, ""]:
        bare = line.strip()
        if bare.startswith("| ") and bare.endswith(" |"):
            if not RULE.match(bare):
                rows.append([cell.strip() for cell in bare[1:-1].split("|")])
            continue
        if rows:
            made += table(rows)
            rows = []
        made.append(line)
    return made[:-1]


def with_plain_signs(lines: list[str]) -> list[str]:
    """Return a docstring whose bars and stars are signs; examples stay as they are."""
    made = []
    example = False
    for line in lines:
        example = (example and bool(line.strip())) or line.lstrip().startswith(">>>")
        parts = [line] if example else re.split(r"(`+[^`]*`+)", line)
        made.append(
            "".join(
                part if example or i % 2 else re.sub(r"\||\*(?=\.)", r"\\\g<0>", part)
                for i, part in enumerate(parts)
            )
        )
    return made


def process(
    _app: Any, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]
) -> None:
    """Rewrite a docstring in place, before numpydoc reads its sections."""
    plain = with_tables(with_plain_signs_outside_tables(lines))
    lines[:] = [ATTRIBUTE.sub(r"``\1``", line) for line in plain]


def with_plain_signs_outside_tables(lines: list[str]) -> list[str]:
    """Return a docstring with plain signs in all lines but those of tables."""
    rows = {i for i, line in enumerate(lines) if line.strip().startswith("| ")}
    plain = with_plain_signs(lines)
    return [line if i in rows else plain[i] for i, line in enumerate(lines)]


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx; numpydoc has the priority 500."""
    app.connect("autodoc-process-docstring", process, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
