"""Code on the pages: no empty last lines, no hidden lines of Rust, breaks at signs only."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from docutils import nodes

if TYPE_CHECKING:
    from sphinx.application import Sphinx

SHORT = 26  # characters: at 500 px two such words fit beside each other
# A capital within a name, or behind a sign: places at which a long name may be broken.
BREAK = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[_./:=(,\[])(?=\w)")


def shown(block: nodes.literal_block) -> str:
    """Return what a reader sees of a block: rustdoc hides lines that begin with a sharp."""
    lines = block.astext().rstrip().splitlines()
    if block.get("language") == "rust":
        lines = [line for line in lines if line != "#" and not line.startswith("# ")]
    return "\n".join(lines)


def let_break(word: nodes.literal) -> None:
    """Let a long name be broken: in a narrow column it would take the room of all others."""
    pieces = BREAK.split(word.astext())
    word.children = []
    word += nodes.Text(pieces[0])
    for piece in pieces[1:]:
        word += [nodes.raw("", "<wbr>", format="html"), nodes.Text(piece)]


def tidy(_app: Sphinx, doctree: nodes.document) -> None:
    """Rewrite the blocks of a page that was read, and mark short code within sentences."""
    for block in doctree.findall(nodes.literal_block):
        if block.rawsource == block.astext() and (text := shown(block)) != block.rawsource:
            block.rawsource = text
            block.children = []
            block += nodes.Text(text)
    for word in doctree.findall(nodes.literal):
        if len(word.astext()) <= SHORT:
            word["classes"].append("short")
    for table in doctree.findall(nodes.table):
        for word in table.findall(nodes.literal):
            if len(word.astext()) > SHORT:
                let_break(word)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the change, behind that of cells for a shell."""
    app.connect("doctree-read", tidy, priority=600)
    return {"version": "1", "parallel_read_safe": True}
