"""Cases: glitches, bursts, frozen and clipped signals, jumps, and bad beginnings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from support import Array

from odd_files.bench import BIPOLAR, MAGNET, STACK, Bench, Record
from odd_files.case import Case, Trial
from odd_files.positions import VOLTS, hinted, same, then
from odd_files.texts import text

RECORD = STACK.record()
SPAN = RECORD.span
SIZE = RECORD.u.size
Places = list[int] | slice | npt.NDArray[np.int_]


def put(places: Places, value: float | Array, column: str = "y", record: Record = RECORD) -> Record:
    """Return the record with other values at these places."""

    def change(values: Array) -> Array:
        values[places] = value
        return values

    return record.spoilt(change, column)


def frozen(first: int, last: int, column: str = "y", record: Record = RECORD) -> Record:
    """Return the record with a signal that stands still for a while."""
    return put(slice(first, last), float(getattr(record, column)[first]), column, record)


def after(middle: int, change: float, record: Record = RECORD) -> Record:
    """Return the record with another zero from a sample on."""
    return replace(record, y=record.y + change * record.span * (np.arange(record.u.size) >= middle))


def of(bench: Bench) -> Record:
    return bench.record()


EVERY = np.arange(50, SIZE, 90)
GLITCHES = [
    same("one glitch of a million", STACK, put([700], 1e6)),
    same("a glitch of one range", STACK, put([300], 2.0 * SPAN)),
    same("twelve samples of zero", STACK, put(list(range(100, 1300, 100)), 0.0)),
    same("a burst at the rail", STACK, put(slice(700, 706), 99.0)),
    hinted("a long burst", put(slice(900, 940), RECORD.y[900:940] + 0.6 * SPAN), "bad_stretch"),
    hinted("two bursts", put(np.r_[400:410, 1200:1240], -SPAN), "--leave-out 1200:1240"),
    same("small glitches", STACK, put(EVERY, RECORD.y[EVERY] + 0.02 * SPAN)),
    hinted("one glitch of the drive", put([300], 1e4, "u"), "input_outliers", "--mend 300:301"),
    hinted("the drive drops to zero", put([444, 1333], 0.0, "u"), "input_outliers"),
    hinted("a burst of the drive", put(slice(800, 804), -150.0, "u"), "--mend 800:804"),
    same("a glitch of a magnet", MAGNET, put([610], 9e9, "y", of(MAGNET))),
]
STUCK = [
    hinted("a frozen sensor", frozen(640, 760), "stuck_output", "--leave-out 640:"),
    hinted("a sensor that fails at the end", frozen(1700, SIZE), "stuck_output"),
    hinted(
        "a sensor that freezes twice",
        put(slice(1400, 1500), RECORD.y[1400], "y", frozen(500, 600)),
        "stuck_output",
    ),
    hinted("a frozen monitor of the drive", frozen(640, 700, "u"), "stuck_input", "--mend 640:"),
    hinted(
        "a frozen sensor, bipolar",
        frozen(640, 760, "y", of(BIPOLAR)),
        "stuck_output",
        bench=BIPOLAR,
    ),
]
NANOMETRES = put(slice(1300, SIZE), 1e3 * RECORD.y[1300:])
JUMPS = [
    hinted("another zero in the middle", after(1000, 0.3), "output_jump", "--leave-out 999:1000"),
    hinted("a small step of the zero", after(800, 0.05), "output_jump"),
    # The part in micrometres is the one before; the hint names both.
    Case(
        "micrometres, then nanometres",
        STACK,
        Trial(text(NANOMETRES), VOLTS),
        ["red gain_change", "--rows 1300"],
        Trial(text(NANOMETRES), [*VOLTS, "--rows", "1300"]),
    ),
]
CLIPPED = [
    hinted(
        "clipped position", RECORD.spoilt(lambda y: np.minimum(y, 0.8 * SPAN)), "clipped_output"
    ),
    hinted(
        "clipped at both ends",
        RECORD.spoilt(lambda y: np.clip(y, 0.1 * SPAN, 0.85 * SPAN)),
        "clipped_output",
    ),
    hinted(
        "clipped position, magnet",
        of(MAGNET).spoilt(lambda y: np.minimum(y, 0.8 * np.ptp(y))),
        "clipped_output",
        bench=MAGNET,
    ),
    then(
        "clipped monitor of the drive",
        RECORD.spoilt(lambda u: np.minimum(u, 120.0), "u"),
        ["red", "clipped_input", "record the drive that was sent"],
        RECORD,
    ),
]


def settling(share: float, seconds: float, record: Record = RECORD) -> Record:
    """Return a record whose electronics settle."""
    return replace(record, y=record.y + share * record.span * np.exp(-record.t / seconds))


def offset_start() -> Record:
    """Return a record of a stage that had been at its upper limit and came back halfway."""
    before = np.r_[np.linspace(0.0, 150.0, 100), np.linspace(150.0, 60.0, 100)]
    u = np.r_[before, np.linspace(60.0, 0.0, 60), STACK.excitation()]
    return STACK.measured(u).at(slice(before.size, None))


STARTS = [
    same("electronics settle at once", STACK, settling(0.1, 0.05)),
    same("electronics settle", STACK, settling(0.1, 0.3)),
    hinted("electronics settle slowly", settling(0.15, 1.0), "start_up_transient", "--skip"),
    same("electronics settle from far away", STACK, settling(-0.5, 0.3)),
    hinted(
        "electronics of a magnet settle",
        settling(0.5, 0.3, of(MAGNET)),
        "start_up_transient",
        bench=MAGNET,
    ),
    same("an unknown history", STACK, offset_start()),
]
CASES: list[Case] = [*GLITCHES, *STUCK, *JUMPS, *CLIPPED, *STARTS]
