"""Kills processes while they save, and looks at what they leave.

`make kill-saves KILLS=200` prints the figures; `test_killed_saves.py` has a short form.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mpi_hyst as mh

COPY = ".mpi_hyst-*.tmp"
LONGEST = 0.03  # seconds until a kill: a few saves
SAVES = 100  # of each of several processes at once


@dataclass
class Figures:
    """What was found."""

    kills: int = 0
    old: int = 0
    new: int = 0
    leftovers: int = 0


def models() -> tuple[mh.PrandtlIshlinskii, mh.PrandtlIshlinskii]:
    """Return two models whose files take several writes of the system."""
    n = range(4096)
    return tuple(mh.PrandtlIshlinskii([w] * len(n), n) for w in (1.0, 0.1 + 0.2))  # type: ignore[return-value]


def forked(work: Callable[[], object]) -> int:
    """Start the work in a process of its own, and return its number."""
    child = os.fork()
    if child:
        return child
    try:
        work()
        os._exit(0)
    except BaseException as error:
        sys.stderr.write(f"{error!r}\n")
        sys.stderr.flush()
    os._exit(1)


def kill_saves(directory: Path, kills: int, seed: int) -> Figures:
    """Kill a process that saves two models in turn, again and again."""
    chance, figures = random.Random(seed), Figures()
    path = directory / "model.json"
    both = models()
    texts = []
    for model in both:
        model.save(path)
        texts.append(path.read_bytes())
    for _ in range(kills):
        both[0].save(path)
        assert not list(directory.glob(COPY)), "a save leaves nothing, and removes what was left"
        ready, tell = os.pipe()

        def save(tell: int = tell) -> None:
            os.write(tell, b"!")
            while True:
                both[1].save(path)
                both[0].save(path)

        child = forked(save)
        os.close(tell)
        os.read(ready, 1)
        os.close(ready)
        time.sleep(chance.uniform(0.0, LONGEST))
        os.kill(child, signal.SIGKILL)
        assert os.WIFSIGNALED(os.waitpid(child, 0)[1]), "the process ended before it was killed"
        found = path.read_bytes()
        assert found in texts, f"half a file of {len(found)} bytes"
        left = {one.name for one in directory.iterdir()} - {path.name}
        assert left == {one.name for one in directory.glob(COPY)} and len(left) <= 1, left
        figures.kills += 1
        figures.leftovers += len(left)
        figures.old += found == texts[0]
        figures.new += found == texts[1]
    both[0].save(path)
    assert {one.name for one in directory.iterdir()} == {path.name}
    return figures


def save_at_once(directory: Path, processes: int) -> None:
    """Save to one file from several processes at once: none disturbs another."""
    model = models()[0]
    path = directory / "model.json"

    def save() -> None:
        for _ in range(SAVES):
            model.save(path)

    children = [forked(save) for _ in range(processes)]
    ended = [os.waitpid(child, 0)[1] for child in children]
    assert ended == [0] * processes, ended
    assert {one.name for one in directory.iterdir()} == {path.name}
    assert mh.load(path) == model


def main() -> None:
    """Print the figures of as many kills as the command line says."""
    kills, seed = int(sys.argv[1]), int(sys.argv[2])
    with tempfile.TemporaryDirectory() as name:
        figures = kill_saves(Path(name), kills, seed)
        save_at_once(Path(name), 4)
    sys.stdout.write(
        f"{figures.kills} saves killed: {figures.old} left the one file, {figures.new} the other, "
        f"none a part of one; {figures.leftovers} left a copy, which the next save removed\n"
        f"4 processes saved {SAVES} times each to one file at once: no error, nothing left\n"
    )


if __name__ == "__main__":
    main()
