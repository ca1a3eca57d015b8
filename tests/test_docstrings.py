"""Every public object is documented, and the examples of the documentation run as they stand."""

from __future__ import annotations

import doctest
import inspect
from types import ModuleType
from typing import Any

import mpi_hyst as mh
import pytest

MODULES = [mh, *(one for name in mh.__all__ if isinstance(one := getattr(mh, name), ModuleType))]


def public_objects() -> dict[str, Any]:
    """Classes and functions that users can name, by their name: no modules, no version."""
    found: dict[str, Any] = {}
    for module in MODULES:
        for name in module.__all__:
            value = getattr(module, name)
            if not isinstance(value, ModuleType | str):
                prefix = module.__name__.removeprefix("mpi_hyst").lstrip(".")
                found[f"{prefix}.{name}".lstrip(".")] = value
    return found


def members() -> dict[str, Any]:
    """Methods and properties of the public classes; dunders are Python's own."""
    return {
        f"{owner}.{name}": getattr(value, name)
        for owner, value in PUBLIC.items()
        if inspect.isclass(value) and not issubclass(value, BaseException)
        for name in sorted(vars(value))
        if not name.startswith("_")
    }


PUBLIC = public_objects()
MEMBERS = members()
DOCUMENTED = {**{module.__name__: module for module in MODULES}, **PUBLIC, **MEMBERS}


def examples(name: str) -> doctest.DocTest:
    text = inspect.getdoc(DOCUMENTED[name]) or ""
    return doctest.DocTestParser().get_doctest(text, {}, name, None, None)


def failures(test: doctest.DocTest) -> tuple[int, str]:
    report: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=report.append, clear_globs=True)
    return result.failed, "".join(report)


@pytest.mark.parametrize("name", DOCUMENTED)
def test_has_a_docstring_of_its_own(name: str) -> None:
    text = inspect.getdoc(DOCUMENTED[name])
    assert text and text.strip()
    # staticmethod's own documentation is not the method's
    assert text != inspect.getdoc(staticmethod) and text != inspect.getdoc(object)


@pytest.mark.parametrize("name", sorted(PUBLIC))
def test_has_an_examples_section(name: str) -> None:
    text = inspect.getdoc(DOCUMENTED[name]) or ""
    assert "\nExamples\n--------\n" in text
    assert examples(name).examples


@pytest.mark.parametrize("name", [name for name in DOCUMENTED if examples(name).examples])
def test_examples_run_as_they_stand(name: str) -> None:
    failed, report = failures(examples(name))
    assert failed == 0, report


def test_a_wrong_example_is_found() -> None:
    parser = doctest.DocTestParser()
    wrong = parser.get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, None)
    assert failures(wrong)[0] == 1


def test_all_names_are_covered() -> None:
    assert {"Play", "identify", "paper.table_1", "signals.sine", "export.fmu"} <= set(PUBLIC)
    assert {"Forward.state", "Play.step", "ModifiedPrandtlIshlinskii.from_ratios"} <= set(MEMBERS)
    for module in MODULES:
        assert sorted(module.__all__) == sorted(set(module.__all__))


@pytest.mark.parametrize("name", [n for n, value in PUBLIC.items() if inspect.isbuiltin(value)])
def test_functions_show_their_signature(name: str) -> None:
    parameters = inspect.signature(PUBLIC[name]).parameters
    text = inspect.getdoc(PUBLIC[name]) or ""
    for parameter in parameters:
        assert parameter in text, f"{name} does not describe {parameter}"
