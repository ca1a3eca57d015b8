"""Time and memory of reading a large CSV, beside polars' reader: `make bench-read`.

The file is written plain, and with a few cells that are not plain: in quotation marks. Each reader
runs in a fresh process, and gives three columns of numbers.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ALLOWED = 1.5
"""Time and memory over those of polars."""
CHUNK = 200_000  # rows
KINDS = ("plain", "with odd cells")
READERS = ("polars", "mpi_hyst")


def write(path: Path, size: float, *, odd: bool) -> int:
    """Write so many bytes; return the number of rows. Of 100 000 rows one is odd."""
    rows = 0
    with path.open("w", encoding="utf-8") as file:
        file.write("time_s,drive_v,position_um\n")
        while file.tell() < size:
            k = np.arange(rows, rows + CHUNK)
            drive = 60.0 + 60.0 * np.sin(1e-3 * k)
            table = np.column_stack([1e-4 * k, drive, 0.2 * drive + np.sin(1e-2 * k)])
            lines = [f"{t:.4f},{u:.6f},{y:.9f}\n" for t, u, y in table.tolist()]
            if odd:
                lines[CHUNK // 4] = _quoted(lines[CHUNK // 4])
                lines[CHUNK // 2] = _quoted(lines[CHUNK // 2])
            file.writelines(lines)
            rows += CHUNK
    return rows


def _quoted(line: str) -> str:
    """Return a row with a cell in quotation marks."""
    clock, drive, position = line.split(",")
    return f'{clock},"{drive}",{position}'


def read(reader: str, path: Path) -> int:
    """Read three columns; return the number of rows."""
    if reader == "polars":
        import polars as pl

        kinds = dict.fromkeys(("time_s", "drive_v", "position_um"), pl.Float64)
        frame = pl.read_csv(path, schema_overrides=kinds, ignore_errors=True)
        columns = [frame[name].to_numpy() for name in kinds]
    else:
        import mpi_hyst as mh

        columns = list(mh.io.read(path).values.values())
    assert len(columns) == 3
    return int(columns[0].size)


def measured(reader: str, path: Path) -> tuple[int, float, float]:
    """Return rows, seconds and the peak of the memory in MB, of a fresh process."""
    words = [sys.executable, __file__, "--reader", reader, "--file", str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=os.environ)
    rows, seconds, peak = done.stdout.split()
    return int(rows), float(seconds), float(peak)


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> int:
    """Write the files, time both readers, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=float, default=1.0, help="size of a file in GB")
    parser.add_argument("--rounds", type=int, default=3, help="of which the fastest counts")
    parser.add_argument("--to", type=Path, default=Path("target/bench/read"))
    parser.add_argument("--reader", choices=READERS)
    parser.add_argument("--file", type=Path)
    given = parser.parse_args()
    if given.reader is not None:
        began = time.perf_counter()
        read_rows = read(given.reader, given.file)
        seconds = time.perf_counter() - began
        peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
        # In bytes on macOS, in kB elsewhere.
        say(f"{read_rows} {seconds} {peak / (1e6 if platform.system() == 'Darwin' else 1e3)}")
        return 0
    given.to.mkdir(parents=True, exist_ok=True)
    say("| file | reader | time | memory | time over polars | memory over polars |")
    say("|---|---|---|---|---|---|")
    worst = 0.0
    for kind in KINDS:
        path = given.to / f"{kind.replace(' ', '_')}.csv"
        written = write(path, 1e9 * given.size, odd=kind != KINDS[0])
        best: dict[str, tuple[float, float]] = {}
        for _ in range(given.rounds):
            for reader in READERS:
                count, seconds, peak = measured(reader, path)
                assert count == written, f"{reader}: {count} rows of {written}"
                before = best.get(reader, (np.inf, np.inf))
                best[reader] = min(before[0], seconds), min(before[1], peak)
        for reader in READERS:
            over = [one / other for one, other in zip(best[reader], best["polars"], strict=True)]
            worst = max(worst, *over)
            shown = f"{best[reader][0]:.2f} s | {best[reader][1]:.0f} MB"
            say(f"| {kind} | {reader} | {shown} | {over[0]:.2f} | {over[1]:.2f} |")
        path.unlink()
    say(f"asked: at most {ALLOWED}; the largest is {worst:.2f}")
    return int(worst > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
