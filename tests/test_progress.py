"""The progress bar of Python: what it is told, and when it closes."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import pytest
from test_entry_point import python


def test_a_fit_moves_the_bar_to_its_end(capsys: pytest.CaptureFixture[str]) -> None:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=4, rate=200.0)
    y = mh.paper.table_1_recovered().forward().run(u)
    bar = mh.ProgressBar("my fit")
    mh.identify(u, y, operators=4, progress=bar)
    assert bar.fraction == 1.0
    told = capsys.readouterr()
    assert told.out == "" and "my fit 100%" in told.err and "best rms" in told.err
    bar.close()  # a second time is no error


def test_what_takes_long_takes_the_bar(capsys: pytest.CaptureFixture[str]) -> None:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=4, rate=200.0)
    y = mh.paper.table_1_recovered().forward().run(u)
    with mh.ProgressBar("many") as bar:
        mh.identify_many(u, np.column_stack([y, 1.1 * y]), operators=4, progress=bar)
    assert bar.fraction == 1.0 and "done 2" in capsys.readouterr().err
    with mh.ProgressBar("loop") as bar:
        stage = mh.paper.plant("A1").stage
        stage.simulate(np.sin(np.arange(3000) / 100.0), dt=1e-4, progress=bar)
    assert bar.fraction == 1.0 and "loop 100%" in capsys.readouterr().err


def test_an_error_closes_the_bar(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError), mh.ProgressBar("fit") as bar:
        bar(0.25)
        mh.identify([0.0, 1.0], [0.0, 1.0], progress=bar)
    assert bar.fraction == 0.25 and capsys.readouterr().err.endswith("\n")


def test_a_wrong_name_and_a_missing_package_are_named() -> None:
    with pytest.raises(TypeError, match=r"^what: expected a text, got 3$"):
        mh.ProgressBar(3)  # type: ignore[arg-type]
    ended = python(
        "import sys; sys.modules['tqdm'] = sys.modules['tqdm.auto'] = None; import mpi_hyst as mh",
        "mh.ProgressBar('x')",
    )
    said = "ImportError: a progress bar needs tqdm.auto: pip install 'mpi_hyst[cli]'\n"
    assert ended.stderr.endswith(said)
