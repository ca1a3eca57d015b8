"""Fills the disk at every place of every writing command, and looks at what is there then.

`make full-disk` does it on a disk of its own, which needs the rights of an administrator, and with
a limit on the size of files; `test_full_disk.py` does a short form of the latter.
"""

from __future__ import annotations

import importlib
import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mpi_hyst as mh
from commands import COLUMNS, HEADER, actuator, record_rows, write_csv
from killed_saves import forked
from mpi_hyst._cli import commands

OLD = b"old"
REPORT = ["--report", "page.html"]
# The files that each command writes, and its arguments.
QUICK: dict[tuple[str, ...], list[str]] = {
    ("stage.json", "page.html"): [
        *("identify", "record.csv", *COLUMNS, "--operators", "4", "-o", "stage.json", *REPORT)
    ],
    ("drive.csv",): ["precompensate", "model.json", "target.csv", "-o", "drive.csv"],
    ("run.csv", "page.html"): [
        *("simulate", "model.json", "target.csv", "--limits", "-500,500", "-o", "run.csv", *REPORT)
    ],
    ("look.svg",): ["look", "record.csv", "--plot", "look.svg"],
    ("d.csv", "page.html"): [
        *("excite", "--limits", "-500,500", "--slew", "1e4", "--rate", "1000", "--demagnetize"),
        *("-o", "d.csv", *REPORT),
    ],
}
SLOW: dict[tuple[str, ...], list[str]] = {
    ("report.json", "times.png"): [
        *("realtime", "bench.json", "--rate", "1000", "--seconds", "0.1"),
        *("--json", "report.json", "--plot", "times.png"),
    ],
    ("demo/report.html",): ["demo", "--out", "demo"],
    ("experiment/plan.html",): [
        *("excite", "--limits", "-500,500", "--slew", "1e4", "--rate", "1000"),
        *("-o", "experiment"),
    ],
}


@dataclass
class Figures:
    """What was found."""

    runs: int = 0
    refused: int = 0


def prepare(directory: Path) -> None:
    """Make the files that the commands read."""
    # matplotlib lists the fonts of a new machine once, and complains where it cannot write that.
    importlib.import_module("matplotlib.font_manager")
    write_csv(directory / "record.csv", HEADER, record_rows())
    write_csv(
        directory / "target.csv", "time_s,target_um", [[k / 200, 0.001 * k] for k in range(300)]
    )
    actuator().save(directory / "model.json")
    mh.paper.plant("A1").stage.replace(slew=2e4).save(directory / "bench.json")


