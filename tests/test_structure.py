"""The files of the Python package: imports run one way, and no file is too long to read."""

from __future__ import annotations

import ast
from pathlib import Path

import mpi_hyst as mh
import pytest

ROOT = Path(mh.__file__).parent
CHECKOUT = Path(__file__).parents[1]
LONGEST = 400  # lines
# What a package may import; the modules of the library itself import the compiled one alone.
MAY_IMPORT = {
    "_cli": {"_cli", "_report", "_paper", "_io", "_fmu"},
    "_report": {"_report", "_paper"},
    "_paper": {"_paper"},
    "_io": {"_io"},
    "_fmu": {"_fmu"},
}
PUBLIC = {
    "datasets": {"_io"},
    "export": {"_fmu"},
    "io": {"_io"},
    "plot": {"_report"},
    "reports": {"_report"},
}


def modules() -> dict[str, Path]:
    """The Python files by the names of their modules."""
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = ["mpi_hyst", *path.relative_to(ROOT).with_suffix("").parts]
        found[".".join(parts).removesuffix(".__init__")] = path
    return found


MODULES = modules()


def imports(name: str) -> set[str]:
    """The modules of the package that a module imports, at its top or later."""
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mpi_hyst"):
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                found.add(full if full in MODULES else str(node.module))
    return found & set(MODULES)


def room(name: str) -> str:
    return (*name.split("."), "", "")[1]


@pytest.mark.parametrize("name", MODULES)
def test_imports_run_one_way(name: str) -> None:
    reached, pending = set(), imports(name)
    while pending:
        reached |= pending
        pending = {further for near in pending for further in imports(near)} - reached
    assert name not in reached
    private = {room(one) for one in imports(name)} & set(MAY_IMPORT)
    assert private <= {**MAY_IMPORT, **PUBLIC}.get(room(name), set())


@pytest.mark.parametrize(
    "folder", ["python", "tests", "examples", "docs", "crates", "checks", "benches"]
)
def test_no_file_is_too_long(folder: str) -> None:
    files = [path for end in ("py", "rs") for path in (CHECKOUT / folder).rglob(f"*.{end}")]
    lines = {str(path): len(path.read_text("utf-8").splitlines()) for path in files}
    assert files and [path for path, count in lines.items() if count > LONGEST] == []
