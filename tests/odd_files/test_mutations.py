"""Ten thousand files that something happened to: never other numbers without a word.

`make test` draws a few hundred, always the same; `make test-random` draws ten thousand others.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

from odd_files.mutations import judged, mutated

PARTS = 20


@pytest.mark.parametrize("part", range(PARTS))
def test_a_mutated_file_is_right_or_refused_or_doubtful(
    part: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    is_random = settings().max_examples > 100
    count = 500 if is_random else 15
    seed = int(request.config.getoption("hypothesis_seed", None) or 0) if is_random else 0
    path, wrong = tmp_path / "record.csv", {}
    for number in range(count):
        one = (seed * PARTS + part) * count + number
        content, happened = mutated(one)
        path.write_bytes(content)
        said = judged(path)
        if said.startswith("wrong"):
            wrong[one] = f"{happened}: {said}"
    assert not wrong
