"""How the command line writes files: whole or not at all, and only where a file may be."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest
from commands import COLUMNS, assert_refused, names_in, run
from mpi_hyst._files import write_file

posix = pytest.mark.skipif(os.name == "nt", reason="permissions, links and devices")


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_a_file_is_written_and_replaced(tmp_path: Path) -> None:
    for text in ("µm\n", "nm\n"):
        write_file(tmp_path / "out.csv", text)
        assert (tmp_path / "out.csv").read_bytes() == text.encode()
        assert names_in(tmp_path) == {"out.csv"}


@posix
@pytest.mark.parametrize("kept", [0o600, 0o640, 0o755])
def test_a_file_that_is_replaced_keeps_its_permissions(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "out.csv"
    path.write_text("old", encoding="utf-8")
    path.chmod(kept)
    write_file(path, "new")
    assert (mode(path), path.read_text("utf-8")) == (kept, "new")


@posix
def test_a_new_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "other").touch()
    write_file(tmp_path / "out.csv", "new")
    assert mode(tmp_path / "out.csv") == mode(tmp_path / "other")


@posix
def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.csv").write_text("old", encoding="utf-8")
    (tmp_path / "link.csv").symlink_to("real.csv")
    write_file(tmp_path / "link.csv", "new")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real.csv").read_text("utf-8") == "new"


@posix
def test_nothing_but_a_plain_file_is_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("nowhere")
    before = names_in(tmp_path)
    with pytest.raises(OSError, match="is not a regular file"):
        write_file(tmp_path / "pipe", "text")
    with pytest.raises(OSError, match="is a link to a file that does not exist"):
        write_file(tmp_path / "link", "text")
    assert names_in(tmp_path) == before
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


@posix
def test_nobody_can_plant_the_copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "victim").write_text("old", encoding="utf-8")
    monkeypatch.setattr("secrets.token_hex", lambda _: "known")
    (tmp_path / ".mpi_hyst-known.tmp").symlink_to("victim")
    with pytest.raises(FileExistsError):
        write_file(tmp_path / "out.csv", "text")
    assert (tmp_path / "victim").read_text("utf-8") == "old"
    monkeypatch.undo()
    for guess in (f"out.csv.{os.getpid()}.tmp", "out.csv.tmp", f".out.csv.{os.getpid()}.tmp"):
        (tmp_path / guess).symlink_to("victim")
    write_file(tmp_path / "out.csv", "text")
    assert (tmp_path / "victim").read_text("utf-8") == "old"


@posix
def test_file_and_name_are_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[str] = []
    sync, replace = os.fsync, Path.replace

    def fsync(number: int) -> None:
        steps.append("folder" if stat.S_ISDIR(os.fstat(number).st_mode) else "file")
        sync(number)

    def rename(path: Path, target: Path) -> Path:
        steps.append("rename")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(Path, "replace", rename)
    write_file(tmp_path / "out.csv", "text")
    assert steps == ["file", "rename", "folder"]


@pytest.mark.parametrize("broken", ["os.fsync", "pathlib.Path.replace"])
def test_what_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, broken: str
) -> None:
    (tmp_path / "out.csv").write_text("old", encoding="utf-8")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(broken, full)
    with pytest.raises(OSError, match="No space left"):
        write_file(tmp_path / "out.csv", "new")
    monkeypatch.undo()
    assert names_in(tmp_path) == {"out.csv"}
    assert (tmp_path / "out.csv").read_text("utf-8") == "old"


@posix
@pytest.mark.parametrize(
    ("name", "said"),
    [("n" * 300, "name too long"), ("loop", "symbolic links"), ("gone", "does not exist")],
)
def test_a_place_that_cannot_be_is_refused_before_the_work(
    there: Path, name: str, said: str
) -> None:
    (there / "loop").symlink_to("loop")
    (there / "gone").symlink_to("nowhere")
    before = names_in(there)
    # The record is missing too, which is seen only by reading it.
    for option in ("-o", "--report"):
        result = run("identify", "missing.csv", *COLUMNS, option, name)
        assert_refused(result, there, before, said)


def test_a_full_disk_at_the_report_leaves_the_model(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, _: str) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("mpi_hyst._cli.identify.write_file", full)
    options = ["--operators", "4", "-o", "found.json", "--report", "page.html"]
    result = run("identify", "record.csv", *COLUMNS, *options)
    assert result.exit_code == 2
    assert result.stderr == (
        "mpi-hyst: error: page.html: No space left on device; written before: found.json\n"
    )
    assert (there / "found.json").exists() and not (there / "page.html").exists()


def test_a_report_that_cannot_be_drawn_leaves_the_model(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> str:
        raise RuntimeError("no figure")

    monkeypatch.setattr("mpi_hyst._report.identify.report", broken)
    options = ["--operators", "4", "-o", "found.json", "--report", "page.html"]
    with pytest.raises(RuntimeError, match="no figure"):
        run("identify", "record.csv", *COLUMNS, *options)
    assert (there / "found.json").exists()


@posix
def test_an_interrupt_while_files_are_written_waits(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import signal

    def interrupted(path: Path, text: str) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        write_file(path, text)

    monkeypatch.setattr("mpi_hyst._cli.outputs.write_file", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        result = run("precompensate", "stage.json", "trajectory.csv", "-o", "drive.csv")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert (result.exit_code, result.stderr) == (0, "")
    assert "drive.csv" in result.stdout and (there / "drive.csv").exists()
