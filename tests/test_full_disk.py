"""What commands and `save` leave where the disk is full."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest


def may_mount() -> bool:
    """Whether this user may mount a disk."""
    with tempfile.TemporaryDirectory() as name:
        made = ["mount", "-t", "tmpfs", "-o", "size=4096", "tmpfs", name]
        if shutil.which("mount") is None or subprocess.run(made, check=False).returncode != 0:
            return False
        subprocess.run(["umount", name], check=True)
        return True


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="mounts as root")
def test_a_memory_on_a_full_disk_is_refused(tmp_path: Path) -> None:
    if not may_mount():
        pytest.skip("no disk of its own may be mounted")
    # In a process of its own, which has no threads when it forks, and which a bus error may end.
    code = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import full_disk
here = Path.cwd()
full_disk.prepare(here)
(here / "disk").mkdir()
full_disk.shared_memory(here / "disk")
"""
    tests = str(Path(__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", code, tests],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(os.name == "nt", reason="limits on the size of files")
def test_a_full_disk_is_one_line_and_nothing_half_written(tmp_path: Path) -> None:
    # In a process of its own, which has no threads when it forks.
    code = """
import os, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import full_disk
here = Path.cwd()
full_disk.prepare(here)
print(full_disk.every(here, full_disk.QUICK, [100, 20_000]))
print(full_disk.saves(here, [0, 100, 10_000_000]))
"""
    tests = str(Path(__file__).parent)
    done = subprocess.run(
        [sys.executable, "-c", code, tests],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    # Where 20 000 bytes are enough for the first file, the second is refused.
    assert done.stdout == "Figures(runs=10, refused=9)\nFigures(runs=3, refused=2)\n"
