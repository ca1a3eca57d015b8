"""The rounds of `make bench-python` as tables: time per sample and ratios to the yardsticks.

Of each case the fastest round, which other work on the machine disturbs least.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

YARDSTICKS = {
    "step": ("math.sqrt", "empty Python method"),
    "array": ("numba", "numba, vectorised"),
    "individual": ("numba", "numba, vectorised"),
}
ARRAYS = {"array": "per actuator", "individual": "per actuator with a model of its own"}
LOOPS = ("numba", "numba, vectorised", "numpy")
FACES = ("forward", "bank", "inverse")

Times = dict[tuple[str, int, str], float]
"""Nanoseconds by signal, number of operators and case."""


def nanoseconds(benches: list[dict[str, Any]], face: str) -> Times:
    """Least time per sample of each case, number of operators and signal."""
    infos = [(bench["extra_info"], bench["stats"]["min"]) for bench in benches]
    return {
        (info.get("signal", ""), info["n"], info["case"]): 1e9 * least / info["samples"]
        for info, least in infos
        if info["face"] == face
    }


def instructions(benches: list[dict[str, Any]]) -> str:
    """The instruction set of the numba loops."""
    infos = (bench["extra_info"] for bench in benches)
    return next(str(info["instructions"]) for info in infos if info["face"] == "run")


def number(value: float) -> str:
    """One decimal where it tells something."""
    return f"{value:.1f}" if value < 100.0 else f"{value:.0f}"


def row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def call_table(title: str, times: Times, yardsticks: tuple[str, ...]) -> list[str]:
    cases = {case: time for (_, _, case), time in times.items()}
    header = (title, "time", *(f": {name}" for name in yardsticks))
    lines = [row(*header), "|---" * len(header) + "|"]
    for case, time in cases.items():
        ratios = (f"{time / cases[name]:.2f}" for name in yardsticks)
        lines.append(row(case, f"{number(time)} ns", *ratios))
    return lines


def run_table(times: Times) -> list[str]:
    ratios = [f"{loop} : {face}" for face in FACES for loop in LOOPS]
    header = ("signal", "n", *FACES, *LOOPS, *ratios)
    lines = [row(*header), "|---" * len(header) + "|"]
    for signal, n in dict.fromkeys((signal, n) for signal, n, _ in times):
        at = {case: time for (s, m, case), time in times.items() if (s, m) == (signal, n)}
        absolute = [f"{number(at[case])} ns" for case in (*FACES, *LOOPS)]
        relative = [number(at[loop] / at[face]) for face in FACES for loop in LOOPS]
        lines.append(row(signal, n, *absolute, *relative))
    return lines


def main() -> None:
    benches = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["benchmarks"]
    run = nanoseconds(benches, "run")
    tables = [
        call_table("one call", nanoseconds(benches, "step"), YARDSTICKS["step"]),
        *(
            call_table(title, nanoseconds(benches, face), YARDSTICKS[face])
            for face, title in ARRAYS.items()
        ),
        run_table(run),
        [f"numba compiled for {instructions(benches)}, with fastmath and parallel off."],
    ]
    sys.stdout.write("\n\n".join("\n".join(lines) for lines in tables) + "\n")


if __name__ == "__main__":
    main()
