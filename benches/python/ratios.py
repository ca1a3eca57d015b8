"""The medians of `make bench-python` as tables: time per sample and ratios to the yardsticks."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

YARDSTICKS = ("math.sqrt", "empty Python method")
LOOPS = ("numba", "numba, two passes", "numpy")


def nanoseconds(benches: list[dict[str, Any]], face: str) -> dict[tuple[str, int, str], float]:
    """Median time per sample of each case, number of operators and signal."""
    infos = [(bench["extra_info"], bench["stats"]["median"]) for bench in benches]
    return {
        (info.get("signal", ""), info["n"], info["case"]): 1e9 * median / info["samples"]
        for info, median in infos
        if info["face"] == face
    }


def number(value: float) -> str:
    """One decimal where it tells something."""
    return f"{value:.1f}" if value < 100.0 else f"{value:.0f}"


def row(*cells: object) -> str:
    return f"| {' | '.join(map(str, cells))} |"


def step_table(times: dict[tuple[str, int, str], float]) -> list[str]:
    cases = {case: time for (_, _, case), time in times.items()}
    lines = [row("one call", "time", *(f": {name}" for name in YARDSTICKS)), "|---|---|---|---|"]
    for case, time in cases.items():
        ratios = (f"{time / cases[name]:.2f}" for name in YARDSTICKS)
        lines.append(row(case, f"{time:.0f} ns", *ratios))
    return lines


def run_table(times: dict[tuple[str, int, str], float]) -> list[str]:
    ratios = [f"{loop} : {face}" for face in ("forward", "inverse") for loop in LOOPS]
    header = ("signal", "n", "forward", "inverse", *LOOPS, *ratios)
    lines = [row(*header), "|---" * len(header) + "|"]
    for signal, n in dict.fromkeys((signal, n) for signal, n, _ in times):
        at = {case: time for (s, m, case), time in times.items() if (s, m) == (signal, n)}
        absolute = [f"{number(at[case])} ns" for case in ("forward", "inverse", *LOOPS)]
        relative = [
            number(at[loop] / at[face]) for face in ("forward", "inverse") for loop in LOOPS
        ]
        lines.append(row(signal, n, *absolute, *relative))
    return lines


def main() -> None:
    benches = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["benchmarks"]
    tables = [
        *step_table(nanoseconds(benches, "step")),
        "",
        *run_table(nanoseconds(benches, "run")),
    ]
    sys.stdout.write("\n".join(tables) + "\n")


if __name__ == "__main__":
    main()
