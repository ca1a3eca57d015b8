"""Cells that begin with `%%shell` are shown as what one types into a shell, without that line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from docutils import nodes

if TYPE_CHECKING:
    from sphinx.application import Sphinx

MAGIC = "%%shell\n"


def show_as_shell(_app: Sphinx, doctree: nodes.document) -> None:
    """Take the line away where a page was read: its cells ran before that."""
    for block in doctree.findall(nodes.literal_block):
        if block.astext().startswith(MAGIC):
            block.rawsource = block.astext().removeprefix(MAGIC)
            block.children = []
            block += nodes.Text(block.rawsource)
            block["language"] = "bash"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the change."""
    app.connect("doctree-read", show_as_shell)
    return {"version": "1", "parallel_read_safe": True}
