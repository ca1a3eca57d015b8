"""Cases: drives that say little, rest, jump, or swing on one side only."""

from __future__ import annotations

from dataclasses import replace

import mpi_hyst as mh
import numpy as np
from support import Array

from odd_files.bench import BIPOLAR, CREEPING, RATE, STACK, Bench
from odd_files.case import Case, Trial
from odd_files.positions import same, then
from odd_files.texts import columns, raw, table

VOLTS = columns()
DRIVE = STACK.excitation()
GOOD = STACK.record()


def rests(at: list[int], seconds: float) -> Array:
    """Return the drive with rests before these samples."""
    return np.insert(
        DRIVE, np.repeat(at, int(seconds * RATE)), np.repeat(DRIVE[at], int(seconds * RATE))
    )


def dwelling(name: str, at: list[int], seconds: float = 5.0, bench: Bench = STACK) -> Case:
    return same(name, bench, bench.measured(rests(at, seconds)))


def ramps() -> Array:
    """Return ramps of equal length between random levels."""
    levels = np.r_[0.0, 150.0, 0.0, np.random.default_rng(4).uniform(0.0, 150.0, 58)]
    return np.interp(np.arange(2400) / 40.0, np.arange(levels.size), levels)


def chirp() -> Array:
    return mh.signals.chirp(75.0, 0.2, 3.0, seconds=15.0, rate=RATE, center=75.0)


LAST = DRIVE.size - 1
ONE_SIDE = replace(BIPOLAR, name="one side", low=0.0)
RESTS = [
    dwelling("a rest at the beginning", [0]),
    dwelling("a rest at a reversal", [200]),
    dwelling("a rest at the end", [LAST]),
    dwelling("rests everywhere", [0, 200, 400, 555, 700, 900, LAST], 3.0),
    dwelling("a rest of a creeping stage", [150, 600], 5.0, CREEPING),
    then("a constant drive", replace(GOOD, u=np.full_like(GOOD.u, 42.0)), ["column drive_v"], GOOD),
    then(
        "a constant position",
        replace(GOOD, y=np.full_like(GOOD.y, 3.3)),
        ["column position_um"],
        GOOD,
    ),
]
SHAPES = [
    same("steps of random height", STACK, STACK.measured(STACK.steps(60, 20))),
    same("jumps of one sample", STACK, STACK.measured(STACK.steps(600, 2))),
    same("a chirp", STACK, STACK.measured(chirp())),
    same(
        "a decaying triangle",
        BIPOLAR,
        BIPOLAR.measured(mh.signals.decaying_triangle(500.0, 0.5, cycles=8, rate=RATE)),
    ),
    then(
        "one and the same sine",
        STACK.measured(STACK.sine(6)),
        ["no_minor_loops", "decaying sweep"],
        GOOD,
    ),
    then("half a loop", STACK.measured(np.linspace(0.0, 150.0, 400)), ["no_minor_loops"], GOOD),
    same("a drive on one side of a bipolar stage", ONE_SIDE, ONE_SIDE.record()),
    same("random ramps", STACK, STACK.measured(ramps())),
    same("one hundred sines and a sweep", STACK, STACK.measured(np.r_[DRIVE, STACK.sine(60, 80)])),
]
SIZES = [
    then("thirty samples", GOOD.at(slice(0, None, GOOD.u.size // 30)), ["too_few_samples"], GOOD),
    then("two samples", GOOD.at(slice(0, 2)), ["error"], GOOD),
    same("every tenth sample", STACK, GOOD.at(slice(0, None, 10))),
    same("forty thousand samples", STACK, STACK.measured(STACK.excitation(6, 6000.0), 6000.0)),
]


def of_columns() -> list[Case]:
    """Make cases about more columns than two."""
    rows = table([GOOD.t, GOOD.u, GOOD.y, 20.0 + 1e-3 * GOOD.t])
    write = raw(f"time_s,drive_v,position_um,temperature_c\n{rows}".encode())
    return [
        Case(
            "the temperature as the position",
            STACK,
            Trial(write, columns("drive_v", "temperature_c")),
            ["red"],
            Trial(write, VOLTS),
        ),
        Case(
            "the time as the drive",
            STACK,
            Trial(write, columns("time_s", "position_um")),
            ["red"],
            Trial(write, VOLTS),
        ),
        Case(
            "a column that is not there",
            STACK,
            Trial(write, columns("drive", "position_um")),
            ["the columns are"],
            Trial(write, VOLTS),
        ),
        Case(
            "one column twice",
            STACK,
            Trial(write, columns("drive_v", "drive_v")),
            ["both are"],
            Trial(write, VOLTS),
        ),
        Case(
            "drive as position by number",
            STACK,
            Trial(write, columns("2", "1")),
            ["loop_backwards"],
            Trial(write, columns("1", "2")),
        ),
    ]


CASES = [*RESTS, *SHAPES, *SIZES, *of_columns()]
