"""The files of the package: imports run one way, none is too long, and what modules show."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import TypeVar

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
    "mpi_hyst_command": {"_cli"},
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


File = TypeVar("File")


def modules() -> dict[str, Path]:
    """The Python files by the names of their modules."""
    found = {}
    for package in (ROOT, ROOT.with_name("mpi_hyst_command")):
        for path in sorted(package.rglob("*.py")):
            parts = path.relative_to(ROOT.parent).with_suffix("").parts
            found[".".join(parts).removesuffix(".__init__")] = path
    assert "mpi_hyst_command.interrupted" in found
    return found


MODULES = modules()


@functools.cache
def imports(name: str) -> frozenset[str]:
    """The modules of the package that a module imports, at its top or later.

    `import mpi_hyst as mh` is not among them: commands and the paper use the library by its face.
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
    return frozenset(found & set(MODULES))


def room(name: str) -> str:
    package, first, *_ = (*name.split("."), "")
    return first if package == "mpi_hyst" else package


def reached_from(file: File, near: Mapping[File, set[File]]) -> set[File]:
    """All that a file imports, and what that imports, and so on."""
    reached, pending = set(), near[file]
    while pending:
        reached |= pending
        pending = {further for one in pending for further in near[one]} - reached
    return reached


@pytest.mark.parametrize("name", MODULES)
def test_imports_run_one_way(name: str) -> None:
    assert name not in reached_from(name, {one: set(imports(one)) for one in MODULES})
    private = {room(one) for one in imports(name)} & set(MAY_IMPORT)
    assert private <= {**MAY_IMPORT, **FACE}.get(room(name), set())


def test_what_the_face_is_made_of_does_not_import_the_face() -> None:
    def uses_the_face(name: str) -> bool:
        nodes = ast.walk(ast.parse(MODULES[name].read_text("utf-8")))
        names = [one.name for node in nodes if isinstance(node, ast.Import) for one in node.names]
        return "mpi_hyst" in names

    behind = reached_from("mpi_hyst", {one: set(imports(one)) for one in MODULES})
    assert "mpi_hyst._report.models" in behind
    assert [one for one in sorted(behind) if uses_the_face(one)] == []


# A module of Rust by the names on the way to it: ("crate", "engine", "lookup").
Module = tuple[str, ...]
USE = re.compile(r"^\s*(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);", re.MULTILINE)


def paths(tree: str) -> Iterator[tuple[Module, str]]:
    """What a tree behind `use` names: each path, and what it is called here."""
    head, brace, rest = tree.strip().partition("{")
    if not brace:
        known, _, alias = head.partition(" as ")
        parts = tuple(known.strip().split("::"))
        yield parts, alias.strip() or parts[-1]
        return
    first = tuple(head.split("::")[:-1])
    inner, depth, start = rest.rpartition("}")[0] + ",", 0, 0
    for place, mark in enumerate(inner):
        depth += (mark == "{") - (mark == "}")
        if mark != "," or depth > 0:
            continue
        branch, start = inner[start:place], place + 1
        for path, name in paths(branch) if branch.strip() else ():
            own = path[1:] if path[0] == "self" else path
            yield (*first, *own), first[-1] if name == "self" else name


class Crate:
    """The files of a crate, by module, and what each uses of the others."""

    def __init__(self, source: Path) -> None:
        self.files: dict[Module, Path] = {}
        for path in sorted(source.rglob("*.rs")):
            parts = ("crate", *path.relative_to(source).with_suffix("").parts)
            self.files[parts[:-1] if parts[-1] in ("mod", "lib", "main") else parts] = path
        self.used: dict[Module, set[Module]] = {}
        self.handed_on: dict[Module, dict[str, Module]] = {("crate",): {}}
        for module, path in self.files.items():
            self.read(module, path.read_text("utf-8"))

    def read(self, module: Module, text: str) -> None:
        # Tests may use what they like.
        text = re.sub(r"//[^\n]*", "", text).split("#[cfg(test)]\nmod ")[0]
        used = {tuple(one.split("::")) for one in re.findall(r"\bcrate(?:::\w+)+", text)}
        handed_on = self.handed_on.setdefault(module, {})
        for public, tree in USE.findall(text):
            for path, name in paths(tree):
                whole = self.whole(path, module)
                used.add(whole)
                if public:
                    handed_on[name] = whole
        self.used[module] = used

    def whole(self, path: Module, module: Module) -> Module:
        """The path from the root of the crate on; of another crate as it is."""
        if path[0] == "self":
            return (*module, *path[1:])
        above = next(count for count, part in enumerate((*path, "")) if part != "super")
        if above > 0:
            return (*module[:-above], *path[above:])
        return (*module, *path) if (*module, path[0]) in self.files else path

    def file_of(self, path: Module, seen: tuple[Module, ...] = ()) -> Module | None:
        """The file in which a path ends, through all that hands it on."""
        parts = (path[:count] for count in range(len(path), 0, -1))
        known = next((part for part in parts if part in self.files), None)
        if known is None:
            return None
        rest = path[len(known) :]
        if rest and rest[0] in self.handed_on[known] and path not in seen:
            return self.file_of((*self.handed_on[known][rest[0]], *rest[1:]), (*seen, path))
        return known

    def near(self) -> dict[Module, set[Module]]:
        """What each file uses. A child may use what stands in the files of the folders above."""
        found = {}
        for module, used in self.used.items():
            ends = (self.file_of(path) for path in used)
            found[module] = {end for end in ends if end and end != module[: len(end)]}
        return found


@pytest.mark.parametrize(
    "source",
    sorted(path for folder in ("crates", "checks") for path in CHECKOUT.glob(f"{folder}/*/src")),
    ids=lambda path: path.parent.name,
)
def test_files_of_a_crate_use_each_other_one_way(source: Path) -> None:
    near = Crate(source).near()
    assert [one for one in near if one in reached_from(one, near)] == []


def test_circles_are_found(tmp_path: Path) -> None:
    files = {
        "lib.rs": "mod a;\nmod b;\npub use b::{self as renamed, inner::Deep};",
        "a.rs": "use std::fmt;\nuse crate::{Deep, renamed as b};\npub struct A;",
        "b/mod.rs": "mod inner;\npub struct B;",
        "b/inner.rs": "use super::B; // use super::super::a::A;\npub struct Deep;",
    }
    (tmp_path / "b").mkdir()
    for name, text in files.items():
        (tmp_path / name).write_text(text, "utf-8")
    a, inner = ("crate", "a"), ("crate", "b", "inner")
    near = Crate(tmp_path).near()
    assert near[a] == {("crate", "b"), inner} and near[inner] == set()
    for use in (
        "use super::super::a::A;",
        "use crate::{b::B, a::{self, A}};",
        "fn f(_: crate::a::A) {}",
    ):
        (tmp_path / "b" / "inner.rs").write_text(use, "utf-8")
        near = Crate(tmp_path).near()
        assert {one for one in near if one in reached_from(one, near)} == {a, inner}


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
