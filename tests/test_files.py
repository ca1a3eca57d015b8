"""Files of models and stages: written whole or not at all, and only where a file may be."""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mpi_hyst as mh
import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="permissions, links and pipes")

SAVES: list[Callable[[Path], None]] = [
    mh.paper.table_1().save,
    mh.Stage(mh.paper.table_1()).save,
    mh.ActuatorArray([mh.paper.table_1()]).save,
]


@pytest.mark.parametrize("save", SAVES)
def test_a_replaced_file_keeps_its_permissions(
    tmp_path: Path, save: Callable[[Path], None]
) -> None:
    path = tmp_path / "stage.json"
    # 0600 is what a copy has by itself.
    for mode in (0o600, 0o644, 0o660):
        path.write_text("old")
        path.chmod(mode)
        save(path)
        assert stat.S_IMODE(path.stat().st_mode) == mode
        assert path.read_text() != "old" and [one.name for one in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("save", SAVES)
def test_what_is_no_regular_file_stays_what_it_is(
    tmp_path: Path, save: Callable[[Path], None]
) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="pipe: is not a regular file"):
        save(pipe)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    target, link = tmp_path / "target.json", tmp_path / "link.json"
    target.write_text("old")
    link.symlink_to(target)
    mh.paper.table_1().save(link)
    assert link.is_symlink() and mh.load(target) == mh.paper.table_1()


def test_a_full_disk_leaves_the_old_file_and_nothing_new(tmp_path: Path) -> None:
    path = tmp_path / "stage.json"
    mh.paper.table_1().save(path)
    old = path.read_bytes()
    code = """
import resource, signal, sys
import mpi_hyst as mh
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
try:
    mh.paper.table_2().save(sys.argv[1])
except OSError as error:
    sys.exit(0 if error.filename == sys.argv[1] else 1)
sys.exit(2)
"""
    assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == 0
    assert path.read_bytes() == old and [one.name for one in tmp_path.iterdir()] == [path.name]


def test_every_copy_has_a_name_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names: list[str] = []
    replace = Path.replace

    def rename(path: Path, target: Path) -> Path:
        names.append(path.name)
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", rename)
    for _ in range(8):
        mh.paper.table_1().save(tmp_path / "stage.json")
    assert len(set(names)) == 8
    assert all(re.fullmatch(r"\.mpi_hyst-[0-9a-f]{16}\.tmp", name) for name in names)


def test_no_name_of_a_copy_can_be_foreseen(tmp_path: Path) -> None:
    # A link planted where a predictable copy would be is not written through.
    code = "import os, sys, mpi_hyst as mh; print(os.getpid(), flush=True); input(); "
    code += "mh.paper.table_1().save(sys.argv[1])"
    path, victim = tmp_path / "stage.json", tmp_path / "victim"
    victim.write_text("untouched")
    with subprocess.Popen(
        [sys.executable, "-c", code, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as running:
        assert running.stdout is not None
        (tmp_path / f"stage.json.{running.stdout.readline().strip()}.tmp").symlink_to(victim)
        running.communicate("\n", timeout=60)
    assert running.returncode == 0 and victim.read_text() == "untouched"


def test_a_file_of_another_kind_says_what_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "mirror.json"
    mh.ActuatorArray([mh.paper.table_1()]).save(path)
    with pytest.raises(ValueError, match=r"mirror.json: .* an array of actuators, which `mh.*`"):
        mh.load(path)
    oscillator = mh.plant.HystereticOscillator(
        0.5, 5.0, 2.5e4, mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    )
    oscillator.save(path)
    with pytest.raises(ValueError, match=r"an oscillator .* which `mh.plant.Hysteretic.*load`"):
        mh.load(path)
    oscillator.axes(1e-3).save(path)
    with pytest.raises(ValueError, match=r"a stage of several axes, which `mh.Multi.*load`"):
        mh.load(path)
