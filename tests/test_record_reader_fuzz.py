"""The seeds of the fuzzed reader, what fuzzing has found, and some mutations of both."""

from __future__ import annotations

import importlib.util
import random
from collections.abc import Callable
from pathlib import Path

import pytest

FUZZ = Path(__file__).parent.parent / "checks" / "fuzz"
SEEDS = sorted((FUZZ / "seeds" / "record_reader").iterdir())


def target() -> Callable[[bytes, Path], bool]:
    spec = importlib.util.spec_from_file_location("record_reader", FUZZ / "record_reader.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    take: Callable[[bytes, Path], bool] = module.take
    return take


take = target()


@pytest.mark.parametrize("seed", SEEDS, ids=lambda path: path.name)
def test_seeds_and_what_was_found(seed: Path, tmp_path: Path) -> None:
    is_record = take(seed.read_bytes(), tmp_path)
    assert is_record != seed.name.startswith("found")


def mutation(draw: random.Random, seeds: list[bytes]) -> bytes:
    """Return a seed with some bytes changed, left out, or put in from another one."""
    data = bytearray(draw.choice(seeds))
    for _ in range(draw.randint(1, 5)):
        at = draw.randint(1, len(data))
        what = draw.randrange(3)
        if what == 0:
            data[at : at + 1] = draw.randbytes(1)
        elif what == 1:
            del data[at : at + draw.randint(1, 20)]
        else:
            other = draw.choice(seeds)
            begin = draw.randrange(len(other))
            data[at:at] = other[begin : begin + draw.randint(1, 20)]
    return bytes(data)


def test_mutations_of_the_seeds_are_records_or_refused(tmp_path: Path) -> None:
    draw = random.Random(20170401)
    seeds = [path.read_bytes() for path in SEEDS]
    taken = [take(mutation(draw, seeds), tmp_path) for _ in range(1000)]
    assert 100 < sum(taken) < 900  # both happen, often
