"""The loop of `make realtime` as a loop in Python: python benches/python/realtime.py RATE SECONDS.

The same stage, reference and columns: sleep until the deadline, then `step` of the controller and
of the plant. What was missed is skipped.
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


def main(rate: float, seconds: float) -> None:
    """Print the columns that the loop in Rust prints."""
    late, took, skipped = loop(rate, seconds)
    say = sys.stdout.write
    say(f"in Python: {late.size} samples, {skipped} deadlines skipped\n")
    say(
        " ".join(f"{name:>10}" for name in ("", "median", "p99", "p99.9", "p99.99", "max"))
        + " us\n"
    )
    for name, times in (("latency", late), ("compute", took)):
        shown = [*np.quantile(times, [0.5, 0.99, 0.999, 0.9999]), times.max()]
        say(f"{name:>10} " + " ".join(f"{1e6 * one:10.2f}" for one in shown) + "\n")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:3]))
