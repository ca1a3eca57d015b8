"""The stub of the compiled core, which its build writes, shows an editor what help() shows."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from typing import Any

import mpi_hyst as mh
from mpi_hyst import _core

STUB = ast.parse((Path(mh.__file__).parent / "_core.pyi").read_text("utf-8"))


def described(
    nodes: list[ast.stmt], owner: Any
) -> list[tuple[str, Any, ast.ClassDef | ast.FunctionDef]]:
    """Return the public classes and functions of the stub with what they describe."""
    found = []
    for node in nodes:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            setter = any(isinstance(one, ast.Attribute) for one in node.decorator_list)
            if not setter:
                found.append((node.name, getattr(owner, node.name), node))
            if isinstance(node, ast.ClassDef):
                found += described(node.body, getattr(owner, node.name))
    return found


def test_the_docstrings_of_the_stub_are_those_of_the_core() -> None:
    wrong = [
        name
        for name, thing, node in described(STUB.body, _core)
        if (ast.get_docstring(node) or "") != inspect.cleandoc(thing.__doc__ or "").strip()
    ]
    assert not wrong


def test_every_public_name_of_the_core_is_in_the_stub() -> None:
    told = {name for name, _, node in described(STUB.body, _core)}
    assert not {name for name in dir(_core) if not name.startswith("_")} - told


def test_the_defaults_of_the_stub_are_those_that_help_shows() -> None:
    wrong = []
    for name, thing, node in described(STUB.body, _core):
        decorators = [ast.unparse(one) for one in node.decorator_list]
        if (
            not isinstance(node, ast.FunctionDef)
            or "property" in decorators
            or "overload" in decorators
        ):
            continue
        arguments = node.args
        places = [*arguments.posonlyargs, *arguments.args]
        with_default = places[len(places) - len(arguments.defaults) :]
        defaults = {
            one.arg: told for one, told in zip(with_default, arguments.defaults, strict=True)
        }
        defaults |= {
            one.arg: default
            for one, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
            if default is not None
        }
        shown = {
            one.name: one.default
            for one in inspect.signature(thing).parameters.values()
            if one.default is not inspect.Parameter.empty
        }
        if {one: ast.literal_eval(default) for one, default in defaults.items()} != shown:
            wrong.append(name)
    assert not wrong
