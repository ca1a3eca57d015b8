"""Copy the docstrings of the compiled core into its stub, where an editor finds them.

python docs/make_stub.py            writes python/mpi_hyst/_core.pyi anew
python docs/make_stub.py --check    exits with 1 and says so if that would change it
"""

from __future__ import annotations

import ast
import inspect
import sys
from pathlib import Path
from typing import Any

from mpi_hyst import _core

STUB = Path(__file__).parent.parent / "python" / "mpi_hyst" / "_core.pyi"


def edits(tree: ast.Module) -> list[tuple[ast.stmt, str]]:
    """Return every class and function of the stub with the docstring of what it describes."""
    found: list[tuple[ast.stmt, str]] = []

    def visit(nodes: list[ast.stmt], owner: Any) -> None:
        for node in nodes:
            if not isinstance(node, ast.ClassDef | ast.FunctionDef) or node.name.startswith("_"):
                continue
            described = getattr(owner, node.name)
            setter = any(isinstance(one, ast.Attribute) for one in node.decorator_list)
            if described.__doc__ and not setter:
                found.append((node, inspect.cleandoc(described.__doc__)))
            if isinstance(node, ast.ClassDef):
                visit(node.body, described)

    visit(tree.body, _core)
    return found


def quoted(text: str, indent: str) -> str:
    """Return the docstring as source."""
    lines = [f"{indent}{line}".rstrip() for line in text.splitlines()]
    first = lines[0].strip()
    # A quote would be a fourth one.
    first = f" {first}" if first.startswith('"') else first
    lines[0] = f'{indent}{"r" if chr(92) in text else ""}"""{first}'
    if len(lines) > 1 or text.endswith('"'):
        lines.append(f'{indent}"""')
    else:
        lines[0] += '"""'
    return "\n".join(lines)


def is_placeholder(node: ast.stmt) -> bool:
    """Whether a statement is `...` or a docstring."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and (node.value.value is Ellipsis or isinstance(node.value.value, str))
    )


def with_docstrings(stub: str) -> str:
    """Return the stub with the docstrings of the compiled core in place of any it has."""
    tree = ast.parse(stub)
    starts = [0]
    for line in stub.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node, text in sorted(edits(tree), key=lambda edit: edit[0].lineno, reverse=True):
        assert isinstance(node, ast.ClassDef | ast.FunctionDef)
        first = node.body[0]
        indent = " " * (node.col_offset + 4)
        # Everything is ASCII, so that columns are characters. Decorators stand before a definition.
        begin = first.lineno
        if isinstance(first, ast.ClassDef | ast.FunctionDef) and first.decorator_list:
            begin = first.decorator_list[0].lineno
        start = starts[begin - 1] + first.col_offset
        head, rest = stub[:start].rstrip(), stub[start:]
        if is_placeholder(first):
            assert first.end_lineno is not None and first.end_col_offset is not None
            rest = stub[starts[first.end_lineno - 1] + first.end_col_offset :]
            stub = f"{head}\n{quoted(text, indent)}{rest}"
        else:
            stub = f"{head}\n{quoted(text, indent)}\n\n{indent}{rest}"
    return stub


def main(arguments: list[str]) -> int:
    """Write or check the stub."""
    stub = STUB.read_text("utf-8")
    made = with_docstrings(stub)
    if made == stub:
        return 0
    if arguments == ["--check"]:
        sys.stderr.write(f"{STUB.name}: its docstrings are not those of the core: make stub\n")
        return 1
    STUB.write_text(made, "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
