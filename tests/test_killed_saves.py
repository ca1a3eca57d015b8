"""What is left when a process is killed while it saves."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import mpi_hyst as mh
import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="fork and SIGKILL")


def test_a_killed_save_leaves_the_old_file_or_the_new_one() -> None:
    # In a process of its own, which has no threads when it forks.
    program = Path(__file__).with_name("killed_saves.py")
    done = subprocess.run(
        [sys.executable, str(program), "30", "1"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("30 saves killed: ")
    assert "no error, nothing left" in done.stdout


def test_only_copies_that_nobody_writes_are_removed(tmp_path: Path) -> None:
    import fcntl

    names = [f".mpi_hyst-{digit * 16}.tmp" for digit in "012"]
    left, living, link = (tmp_path / name for name in names)
    victim, other = tmp_path / "victim", tmp_path / ".other.tmp"
    for path in (left, living, victim, other):
        path.write_text("text")
    link.symlink_to(victim)
    with living.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        mh.paper.table_1().save(tmp_path / "model.json")
    names = sorted(one.name for one in tmp_path.iterdir())
    assert names == sorted(["model.json", living.name, link.name, victim.name, other.name])
    assert victim.read_text() == "text"
