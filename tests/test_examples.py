"""The files of `examples`: short, each with a test, and said to be for something."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
EXAMPLES = sorted((CHECKOUT / "examples").glob("*.py"))
LONGEST = 60  # lines


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_documented_and_tested(path: Path) -> None:
    text = path.read_text("utf-8")
    assert len(text.splitlines()) <= LONGEST
    assert len(ast.get_docstring(ast.parse(text)) or "") > 50
    tests = (CHECKOUT / "tests").glob("test_example_*.py")
    assert any(path.stem in test.read_text("utf-8") for test in tests)


def test_all_examples_are_there() -> None:
    assert {path.stem for path in EXAMPLES} == {
        *("load_cell", "many_with_dask", "many_with_joblib", "support_stage", "with_bluesky"),
        *("with_control", "with_hcipy", "with_nidaqmx", "with_pipython", "with_pymmcore"),
        *("with_qudi", "with_softioc", "with_tables", "with_tango"),
    }
