"""Hypothesis profiles, the directory that tests of the command line work in, and what is run once.

The default profile draws the same examples every time, `random` many more from a seed:
`make test-random` prints one and uses it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from commands import HEADER, RATE, actuator, record_rows, write_csv
from hypothesis import HealthCheck, settings
from mpi_hyst._cli.commands import commands

for name, examples in (("default", 40), ("random", 1000)):
    settings.register_profile(
        name,
        max_examples=examples,
        deadline=None,
        # The same examples at the desk and in CI: a failure is the fault of a change.
        derandomize=name == "default",
        # drawing a model and a history is most of the work, and a busy machine is no bug
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )
# Where --hypothesis-profile is given, pytest loads that one instead.
settings.load_profile("default")


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


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    """The files of `mpi-hyst demo`, and what it said: the computation of some seconds, once."""
    directory = tmp_path_factory.mktemp("demo") / "new" / "directory"
    result = CliRunner().invoke(commands, ["demo", "--out", str(directory)], catch_exceptions=False)
    return directory, result


@pytest.fixture(scope="session")
def reproduced(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    """The same of `mpi-hyst reproduce --quick`."""
    directory = tmp_path_factory.mktemp("reproduce") / "new" / "directory"
    arguments = ["reproduce", "--quick", "--out", str(directory)]
    return directory, CliRunner().invoke(commands, arguments, catch_exceptions=False)
