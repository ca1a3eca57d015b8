"""Cases: text of all dialects, and files of other formats."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import scipy.io
from nptdms import ChannelObject, TdmsWriter

from odd_files.bench import RATE, STACK
from odd_files.case import Case, Trial, Write
from odd_files.texts import columns, raw, table, text

RECORD = STACK.record()
VOLTS = columns()


def comma(content: str) -> str:
    """Separate by semicolons, with a decimal comma."""
    return content.replace(",", ";").replace(".", ",")


def stamped(form: str) -> str:
    """Write the time as dates."""
    start = np.datetime64("2026-03-01T23:59:55.000")
    dates = start + np.round(1e3 * RECORD.t).astype("timedelta64[ms]")
    stamps = [form.format(*str(date).split("T")) for date in dates]
    rows = table([RECORD.u, RECORD.y]).splitlines()
    lines = [f"{stamp},{row}" for stamp, row in zip(stamps, rows, strict=True)]
    return "time,drive_v,position_um\n" + "\n".join(lines) + "\n"


def file(name: str, write: Callable[[Path], object]) -> Write:
    """Write one file of another format."""

    def written(place: Path) -> list[Path]:
        write(place / name)
        return [place / name]

    return written


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as made:
        for name, values, unit in (("u", RECORD.u, "V"), ("y", RECORD.y, "um")):
            made[f"run1/{name}"] = values
            made[f"run1/{name}"].attrs["units"] = unit
        made["run1/time_s"] = RECORD.t


def matlab73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as made:
        for name, values in (("time_s", RECORD.t), ("u", RECORD.u), ("y", RECORD.y)):
            made[f"scan/{name}"] = values[None, :]
    with path.open("r+b") as content:
        content.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def tdms(path: Path) -> None:
    clock = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("Rig", "Amp", RECORD.u, {**clock, "unit_string": "V"}),
                ChannelObject("Rig", "Gauge", RECORD.y, {**clock, "unit_string": "um"}),
            ]
        )


def lvm() -> str:
    head = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t,", "X_Columns\tOne"]
    head += ["Date\t2026/11/22", "Time\t10:00:00.0", "***End_of_Header***\t", ""]
    head += ["Channels\t2\t\t", f"Samples\t{RECORD.u.size}\t{RECORD.u.size}\t"]
    head += ["Date\t2026/11/22\t2026/11/22\t", "Time\t10:00:00,0\t10:00:00,0\t"]
    head += ["Y_Unit_Label\tVolts\tum\t", "X_Dimension\tTime\tTime\t", "X0\t0,0E+0\t0,0E+0\t"]
    head += [f"Delta_X\t{1 / RATE}\t{1 / RATE}\t".replace(".", ",")]
    head += ["***End_of_Header***\t\t\t", "X_Value\tDrive\tGauge\tComment"]
    rows = table([RECORD.t, RECORD.u, RECORD.y], separator="\t").replace(".", ",")
    return "\n".join(head) + "\n" + rows


def read(name: str, write: Write, options: list[str] = VOLTS) -> Case:
    """Make a case that must be read as it is."""
    return Case(name, STACK, Trial(write, options))


HEADER = "time_s,drive_v,position_um"
STRUCT = {"d": {"time_s": RECORD.t, "u": RECORD.u, "y": RECORD.y, "fs": RATE}}
TABLE = np.column_stack([RECORD.t, RECORD.u, RECORD.y])
DATES = columns()

READ = [
    read("plain csv", text(RECORD)),
    read("semicolons and decimal comma", text(RECORD, change=comma)),
    read("tabs", text(RECORD, change=lambda c: c.replace(",", "\t"))),
    read(
        "white space",
        text(RECORD, change=lambda c: "  " + c.replace(",", "   ")),
    ),
    read("comments", text(RECORD, change=lambda c: f"# rig 3\n% by hand\n{c}# the end\n")),
    read(
        "a preamble and units",
        text(
            RECORD,
            "Time;Amp;Gauge\ns;V;um",
            change=lambda c: "Scope X200\nSerial;77\n\n" + comma(c),
        ),
        columns("Amp", "Gauge"),
    ),
    read("no header", text(RECORD, ""), columns("1", "2")),
    read(
        "byte order mark, CRLF",
        text(RECORD, change=lambda c: c.replace("\n", "\r\n"), encoding="utf-8-sig"),
    ),
    read("UTF-16", text(RECORD, encoding="utf-16")),
    read(
        "quoted cells",
        text(RECORD, change=lambda c: '"' + c.replace(",", '","').replace("\n", '"\n"')[:-1]),
    ),
    read(
        "trailing separators and empty lines",
        text(RECORD, change=lambda c: c.replace("\n", ",,\n\n")),
    ),
    read(
        "a text column in front",
        text(
            RECORD, f"state,{HEADER}", change=lambda c: c.replace("\n", "\nok,").removesuffix("ok,")
        ),
    ),
    read("rounded to four digits", text(RECORD, digits=5)),
    read("gzip", raw(gzip.compress(f"{HEADER}\n{table(list(TABLE.T))}".encode()), "r.csv.gz")),
    read("npy, three columns", file("r.npy", lambda p: np.save(p, TABLE)), columns("1", "2")),
    read(
        "npz with a note",
        file("r.npz", lambda p: np.savez(p, u=RECORD.u, y=RECORD.y, note=np.array("rig 3"))),
        columns("u", "y"),
    ),
    read("MATLAB 5", file("r.mat", lambda p: scipy.io.savemat(p, STRUCT)), columns("d.u", "d.y")),
    read("MATLAB 7.3", file("r.mat", matlab73), columns("scan.u", "scan.y")),
    read("HDF5 with units", file("r.h5", hdf5), columns("run1/u", "run1/y")),
    read("TDMS", file("r.tdms", tdms), columns("Rig/Amp", "Rig/Gauge")),
    read("LabVIEW measurement", raw(lvm().encode(), "r.lvm"), columns("Drive", "Gauge")),
    read("ISO dates", raw(stamped("{0}T{1}").encode()), DATES),
    read("ISO dates, UTC", raw(stamped("{0} {1}Z").encode()), DATES),
    read("times of day", raw(stamped("{1}").encode()), DATES),
]


def refused(name: str, first: Write, said: str, then: list[str] | None = None) -> Case:
    """Make a case that is refused until the columns are others, or fewer rows are read."""
    second = None if then is None else Trial(first, then)
    return Case(name, STACK, Trial(first, VOLTS), (said,), second or "hint")


def in_row(number: int, old: str, new: str) -> Callable[[str], str]:
    """Change one line."""

    def change(content: str) -> str:
        lines = content.split("\n")
        lines[number] = lines[number].replace(old, new) if old else new
        return "\n".join(lines)

    return change


def cell(value: str, row: int = 1900) -> Callable[[str], str]:
    """Put something else into the position of one row."""

    def change(content: str) -> str:
        lines = content.split("\n")
        lines[row] = ",".join([*lines[row].split(",")[:-1], value])
        return "\n".join(lines)

    return change


def without_positions(content: str) -> str:
    """Leave one position in three."""
    header, *rows = content.rstrip("\n").split("\n")
    kept = [row if k % 3 == 0 else row.rpartition(",")[0] + "," for k, row in enumerate(rows)]
    return "\n".join([header, *kept]) + "\n"


LATE_ROW = 1900
POINTS = in_row(LATE_ROW, ",", ".")
REFUSED = [
    refused(
        "headers of the same name",
        text(RECORD, "time_s,volt_v,volt_v"),
        "no column",
        columns("1", "2"),
    ),
    refused("a cell of words", text(RECORD, change=cell("overload")), "not a number"),
    refused(
        "a row cut short", text(RECORD, change=in_row(LATE_ROW, "", "3.5,20")), "expected 3 cells"
    ),
    refused(
        "a row of another decimal mark",
        text(RECORD, change=lambda c: POINTS(comma(c))),
        "expected a decimal comma",
    ),
]

FILLED = [
    read("a cell of NaN", text(RECORD, change=cell("NaN"))),
    read("a cell that is empty", text(RECORD, change=cell(""))),
    read("a sensor that is slower than the drive", text(RECORD, change=without_positions)),
]

CASES = [*READ, *REFUSED, *FILLED]
