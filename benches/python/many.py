"""How long `identify_many` takes, and how near it comes to single fits: `make bench-many`.

The actuators differ in ratios, weights, gain, both offsets, dead time and noise. The drive is a
decaying sine. Where every actuator has its own drive, amplitude and offset of the sine differ too.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import mpi_hyst as mh
import numpy as np
from records import RATE, Array, drive, heading, position, tell, timed


def compared(found: mh.results.ManyIdentifications, singles: list[Any]) -> str:
    """The squared errors beside those of single fits."""
    single = np.array([one.fit.rmse for one in singles])
    excess = (found.rmse[: single.size] / single) ** 2 - 1.0
    both = (
        f"by more than {limit:g} {np.mean(excess > limit):.1%} worse, "
        f"{np.mean(excess < -limit):.1%} better"
        for limit in LIMITS
    )
    return f"{'; '.join(both)}; worst {excess.max():.2g}, best {excess.min():.2g}"


LIMITS = (1e-6, 1e-4, 1e-3, 1e-2)
"""By how much a sum of squares may exceed that of the single fit, as a share."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("actuators", 4096), ("samples", 5000), ("operators", 16)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--singles", type=int, default=64, help="how many are fitted singly too")
    parser.add_argument("--weights", default="free")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    tell(heading())
    random = np.random.default_rng(asked.seed)
    options: dict[str, Any] = {
        **{"dt": 1.0 / RATE, "operators": asked.operators},
        **{"weights": asked.weights, "smoothness": 0.0},
    }
    u, singly = drive(asked.samples), min(asked.singles, asked.actuators)
    Y = np.column_stack([position(u, asked.operators, random) for _ in range(asked.actuators)])
    shape = f"{asked.samples} samples, {asked.operators} operators, {asked.threads} threads"

    def single(pair: tuple[Array, Array]) -> mh.results.Identification:
        alone: dict[str, Any] = {"dynamics": None, "creep": None, "loop_shift": None}
        alone |= {"input_map": None, "output_map": None, "ratios": "fit"}
        return mh.identify(pair[0], pair[1], **alone, **options)

    def in_parallel(pairs: list[tuple[Array, Array]]) -> list[mh.results.Identification]:
        with ThreadPoolExecutor(asked.threads) as pool:
            return list(pool.map(single, pairs))

    spent, found = timed(lambda: mh.identify_many(u, Y, threads=asked.threads, **options))
    tell(f"one drive: {asked.actuators} actuators, {shape}: {spent}")
    tell(f"  {found}")
    alone, fits = timed(lambda: in_parallel([(u, y.copy()) for y in Y.T[:singly]]))
    tell(f"  {singly} single fits in parallel: {alone}")
    tell(f"  sum of squares beside the single fit: {compared(found, fits)}")

    drives = np.column_stack(
        [drive(asked.samples, random.uniform(0.8, 1.0)) for _ in range(singly)]
    )
    own = np.column_stack([position(one.copy(), asked.operators, random) for one in drives.T])
    spent, found = timed(lambda: mh.identify_many(drives, own, threads=asked.threads, **options))
    tell(f"own drives: {singly} actuators, {shape}: {spent}")
    pairs = [(one.copy(), y.copy()) for one, y in zip(drives.T, own.T, strict=True)]
    alone, fits = timed(lambda: in_parallel(pairs))
    tell(f"  {singly} single fits in parallel: {alone}")
    same = all(fit.model == found[m] for m, fit in enumerate(fits))
    tell(f"  the models are {'the same' if same else 'others'}")


if __name__ == "__main__":
    main()
