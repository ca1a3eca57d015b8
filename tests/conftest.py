"""Hypothesis profiles: HYPOTHESIS_PROFILE=slow draws many more examples than the default, fast.

And the directory that tests of the command line work in.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from commands import HEADER, RATE, actuator, record_rows, write_csv
from hypothesis import HealthCheck, settings

for name, examples in (("fast", 60), ("slow", 2000)):
    settings.register_profile(
        name,
        max_examples=examples,
        deadline=None,
        # in CI a run must not depend on luck; at the desk every run looks at new examples
        derandomize=bool(os.environ.get("CI")),
        # drawing a model and a history is most of the work, and a busy machine is no bug
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A directory to be in, with a record, a model and a trajectory."""
    monkeypatch.chdir(tmp_path)
    write_csv(tmp_path / "record.csv", HEADER, record_rows())
    actuator().save(tmp_path / "stage.json")
    target = 1.2 * np.sin(np.arange(300) / 20.0)
    write_csv(
        tmp_path / "trajectory.csv",
        "time_s,target_um",
        [[sample / RATE, value] for sample, value in enumerate(target.tolist())],
    )
    return tmp_path
