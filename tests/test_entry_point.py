"""The command as it is installed: its entry point, missing extras, and an interrupt."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import mpi_hyst as mh
import pytest

COLUMNS = ["--input", "drive_v", "--output", "position_um"]


def names_in(directory: Path) -> set[str]:
    return {path.name for path in directory.iterdir()}


def python(*code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "\n".join(code)], capture_output=True, text=True, check=False
    )


def test_the_real_command_refuses_with_one_line(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mpi_hyst._command_line", "identify", "missing.csv", *COLUMNS]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == "mpi-hyst: error: missing.csv: No such file or directory\n"
    assert names_in(tmp_path) == set()


@pytest.mark.parametrize("package", ["click", "tqdm"])
def test_a_missing_extra_is_one_line(package: str) -> None:
    ended = python(
        f"import sys; sys.modules[{package!r}] = None",
        "from mpi_hyst._command_line import main",
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
        "from mpi_hyst._command_line import main",
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


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_an_interrupt_leaves_nothing_behind(tmp_path: Path) -> None:
    drive = mh.signals.decaying_triangle(400.0, 1.0, cycles=300, rate=400.0)
    position = mh.paper.table_1_recovered().forward().run(drive)
    rows = [f"{x!r},{y!r}" for x, y in zip(drive.tolist(), position.tolist(), strict=True)]
    (tmp_path / "long.csv").write_text("\n".join(["drive_v,position_um", *rows]), encoding="utf-8")
    command = ["identify", "long.csv", *COLUMNS, "--operators", "200", "-o", "out.json"]
    code = [
        f"import sys; sys.argv[1:] = {command!r}",
        "from mpi_hyst import _command_line, _commands, _identify",
        "print('ready', flush=True)",
        "_command_line.main()",
    ]
    with subprocess.Popen(
        [sys.executable, "-c", "\n".join(code)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    ) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "ready\n"
        time.sleep(1.0)  # into the search, which takes most of a minute
        assert running.poll() is None
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=30)
    assert running.returncode == 130, said
    assert "interrupted, nothing written" in said
    assert names_in(tmp_path) == {"long.csv"}
