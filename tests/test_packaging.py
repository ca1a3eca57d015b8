"""What comes with the package: the licences of all that is in it, and nothing of the machine."""

from __future__ import annotations

import importlib
import sys
import zipfile
from pathlib import Path

import pytest
from check_wheel import DATA, LICENCES, faults

ROOT = Path(__file__).resolve().parent.parent


def test_the_licences_are_those_of_the_linked_crates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    make_licences = importlib.import_module("make_licences")

    assert len(make_licences.linked()) > 50
    stale = "make licences writes it anew"
    assert make_licences.FILE.read_text("utf-8") == make_licences.written(), stale


def test_the_wheel_takes_the_licences_along() -> None:
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        tomllib = pytest.importorskip("tomli")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert set(project["license-files"]) == LICENCES
    assert all((ROOT / name).is_file() for name in LICENCES)


@pytest.mark.parametrize(
    ("names", "code", "said"),
    [
        (LICENCES, b"cargo/registry/src", []),
        (LICENCES, b"/home/me/.cargo/registry", ["p/_core.so shows /home/me"]),
        ({"LICENSE"}, b"", ["no licence file THIRD_PARTY_LICENSES.txt"]),
    ],
)
def test_a_wheel_is_looked_into(
    tmp_path: Path, names: set[str], code: bytes, said: list[str]
) -> None:
    path = tmp_path / "p.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("p/_core.so", code)
        for name in DATA:
            archive.writestr(name, "")
        for name in names:
            archive.writestr(f"p-1.dist-info/licenses/{name}", "text")
    assert faults(path, ["/home/me"]) == said


def test_a_wheel_without_the_measured_records_is_found(tmp_path: Path) -> None:
    path = tmp_path / "p.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("p/_core.so", "")
        for name in LICENCES:
            archive.writestr(f"p-1.dist-info/licenses/{name}", "text")
    assert faults(path, []) == [f"no {name}" for name in sorted(DATA)]


def test_the_measured_records_are_where_the_wheel_takes_them_from() -> None:
    assert all((ROOT / "python" / name).is_file() for name in DATA)
