"""The list of odd inputs: every case ends in a right model, or in a hint that leads to one."""

from __future__ import annotations

from odd import defects, dialects, drives, positions, rigs, times
from odd.case import Case

CASES: list[Case] = [
    *dialects.CASES,
    *times.CASES,
    *positions.CASES,
    *drives.CASES,
    *defects.CASES,
    *rigs.CASES,
]
