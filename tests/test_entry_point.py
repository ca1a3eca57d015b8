"""The command as it is installed: its entry point, missing extras, and an interrupt."""

from __future__ import annotations

import importlib.metadata
import os
import signal
import subprocess
import sys
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import pytest

COLUMNS = ["--input", "drive_v", "--output", "position_um"]


def names_in(directory: Path) -> set[str]:
    return {path.name for path in directory.iterdir()}


def python(*code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "\n".join(code)], capture_output=True, text=True, check=False
    )


def test_the_real_command_refuses_with_one_line(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mpi_hyst._cli", "identify", "missing.csv", *COLUMNS]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == "mpi-hyst: error: missing.csv: No such file or directory\n"
    assert names_in(tmp_path) == set()


@pytest.mark.parametrize("package", ["click", "tqdm"])
def test_a_missing_extra_is_one_line(package: str) -> None:
    ended = python(
        f"import sys; sys.modules[{package!r}] = None",
        "from mpi_hyst._cli.__main__ import main",
        "main()",
    )
    assert ended.returncode == 2
    expected = f"mpi-hyst: error: the command line needs {package}: pip install 'mpi_hyst[all]'\n"
    assert ended.stderr == expected


@pytest.mark.parametrize("package", ["matplotlib", "jinja2"])
@pytest.mark.parametrize("arguments", [["demo"], ["identify", "a", *COLUMNS, "--report", "b"]])
def test_a_missing_report_extra_is_one_line(package: str, arguments: list[str]) -> None:
    ended = python(
        f"import sys; sys.modules[{package!r}] = None; sys.argv[1:] = {arguments!r}",
        "from mpi_hyst._cli.__main__ import main",
        "main()",
    )
    assert ended.returncode == 2
    assert ended.stderr.endswith(f" needs {package}: pip install 'mpi_hyst[all]'\n")
    assert ended.stderr.count("\n") == 1


def test_the_library_needs_no_extra() -> None:
    ended = python(
        "import sys, mpi_hyst",
        "print(sorted({'click', 'tqdm', 'jinja2', 'matplotlib'} & set(sys.modules)))",
    )
    assert ended.stdout == "[]\n", ended.stderr


@pytest.mark.parametrize("package", ["click", "mpi_hyst._cli.commands"])
def test_an_interrupt_while_packages_are_imported_is_one_line(package: str) -> None:
    ended = python(
        "import sys",
        "from mpi_hyst._cli.__main__ import main",
        "class Interrupt:",
        "    def find_spec(name, path=None, target=None):",
        f"        if name == {package!r}: raise KeyboardInterrupt",
        "sys.meta_path.insert(0, Interrupt)",
        "main()",
    )
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr == "mpi-hyst: error: interrupted, nothing written\n"


ENTRY = [
    "import signal, sys",
    # Where the tests run in the background it would be ignored.
    "signal.signal(signal.SIGINT, signal.default_int_handler)",
    "class Interrupt:",
    "    def find_spec(name, path=None, target=None):",
    "        if name == package: signal.raise_signal(signal.SIGINT)",
    "sys.meta_path.insert(0, Interrupt)",
    "sys.argv[1:] = ['--version']",
    "from mpi_hyst_command import main",
]


@pytest.mark.parametrize(
    "package", ["mpi_hyst", "numpy", "mpi_hyst._core", "click", "mpi_hyst._cli.commands"]
)
def test_an_interrupt_from_the_start_of_the_command_is_one_line(package: str) -> None:
    ended = python(f"package = {package!r}", *ENTRY, "main()")
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr == "mpi-hyst: error: interrupted, nothing written\n"


def test_an_interrupt_that_is_ignored_stays_so() -> None:
    ignored = "signal.signal(signal.SIGINT, signal.SIG_IGN)"
    ended = python("package = 'numpy'", *ENTRY, ignored, "main()")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert mh.__version__ in ended.stdout


def test_the_command_runs_in_another_thread() -> None:
    code = ["import threading", "thread = threading.Thread(target=main)", "thread.start()"]
    ended = python("package = None", *ENTRY, *code, "thread.join()")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert mh.__version__ in ended.stdout


def test_an_interrupt_behind_the_imports_is_not_taken_for_one_of_them() -> None:
    ended = python(
        "package = None",
        *ENTRY,
        "from mpi_hyst._cli.commands import _Commands",
        "def leak(*_, **__):",
        "    print('said', end='')",
        "    raise KeyboardInterrupt",
        "_Commands.main = leak",
        "main()",
    )
    assert "KeyboardInterrupt" in ended.stderr and "nothing written" not in ended.stderr
    assert ended.stdout == "said"


def test_the_command_begins_outside_of_the_package() -> None:
    # What is inside is imported behind the whole package.
    (script,) = importlib.metadata.entry_points(group="console_scripts", name="mpi-hyst")
    assert script.value == "mpi_hyst_command:main"
    ended = python(
        "import sys, mpi_hyst_command", "print({'mpi_hyst', 'numpy'} & set(sys.modules))"
    )
    assert ended.stdout == "set()\n", ended.stderr


def interrupted(directory: Path, *options: str) -> tuple[int, str, str]:
    """Identify a long record, send a real SIGINT into the search, return status and what it said.

    Only the search is long: what is left to do for a partial model takes seconds.
    """
    drive = mh.signals.decaying_triangle(400.0, 1.0, cycles=300, rate=400.0)
    position = mh.paper.table_1_recovered().forward().run(drive)
    position += np.random.default_rng(1).normal(0.0, 0.015, drive.size)
    rows = [f"{x!r},{y!r}" for x, y in zip(drive.tolist(), position.tolist(), strict=True)]
    (directory / "long.csv").write_text("\n".join(["drive_v,position_um", *rows]), encoding="utf-8")
    command = ["identify", "long.csv", *COLUMNS, "-o", "out.json", *options]
    code = [
        "import signal, sys",
        # where the tests run in the background it would be ignored
        "signal.signal(signal.SIGINT, signal.default_int_handler)",
        f"sys.argv[1:] = {command!r}",
        "from mpi_hyst._cli import __main__, commands",
        "from mpi_hyst._cli import identify as room",
        # said as soon as the search has a first result
        "def show(fraction, best):",
        "    if not said: said.append(print('searching', flush=True))",
        "said = []",
        "from contextlib import contextmanager",
        "@contextmanager",
        "def bar(*_):",
        "    yield show",
        "room.progress_bar = bar",
        "__main__.main()",
    ]
    with subprocess.Popen(
        [sys.executable, "-c", "\n".join(code)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=directory,
    ) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "searching\n"
        running.send_signal(signal.SIGINT)
        told, said = running.communicate(timeout=300)
    return running.returncode, told, said


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_an_interrupt_leaves_nothing_behind(tmp_path: Path) -> None:
    status, told, said = interrupted(tmp_path, "--operators", "auto", "--report", "out.html")
    assert (status, told) == (130, ""), said
    assert said.strip() == "mpi-hyst: error: interrupted, nothing written"
    assert names_in(tmp_path) == {"long.csv"}


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize("operators", ["30", "auto"])
def test_an_interrupt_keeps_the_best_if_told_to(tmp_path: Path, operators: str) -> None:
    status, told, said = interrupted(
        tmp_path, "--operators", operators, "--report", "out.html", "--keep-partial"
    )
    assert status == 130, said
    assert said == "mpi-hyst: interrupted, the partial result is written\n"
    first, _, second = told.splitlines()[:3]
    assert first.startswith("verdict: ") and "but the search was interrupted" in first
    assert second.startswith("PARTIAL, the search was interrupted: ")
    assert names_in(tmp_path) == {"long.csv", "out.json", "out.html"}
    found = mh.load(tmp_path / "out.json")
    assert isinstance(found, mh.Stage)
    # While numbers of operators are tried, the best is one of them.
    assert found.hysteresis.operators in (
        (4, 6, 8, 12, 16, 20, 24, 32) if operators == "auto" else (30,)
    )
    page = (tmp_path / "out.html").read_text("utf-8")
    assert "<h1>Hysteresis of long.csv (partial)</h1>" in page
    assert "PARTIAL, the search was interrupted" in page
