"""Odd inputs through the command line: a right model, or a verdict whose hint leads to one."""

from __future__ import annotations

from pathlib import Path

import pytest
from odd_files import defects, dialects, drives, positions, rigs, times
from odd_files.case import Case, check

CASES: list[Case] = [
    *dialects.CASES,
    *times.CASES,
    *positions.CASES,
    *drives.CASES,
    *defects.CASES,
    *rigs.CASES,
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_odd_input_ends_well(tmp_path: Path, case: Case) -> None:
    check(case, tmp_path)


def test_the_list_is_long_and_says_each_thing_once() -> None:
    names = [case.name for case in CASES]
    assert len(names) >= 60 and len(set(names)) == len(names)
