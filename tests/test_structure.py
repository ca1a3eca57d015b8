"""The files of the package: imports run one way, none is too long, and what modules show."""

from __future__ import annotations

import ast
from pathlib import Path
from types import ModuleType

import mpi_hyst as mh
import pytest

ROOT = Path(mh.__file__).parent
CHECKOUT = Path(__file__).parents[1]
LONGEST = 700  # lines
# What a package may import; the modules of the library itself import the compiled one alone.
MAY_IMPORT = {
    "_cli": {"_cli", "_report", "_paper", "_io", "_fmu"},
    "_report": {"_report", "_paper"},
    "_paper": {"_paper"},
    "_io": {"_io"},
    "_fmu": {"_fmu"},
}
FACE = {
    "_arguments": {"_report"},
    "datasets": {"_io"},
    "export": {"_fmu"},
    "io": {"_io"},
    "plot": {"_report"},
    "reports": {"_report"},
}
# Of a command, its file and one for a part that has an idea of its own.
COMMANDS = {"identify": {"identify_records"}, "look": {"identify_records"}}
SHARED = {"inputs", "options", "outputs", "stage", "terminal"}


def modules() -> dict[str, Path]:
    """The Python files by the names of their modules."""
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = ["mpi_hyst", *path.relative_to(ROOT).with_suffix("").parts]
        found[".".join(parts).removesuffix(".__init__")] = path
    return found


MODULES = modules()


def imports(name: str) -> set[str]:
    """The modules of the package that a module imports, at its top or later.

    `import mpi_hyst as mh` is not among them: what is private uses the whole library by its face.
    """
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, "expected imports by the whole name"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                found.add(full if full in MODULES else str(node.module))
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name != "mpi_hyst"}
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
    assert private <= {**MAY_IMPORT, **FACE}.get(room(name), set())


@pytest.mark.parametrize("name", [name for name in MODULES if name.startswith("mpi_hyst._cli.")])
def test_commands_share_no_more_than_they_say(name: str) -> None:
    own = name.rsplit(".", 1)[1]
    if own in ("commands", "__main__"):
        return
    near = {one.rsplit(".", 1)[1] for one in imports(name) if one.startswith("mpi_hyst._cli.")}
    assert near <= SHARED | COMMANDS.get(own, set())


@pytest.mark.parametrize(
    "name", ["", *(n for n in mh.__all__ if isinstance(getattr(mh, n), ModuleType))]
)
def test_modules_show_what_they_document(name: str) -> None:
    module = getattr(mh, name) if name else mh
    shown = [one for one in dir(module) if not one.startswith("_")]
    assert shown == sorted(one for one in module.__all__ if not one.startswith("_"))


@pytest.mark.parametrize(
    "folder", ["python", "tests", "examples", "docs", "crates", "checks", "benches"]
)
def test_no_file_is_too_long(folder: str) -> None:
    files = [path for end in ("py", "rs") for path in (CHECKOUT / folder).rglob(f"*.{end}")]
    lines = {str(path): len(path.read_text("utf-8").splitlines()) for path in files}
    assert files and [path for path, count in lines.items() if count > LONGEST] == []
