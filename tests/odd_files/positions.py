"""Cases: positions of other units, of the wrong sign, late, drifting, coarse or noisy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support import Array

from odd_files.bench import BIPOLAR, CREEPING, MAGNET, NANO, RATE, STACK, TUBE, Bench, Record
from odd_files.case import Case, Trial
from odd_files.texts import columns, text

HEADER = "time_s,drive_v,position_um"
VOLTS = columns()
RECORD = STACK.record()
SPAN = RECORD.span


def same(
    name: str,
    bench: Bench,
    record: Record,
    header: str = HEADER,
    scale: tuple[float, float] = (1.0, 1.0),
) -> Case:
    """Make a case that must give a right model at once."""
    _, drive, position = header.split(",")
    return Case(name, bench, Trial(text(record, header), columns(drive, position), scale))


def hinted(name: str, record: Record, *says: str, bench: Bench = STACK) -> Case:
    """Make a case whose hints spell out the options that lead to a right model."""
    return Case(name, bench, Trial(text(record), VOLTS), says, "hint")


def then(name: str, record: Record, says: list[str], other: Record, bench: Bench = STACK) -> Case:
    """Make a case that needs another record, or another file of it."""
    return Case(name, bench, Trial(text(record), VOLTS), says, Trial(text(other), VOLTS))


def wrong_sign(bench: Bench, header: str) -> Case:
    record = bench.record()
    _, drive, position = header.split(",")
    trial = Trial(text(replace(record, y=-record.y), header), columns(drive, position))
    return Case(f"wrong sign, {bench.name}", bench, trial, ["wrong_sign"], "hint")


def swapped(bench: Bench, sign: float = 1.0) -> Case:
    record = bench.record()
    write = text(replace(record, y=sign * record.y), "time_s,a,b")
    more = [] if sign > 0.0 else ["--negate-output"]
    name = f"columns swapped, {bench.name}{', and turned' if more else ''}"
    return Case(
        name,
        bench,
        Trial(write, columns("b", "a")),
        ["loop_backwards", "swapped"],
        Trial(write, [*columns("a", "b"), *more]),
    )


def spread(values: Array, by: int) -> Array:
    """Return a signal later by so many samples."""
    moved: Array = np.roll(values, by)
    if by > 0:
        moved[:by] = values[0]
    else:
        moved[by:] = values[-1]
    return moved


def early(rows: int) -> Case:
    """Make a case whose position was read rows later than its drive."""
    record = RECORD.spoilt(lambda y: spread(y, -rows))
    says = ["negative_dead_time", f"down by {rows} rows"]
    return then(f"a position {rows} rows early", record, says, RECORD)


def apart(rows: int) -> Case:
    """Make a case whose two instruments did not begin together."""
    late = STACK.measured(np.r_[np.zeros(rows), STACK.excitation()])
    torn = replace(RECORD, y=late.y[: RECORD.u.size])
    says = ["implausible_dead_time", f"up by {rows} rows"]
    return then(f"a position {rows} rows late", torn, says, RECORD)


SIGNS = [
    wrong_sign(STACK, HEADER),
    wrong_sign(NANO, "time_s,drive_v,position_nm"),
    wrong_sign(MAGNET, "time_s,current_a,field_mt"),
    wrong_sign(BIPOLAR, HEADER),
    swapped(STACK),
    swapped(BIPOLAR),
    swapped(MAGNET),
    swapped(MAGNET, -1.0),
    then(
        "time reversed, without a clock",
        replace(RECORD.at(slice(None, None, -1)), t=RECORD.t),
        ["loop_backwards", "reverse the rows"],
        RECORD,
    ),
    early(1),
    early(2),
    early(5),
    early(20),
    apart(60),
    same("a late sensor", replace(STACK, dead_time=0.015), RECORD.spoilt(lambda y: spread(y, 3))),
]
GAUGE = RECORD.spoilt(lambda y: 1000.0 * y - 4e4)
COUNTS = RECORD.spoilt(lambda y: np.round(3000.0 * y + 8000.0))
KILO = BIPOLAR.record().spoilt(lambda u: u / 1000.0, "u")
UNITS = [
    same("millimetres", TUBE, TUBE.record(), "time_s,drive_v,position_mm"),
    same("nanometres on a large offset", NANO, NANO.record(), "time_s,drive_v,position_nm"),
    same("millivolts of a gauge", STACK, GAUGE, "time_s,drive_v,gauge_mv", (1.0, 1000.0)),
    same("kilovolts", BIPOLAR, KILO, "time_s,drive_kv,position_um", (1e-3, 1.0)),
    same("current and field", MAGNET, MAGNET.record(), "time_s,current_a,field_mt"),
    same("counts of a converter", STACK, COUNTS, "time_s,drive_v,adc", (1.0, 3000.0)),
    same(
        "metres", STACK, RECORD.spoilt(lambda y: 1e-6 * y), "time_s,drive_v,position_m", (1.0, 1e-6)
    ),
]


def more(name: str, added: Array, record: Record = RECORD) -> Case:
    """Make a case of a position with something added, a share of its range."""
    return same(name, STACK, replace(record, y=record.y + record.span * added))


def held(values: Array, every: int) -> Array:
    """Return a signal that is updated once in so many samples."""
    return values[np.arange(values.size) // every * every]


def coarse(bits: int) -> Record:
    """Return the record of a converter of few bits."""
    step = SPAN / (2**bits - 1)
    return RECORD.spoilt(lambda y: step * np.round(y / step))


T = RECORD.t
FAST = STACK.record(1000.0)
NOISE = np.random.default_rng(8).normal(size=T.size)
SLOW = [
    more("linear drift", 0.03 * T / T[-1]),
    more("warming up", 0.05 * (1.0 - np.exp(-T / 3.0))),
    more("a swaying floor", 0.02 * np.sin(0.7 * T)),
    same("creep", CREEPING, CREEPING.record()),
]
COARSE = [
    same("eight bits", STACK, coarse(8)),
    same("five bits", STACK, coarse(5)),
    more("noise of 3 %", 0.03 * NOISE),
    more("hum of 50 Hz", 0.02 * np.sin(2.0 * np.pi * 50.0 * FAST.t), FAST),
    more("aliased hum", 0.02 * np.sin(2.0 * np.pi * 50.3 * T)),
    same("a sensor four times slower than the file", STACK, RECORD.spoilt(lambda y: held(y, 4))),
    same("the drive held for four rows", STACK, STACK.measured(held(STACK.excitation(), 4))),
    then("noise alone", replace(RECORD, y=NOISE), ["red", "unrelated"], RECORD),
    then("another channel", replace(RECORD, y=20.0 + np.cumsum(NOISE)), ["red"], RECORD),
]
CASES = [*SIGNS, *UNITS, *SLOW, *COARSE]
RATES = (RATE,)
