"""The loop of `make realtime` with Python in it: python benches/python/realtime.py RATE SECONDS.

The same stage, reference and columns. First a loop in Python: sleep until the deadline, then `step`
of the controller and of the plant. Then the loop in Rust, whose plant is an object in Python. What
was missed is skipped.
"""

from __future__ import annotations

import sys
import time

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt

Times = npt.NDArray[np.float64]


def loop(rate: float, seconds: float) -> tuple[Times, Times, int]:
    """Return how late samples began, how long they took, and how many deadlines were skipped."""
    dt = 1.0 / rate
    stage = mh.paper.plant("A1").stage.replace(slew=1e5)
    controller, plant = stage.controller(dt), stage.plant(dt)
    turn = max(2, round(0.1 * rate))
    reference = (3.0 * np.sin(2.0 * np.pi * np.arange(turn) / turn)).tolist()
    last = round(seconds * rate)
    late, took = np.empty(last), np.empty(last)
    position, index, taken = 0.0, 0, 0
    now = time.perf_counter
    start = now() + dt
    while index < last:
        deadline = start + index * dt
        time.sleep(max(0.0, deadline - now()))
        began = now()
        drive = controller.step(reference[index % turn], position)
        position = plant.step(drive)
        done = now()
        late[taken], took[taken] = began - deadline, done - began
        taken += 1
        index = max(index + 1, int((done - start) / dt) + 1)
    return late[:taken], took[:taken], last - taken


class Pair:
    """The plant behind `read` and `write`: what a driver in Python is for the loop in Rust."""

    def __init__(self, plant: mh.plant.Plant) -> None:
        self.plant, self.position = plant, 0.0

    def read(self) -> float:
        return self.position

    def write(self, drive: float) -> None:
        self.position = self.plant.step(drive)


def with_a_pair(rate: float, seconds: float) -> mh.realtime.LoopReport:
    """Run the loop in Rust around an object in Python."""
    dt = 1.0 / rate
    stage = mh.paper.plant("A1").stage.replace(slew=1e5)
    turn = max(2, round(0.1 * rate))
    reference = 3.0 * np.sin(2.0 * np.pi * np.arange(turn) / turn)
    return mh.realtime.run(
        stage.controller(dt),
        Pair(stage.plant(dt)),
        reference,
        rest_drive=0.0,
        rest_rate=2000.0,
        seconds=seconds,
    )


def show(title: str, rows: dict[str, list[float]]) -> None:
    """Print the columns that the loop in Rust prints."""
    say = sys.stdout.write
    say(f"{title}\n")
    say(
        " ".join(f"{name:>10}" for name in ("", "median", "p99", "p99.9", "p99.99", "max"))
        + " us\n"
    )
    for name, shown in rows.items():
        say(f"{name:>10} " + " ".join(f"{1e6 * one:10.2f}" for one in shown) + "\n")


def main(rate: float, seconds: float) -> None:
    """Print the loop in Python, then the loop in Rust that calls Python."""
    late, took, skipped = loop(rate, seconds)
    rows = {
        name: [*np.quantile(times, [0.5, 0.99, 0.999, 0.9999]).tolist(), float(times.max())]
        for name, times in (("latency", late), ("compute", took))
    }
    show(f"in Python: {late.size} samples, {skipped} deadlines skipped", rows)
    report = with_a_pair(rate, seconds)
    rows = {
        name: [times.median, times.p99, times.p999, times.p9999, times.max]
        for name, times in (("latency", report.latency), ("compute", report.compute))
    }
    title = f"read and write in Python: {report.taken} samples, {report.skipped} deadlines skipped"
    show(title, rows)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:3]))