def command(arguments: Sequence[str], limit: int | None) -> tuple[int, str]:
    """Run a command in a process whose files end at the limit; return status and errors."""
    read, write = os.pipe()

    def work() -> None:
        os.dup2(write, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        if limit is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        try:
            commands.commands.main(list(arguments))
        except SystemExit as ended:
            sys.stderr.flush()
            os._exit(int(ended.code or 0))

    child = forked(work)
    os.close(write)
    with os.fdopen(read, encoding="utf-8") as errors:
        said = errors.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said


def check(
    directory: Path, files: Sequence[str], arguments: Sequence[str], limit: int | None
) -> int:
    """Run one command where the disk is full; return its status."""
    before = {one: one.read_bytes() for one in directory.rglob("*") if one.is_file()}
    status, said = command(arguments, limit)
    where = f"{' '.join(arguments)}, at {limit}: status {status}, {said!r}"
    after = {one: one.read_bytes() for one in directory.rglob("*") if one.is_file()}
    assert not [one for one in after if one.suffix == ".tmp"], where
    new = {str(one.relative_to(directory)) for one in after if after[one] != before.get(one)}
    if status == 0:
        assert set(files) <= new, f"{where}, new: {new}"
        return status
    assert status == 2 and said.count("\n") == 1, where
    assert said.startswith("mpi-hyst: error: ") and ("large" in said or "space" in said), where
    for path, content in before.items():
        # A file is the old one, or another that was written whole before the disk was full.
        if after[path] != content:
            assert f"{path.relative_to(directory)}" in said.partition("written before:")[2], where
    return status


def every(
    directory: Path, asked: dict[tuple[str, ...], list[str]], limits: Sequence[int]
) -> Figures:
    """Run commands under limits on the size of files."""
    figures = Figures()
    for files, arguments in asked.items():
        for limit in limits:
            for name in files:
                (directory / name).parent.mkdir(exist_ok=True)
                (directory / name).write_bytes(OLD)
            figures.runs += 1
            figures.refused += check(directory, files, arguments, limit) != 0
    return figures


def saves(directory: Path, limits: Sequence[int]) -> Figures:
    """Save under the same limits."""
    figures = Figures()
    new = mh.PrandtlIshlinskii([1.0] * 1000, range(1000))
    for limit in limits:
        path = directory / "saved.json"
        actuator().save(path)
        old = path.read_bytes()

        def save(limit: int = limit, path: Path = path) -> None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            try:
                new.save(path)
            except OSError as error:
                os._exit(3 if error.filename == str(path) else 4)

        status = os.waitstatus_to_exitcode(os.waitpid(forked(save), 0)[1])
        assert status in (0, 3), status
        assert path.read_bytes() == old if status else mh.load(path) == new
        assert not list(directory.glob(".*.tmp"))
        figures.runs += 1
        figures.refused += status != 0
    return figures


@contextmanager
def small_disk(directory: Path, size: int) -> Iterator[Path]:
    """Mount a file system in memory of so many bytes."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", directory], check=True)
    try:
        yield directory
    finally:
        os.chdir("/")
        subprocess.run(["umount", directory], check=True)


def on_small_disks(asked: dict[tuple[str, ...], list[str]], sizes: Sequence[int]) -> Figures:
    """Run commands on disks that are full at another place each time."""
    figures = Figures()
    with tempfile.TemporaryDirectory() as name:
        for size in sizes:
            for files, arguments in asked.items():
                with small_disk(Path(name), 1 << 24) as disk:
                    os.chdir(disk)
                    prepare(disk)
                    for one in files:
                        (disk / one).parent.mkdir(exist_ok=True)
                        (disk / one).write_bytes(OLD)
                    space = os.statvfs(disk)
                    filler = b"\0" * (space.f_bavail * space.f_frsize - size)
                    (disk / "filler").write_bytes(filler)
                    figures.runs += 1
                    figures.refused += check(disk, files, arguments, None) != 0
    return figures


def shared_memory(directory: Path) -> None:
    """Check that a loop is refused by one line where its memory would have no room."""
    with small_disk(directory, 1 << 16) as disk:
        (disk / "filler").write_bytes(b"\0" * (os.statvfs(disk).f_bavail * 4096))
        before = set(disk.iterdir())
        asked = ["realtime", str(directory.parent / "bench.json"), "--shared-memory"]
        status, said = command([*asked, str(disk / "memory")], None)
        assert status == 2 and said.endswith("memory: No space left on device\n"), (status, said)
        assert set(disk.iterdir()) == before


def main() -> None:
    """Print the figures."""
    limits = [0, 1, 100, 1000, 5000, 20_000, 50_000, 100_000, 200_000, 500_000, 10_000_000]
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        prepare(Path(name))
        done: list[tuple[str, Callable[[], Figures]]] = [
            (
                "commands, files that end at a limit",
                lambda: every(Path(name), QUICK | SLOW, limits),
            ),
            ("saves, files that end at a limit", lambda: saves(Path(name), limits)),
        ]
        for what, work in done:
            _tell(what, work())
        os.chdir("/")
    if os.geteuid() == 0 and sys.platform == "linux":
        sizes = [0, 4096, 16_384, 65_536, 131_072, 262_144, 524_288]
        _tell("commands on a disk that is full", on_small_disks(QUICK | SLOW, sizes))
        with tempfile.TemporaryDirectory() as name:
            prepare(Path(name))
            (Path(name) / "disk").mkdir()
            shared_memory(Path(name) / "disk")
        sys.stdout.write("a shared memory on a disk that is full: refused with one line\n")
    else:
        sys.stdout.write("a disk of its own needs the rights of root on Linux: left out\n")


def _tell(what: str, figures: Figures) -> None:
    refused = f"{figures.runs} runs, {figures.refused} refused with one line, nothing half-written"
    sys.stdout.write(f"{what}: {refused}\n")


if __name__ == "__main__":
    main()
