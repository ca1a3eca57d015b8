"""Cases: clocks in other units, with gaps, jitter, restarts, and several rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support import Array

from odd_files.bench import LATE, MAGNET, RATE, STACK, Bench, Record
from odd_files.case import WITH_DYNAMICS, Case, Trial
from odd_files.texts import both, columns, text

RECORD = STACK.record()
LATE_RECORD = LATE.record()
VOLTS = columns()
HEADER = "time_s,drive_v,position_um"


def at_times(record: Record, times: Array) -> Record:
    """Return the record with another clock."""
    return replace(record, t=times)


def jittered(bench: Bench, share: float) -> Record:
    """Return a record whose samples are taken at uneven times."""
    fine = 20
    fast = bench.measured(bench.excitation(rate=fine * RATE), fine * RATE)
    steps = np.arange(0, fast.u.size - fine, fine)
    shift = np.random.default_rng(2).uniform(0.0, share, steps.size)
    return fast.at(steps + np.round(fine * shift).astype(int))


def without(record: Record, first: int, count: int) -> Record:
    """Return the record without some samples."""
    kept = np.r_[0:first, first + count : record.u.size]
    return record.at(kept)


def turn(record: Record) -> int:
    """Return a sample shortly before the drive turns in the middle of the record."""
    u = record.u
    turns = np.flatnonzero(np.diff(np.sign(np.diff(u)))) + 1
    return int(turns[turns > u.size // 2][0]) - 15


def of_late(
    name: str, header: str, times: Array, says: str = "", more: list[str] | None = None
) -> Case:
    """Make a case of a stage with dynamics, whose clock counts."""
    write = text(at_times(LATE_RECORD, times), header, digits=15)
    then = None if more is None else Trial(write, [*VOLTS, *more])
    return Case(name, LATE, Trial(write, VOLTS), (says,) if says else (), then, fit=WITH_DYNAMICS)


T = LATE_RECORD.t
CLOCKS = [
    of_late("dynamics, seconds", HEADER, T),
    of_late("milliseconds in the name", "t_ms,drive_v,position_um", 1e3 * T),
    of_late("microseconds from a large start", "Time (us),drive_v,position_um", 1e6 * T + 7e9),
    of_late("minutes", "time_min,drive_v,position_um", T / 60.0),
    of_late(
        "milliseconds that nobody says",
        "time,drive_v,position_um",
        1e3 * T,
        "--time-unit",
        ["--time-unit", "ms"],
    ),
    of_late(
        "a count of samples as the time",
        "time,drive_v,position_um",
        RATE * T,
        "--time none",
        ["--time", "none", "--rate", "200"],
    ),
    of_late("seconds since 1970", HEADER, T + 1.77e9),
    of_late("times of few digits", HEADER, 0.002 * np.round(T / 0.002)),
    of_late(
        "days of a spreadsheet",
        "time,drive_v,position_um",
        T / 86400.0 + 46082.0,
        "--time-unit",
        ["--time-unit", "d"],
    ),
    Case(
        "no time, with a rate",
        LATE,
        Trial(text(LATE_RECORD, "row,drive_v,position_um"), [*VOLTS, "--rate", "200"]),
        fit=WITH_DYNAMICS,
    ),
    Case("no time and no rate", STACK, Trial(text(RECORD, "row,drive_v,position_um"), VOLTS)),
]

GAP = turn(RECORD)
SOME_GAPS = RECORD.at(np.delete(np.arange(RECORD.u.size), [333, 590, 591, 777, 800, 1001]))
UNEVEN = [
    Case("jitter of a fifth of a step", STACK, Trial(text(jittered(STACK, 0.5)), VOLTS)),
    Case(
        "jitter of a stage with dynamics",
        LATE,
        Trial(text(jittered(LATE, 0.9)), VOLTS),
        fit=WITH_DYNAMICS,
    ),
    Case("single samples lost", STACK, Trial(text(SOME_GAPS), VOLTS)),
    Case(
        "a gap over a reversal",
        STACK,
        Trial(text(without(RECORD, GAP, 30)), VOLTS),
        ("time_gap", f"--rows {GAP}"),
        "hint",
    ),
    Case(
        "a gap of a stage with dynamics",
        LATE,
        Trial(text(without(LATE_RECORD, GAP, 60)), VOLTS),
        ("time_gap", f"--rows {GAP}"),
        "hint",
        fit=WITH_DYNAMICS,
    ),
]


def restarted() -> Record:
    """Return two records in one file, whose clock starts again."""
    t = np.r_[RECORD.t, RECORD.t]
    return Record(t, np.r_[RECORD.u, RECORD.u], np.r_[RECORD.y, RECORD.y])


def two_rates(bench: Bench = STACK) -> Record:
    """Return a slow and a fast part in one file."""
    slow = bench.excitation(rate=5.0 * RATE)
    whole = bench.measured(np.r_[slow, 0.5 * bench.sine(5, 300)], 5.0 * RATE)
    return whole.at(np.r_[0 : slow.size : 5, slow.size : whole.u.size])


FAST = MAGNET.measured(MAGNET.excitation(3, 5 * RATE, 0.5), 5 * RATE)
BACK = RECORD.t.copy()
BACK[900] = BACK[890]
TWICE = RECORD.at(np.sort(np.r_[np.arange(RECORD.u.size), [200, 500, 900]]))
ORDER = [
    Case(
        "a clock that starts again",
        STACK,
        Trial(text(restarted()), VOLTS),
        (f"--rows {RECORD.u.size}",),
        "hint",
    ),
    Case(
        "one stamp that goes back",
        STACK,
        Trial(text(at_times(RECORD, BACK)), VOLTS),
        ("does not increase", "--time none"),
        Trial(text(at_times(RECORD, BACK)), [*VOLTS, "--time", "none", "--rate", "200"]),
    ),
    Case(
        "rows written twice",
        STACK,
        Trial(text(TWICE), VOLTS),
        ("does not increase", "--time none"),
        Trial(text(TWICE), [*VOLTS, "--time", "none", "--rate", "200"]),
    ),
    Case(
        "stamps of full seconds",
        STACK,
        Trial(text(at_times(RECORD, np.floor(RECORD.t))), VOLTS),
        ("does not increase", "--time none"),
        Trial(
            text(at_times(RECORD, np.floor(RECORD.t))), [*VOLTS, "--time", "none", "--rate", "200"]
        ),
    ),
    Case(
        "rows from last to first",
        STACK,
        Trial(text(RECORD.at(slice(None, None, -1))), VOLTS),
        ("backwards",),
        Trial(text(RECORD), VOLTS),
    ),
    Case("two rates in one file", STACK, Trial(text(two_rates()), VOLTS), ("rate_change",), "hint"),
    Case(
        "two rates of a stage with dynamics",
        LATE,
        Trial(text(two_rates(LATE)), VOLTS),
        ("rate_change",),
        "hint",
        fit=WITH_DYNAMICS,
    ),
    Case(
        "two rates in two files",
        MAGNET,
        Trial(
            both(
                text(MAGNET.record(), "time_s,current_a,field_mt"),
                text(FAST, "time_s,current_a,field_mt", name="fast.csv"),
            ),
            columns("current_a", "field_mt"),
        ),
    ),
    Case(
        "two files, one without a clock",
        STACK,
        Trial(both(text(RECORD), text(RECORD, "row,drive_v,position_um", name="b.csv")), VOLTS),
        ("expected a time",),
        Trial(both(text(RECORD), text(RECORD, name="b.csv", digits=8)), VOLTS),
    ),
]
CASES = [*CLOCKS, *UNEVEN, *ORDER]
