"""Cases: what the rig does: counters, monitors, amplifiers, ranges, warm electronics, loggers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mpi_hyst as mh
import numpy as np
from support import Array

from odd_files.bench import BIPOLAR, LATE, MAGNET, RATE, STACK, Bench, Record
from odd_files.case import WITH_DYNAMICS, Case, Trial
from odd_files.positions import HEADER, VOLTS, hinted, same, then
from odd_files.texts import columns, raw, table, text

RECORD = STACK.record()
SPAN = RECORD.span
SIZE = RECORD.u.size
COUNTER = "time_s,drive_v,adc"
TABLE = table([RECORD.t, RECORD.u, RECORD.y])


def without_time(content: str) -> str:
    """Drop the first column."""
    return "\n".join(line.partition(",")[2] for line in content.split("\n"))


def timeless(bench: Bench) -> Case:
    """Make a case of a late stage whose file has no time."""
    write = text(bench.record(), change=without_time)
    return Case(
        f"no time, and a stage that is {bench.name}",
        bench,
        Trial(write, VOLTS),
        ["amber", "no_interval", "--rate HZ"],
        Trial(write, [*VOLTS, "--rate", "200"]),
        fit=WITH_DYNAMICS,
    )


def decaying(change: Array | float, seed: int = 7) -> Record:
    """Return loops that only decay, with a share of the range added to the position."""
    drive = mh.signals.decaying_triangle(500.0, 0.5, cycles=8, rate=RATE)
    record = BIPOLAR.measured(drive, seed=seed)
    return replace(record, y=record.y + record.span * change)


PASSED = np.linspace(0.0, 1.0, decaying(0.0).u.size)
SLOW = [
    timeless(LATE),
    timeless(replace(STACK, name="behind a slow bus", dead_time=0.015)),
    then(
        "a line in loops that decay",
        decaying(0.1 * PASSED),
        ["drift", "settle before the record"],
        decaying(0.0),
        bench=BIPOLAR,
    ),
    then(
        "warming up in loops that decay",
        decaying(0.1 * (1.0 - np.exp(-3.0 * PASSED))),
        ["drift", "settle before the record"],
        decaying(0.0),
        bench=BIPOLAR,
    ),
]


def from_on(place: int, factor: float, options: Sequence[str], scale: float) -> Case:
    """Make a case whose position has another factor from a sample on; one part is fitted."""
    y = RECORD.y + 0.3 * SPAN
    spoilt = replace(RECORD, y=np.where(np.arange(SIZE) < place, y, factor * y))
    return Case(
        f"{factor:g} times from sample {place} on",
        STACK,
        Trial(text(spoilt), VOLTS),
        ["red gain_change", " ".join(options)],
        Trial(text(spoilt), [*VOLTS, *options], (1.0, scale)),
    )


RANGES = [
    from_on(1052, 2.0, ["--rows", "1052"], 1.0),
    from_on(1052, 0.1, ["--rows", "1052"], 1.0),
    from_on(250, 1000.0, ["--skip", "250"], 1000.0),
    from_on(1700, 1000.0, ["--rows", "1700"], 1.0),
]


def wrapping(name: str, counts: float, start: float, period: float, low: float = 0.0) -> Case:
    """Make a case of a counter that goes on at its other end."""
    whole = np.round(counts * RECORD.y + start)
    wrapped = replace(RECORD, y=(whole - low) % period + low)
    again = replace(wrapped, y=np.unwrap(wrapped.y, period=period))
    options, scale = columns("drive_v", "adc"), (1.0, counts)
    return Case(
        name,
        STACK,
        Trial(text(wrapped, COUNTER), options, scale),
        ["red output_wraps", f"numpy.unwrap(y, period={period:g})"],
        Trial(text(again, COUNTER), options, scale),
    )


CLOCK = text(replace(RECORD, t=np.round(1000.0 * RECORD.t) % 4096.0), "time_ms,drive_v,position_um")
COUNTERS = [
    wrapping("a counter of 16 bits wraps", 3000.0, 40000.0, 65536.0),
    wrapping("a counter of 16 bits wraps often", 20000.0, 0.0, 65536.0),
    wrapping("a signed counter wraps", 3000.0, 10000.0, 65536.0, -32768.0),
    wrapping("a counter of 12 bits wraps", 200.0, 2000.0, 4096.0),
    Case(
        "the counter of the clock wraps",
        STACK,
        Trial(CLOCK, columns()),
        ["does not increase", "--time none"],
        Trial(CLOCK, [*columns(), "--time", "none", "--rate", "200"]),
    ),
]


def monitored(bench: Bench, share: float, seed: int = 1) -> Case:
    """Make a case whose drive was read by a noisy monitor."""
    record = bench.record()
    noise = (
        share * (bench.high - bench.low) * np.random.default_rng(seed).normal(size=record.u.size)
    )
    name = f"a monitor of {bench.name} with noise of {share:.0%}"
    says = ["amber noisy_input", "the drive that was sent"]
    return then(name, replace(record, u=record.u + noise), says, record, bench=bench)


NOISE = 5e-4 * SPAN * np.random.default_rng(4).normal(size=SIZE)
LIMITED = replace(STACK, name="limited", high=120.0)
SWITCHED = replace(STACK.measured(np.minimum(RECORD.u, 120.0)), u=RECORD.u)
ZEROS = np.arange(SIZE) % 400 == 50
ELECTRONICS = [
    monitored(STACK, 0.02),
    monitored(BIPOLAR, 0.02),
    monitored(MAGNET, 0.05),
    hinted(
        "a sensor at its end, with noise",
        RECORD.spoilt(lambda y: np.minimum(y, 0.75 * SPAN) + NOISE),
        "clipped_output",
    ),
    then(
        "an amplifier at its end",
        SWITCHED,
        ["red clipped_output", "an amplifier at its end"],
        replace(SWITCHED, u=np.minimum(RECORD.u, 120.0)),
        bench=LIMITED,
    ),
    hinted(
        "rows of zeros",
        replace(RECORD, u=np.where(ZEROS, 0.0, RECORD.u), y=np.where(ZEROS, 0.0, RECORD.y)),
        "red failed_rows",
        "--mend 450:451",
    ),
    same(
        "a monitor of eight bits",
        STACK,
        RECORD.spoilt(lambda u: 150.0 / 255.0 * np.round(u * 255.0 / 150.0), "u"),
    ),
    Case(
        "turned, late and ringing",
        LATE,
        Trial(text(LATE.record().spoilt(np.negative)), VOLTS),
        ["red wrong_sign"],
        "hint",
        fit=WITH_DYNAMICS,
    ),
    then(
        "triangles of one amplitude",
        STACK.measured(
            np.interp(np.arange(1800) / 100.0, np.arange(19), 150.0 * (np.arange(19) % 2))
        ),
        ["no_minor_loops", "decaying sweep"],
        RECORD,
    ),
    same("a minute of rest before", STACK, STACK.measured(np.r_[np.zeros(12000), RECORD.u])),
    same(
        "a share of the stroke, and millimetres",
        STACK,
        replace(RECORD, u=RECORD.u / 150.0, y=RECORD.y / 1000.0),
        "time_s,drive,position_mm",
        (1.0 / 150.0, 1e-3),
    ),
]


def logged(name: str, content: str, options: list[str], **more: float) -> Case:
    """Make a case of a text that must be read as it is."""
    scale = (1.0, more.get("position", 1.0))
    return Case(name, STACK, Trial(raw(content.encode()), options, scale))


COUNTS = np.round(3000.0 * RECORD.y + 8000.0)
COMMAS = table([RECORD.t, RECORD.u, RECORD.y], separator=";").replace(".", ",")
CUT = Trial(raw(f"{HEADER}\n{TABLE}10.6,13".encode()), VOLTS)
PAIRS = replace(RECORD, t=RECORD.t[np.arange(SIZE) // 2 * 2])
LOGGERS = [
    logged(
        "counts, no header, no time",
        table([RECORD.u, COUNTS], separator=";"),
        [*columns("0", "1"), "--rate", "200"],
        position=3000.0,
    ),
    logged("two lines of names", f"Channel 0,Channel 1,Channel 2\n{HEADER}\n{TABLE}", VOLTS),
    logged(
        "semicolons, decimal commas and a row of units",
        f"Zeit;Antrieb;Weg\ns;V;µm\n{COMMAS}",
        columns("Antrieb", "Weg"),
    ),
    logged(
        "a line for a spreadsheet",
        f"sep=;\nZeit;Antrieb;Weg\ns;V;µm\n{COMMAS}",
        columns("Antrieb", "Weg"),
    ),
    logged("returns without line feeds", f"{HEADER}\n{TABLE}".replace("\n", "\r"), VOLTS),
    Case("a last line that is cut short", STACK, CUT, ["--rows"], "hint"),
    Case(
        "every stamp twice",
        STACK,
        Trial(text(PAIRS), VOLTS),
        ["does not increase", "--time none"],
        Trial(text(PAIRS), [*VOLTS, "--time", "none", "--rate", "200"]),
    ),
]
CASES = [*SLOW, *RANGES, *COUNTERS, *ELECTRONICS, *LOGGERS]
