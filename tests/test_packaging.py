"""What comes with the package: the licences of all that is in it, and nothing of the machine."""

from __future__ import annotations

import importlib
import importlib.metadata
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import mpi_hyst
import pytest
import yaml
from check_platform import fault
from check_wheel import FILES, LICENCES, faults

ROOT = Path(__file__).resolve().parent.parent


def module_of_docs(monkeypatch: pytest.MonkeyPatch, name: str) -> Any:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    return importlib.import_module(name)


def test_the_licences_are_those_of_the_linked_crates(monkeypatch: pytest.MonkeyPatch) -> None:
    make_licences = module_of_docs(monkeypatch, "make_licences")
    assert len(make_licences.linked()) > 50
    stale = "make licences writes it anew"
    assert make_licences.FILE.read_text("utf-8") == make_licences.written(), stale


def crates_with_features(package: str) -> set[str]:
    """Return what a library stands on, each crate with the features that are asked of it."""
    asked = ["cargo", "tree", "--locked", f"--package={package}", "--edges=normal,build"]
    shown = ["--prefix=none", "--no-dedupe", "--format={p}|{f}"]
    told = subprocess.run([*asked, *shown], cwd=ROOT, check=True, capture_output=True, text=True)
    return set(told.stdout.splitlines())


@pytest.mark.parametrize("library", ["hysteresis-capi", "hysteresis-fmu"])
def test_all_libraries_stand_on_the_same_compiled_crates(library: str) -> None:
    others = crates_with_features(library) - crates_with_features("hysteresis-python")
    # With other features a crate, and all that stand on it, would be built once more.
    assert {line.split()[0] for line in others} == {library, "one-build"}, others


def toml(name: str) -> dict[str, Any]:
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        tomllib = pytest.importorskip("tomli")
    read: dict[str, Any] = tomllib.loads((ROOT / name).read_text("utf-8"))
    return read


def is_met(licence: str, allowed: set[str]) -> bool:
    """Return whether an SPDX expression can be met with the allowed licences alone."""
    # Some crates write a slash for OR.
    spaced = licence.replace("/", " OR ").replace(" WITH ", "\0")
    words = re.findall(r"[()]|[^\s()]+", spaced)

    def either() -> bool:
        met = both()
        while words and words[0] == "OR":
            words.pop(0)
            met = both() or met
        return met

    def both() -> bool:
        met = one()
        while words and words[0] == "AND":
            words.pop(0)
            met = one() and met
        return met

    def one() -> bool:
        word = words.pop(0)
        if word != "(":
            return word.replace("\0", " WITH ") in allowed
        met = either()
        assert words.pop(0) == ")"
        return met

    met = either()
    assert not words, licence
    return met


@pytest.mark.parametrize(
    ("licence", "met"),
    [
        ("MIT", True),
        ("GPL-3.0-only", False),
        ("MIT/GPL-3.0-only", True),
        ("GPL-3.0-only AND MIT OR Zlib", True),
        ("(MIT OR Zlib) AND GPL-3.0-only", False),
        ("MIT AND (GPL-3.0-only OR Zlib)", True),
        ("Apache-2.0 WITH LLVM-exception", True),
        ("Apache-2.0", False),
    ],
)
def test_a_licence_is_met(licence: str, met: bool) -> None:
    assert is_met(licence, {"MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"}) == met


def test_linked_crates_are_such_as_the_audit_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `make audit` asks of licences and sources, without its tool."""
    audit = toml("deny.toml")
    assert audit["sources"] == {"unknown-registry": "deny", "unknown-git": "deny"}
    allowed = set(audit["licenses"]["allow"])
    linked = module_of_docs(monkeypatch, "make_licences").linked()
    assert [crate["name"] for crate in linked if not is_met(crate["license"], allowed)] == []
    registry = "registry+https://github.com/rust-lang/crates.io-index"
    assert {crate["source"] for crate in linked} == {registry}


def test_the_wheel_takes_the_licences_along() -> None:
    project = toml("pyproject.toml")["project"]
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
        archive.writestr("p/libmpi_hyst_fmu.so", "")
        for name in FILES:
            archive.writestr(name, "")
        for name in names:
            archive.writestr(f"p-1.dist-info/licenses/{name}", "text")
    assert faults(path, ["/home/me"]) == said


def test_a_wheel_without_records_command_or_units_is_found(tmp_path: Path) -> None:
    path = tmp_path / "p.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("p/_core.so", "")
        for name in LICENCES:
            archive.writestr(f"p-1.dist-info/licenses/{name}", "text")
    assert faults(path, []) == [
        *(f"no {name}" for name in sorted(FILES)),
        "no library mpi_hyst_fmu",
    ]


def test_records_and_command_are_where_the_wheel_takes_them_from() -> None:
    assert all((ROOT / "python" / name).is_file() for name in FILES)


@pytest.mark.parametrize(
    ("system", "bits", "folder"),
    [("linux", "64", "linux64"), ("macos", "64", "darwin64"), ("windows", "32", "win32")],
)
def test_units_have_the_platforms_of_fmi(
    monkeypatch: pytest.MonkeyPatch, system: str, bits: str, folder: str
) -> None:
    units = module_of_docs(monkeypatch, "make_units")
    assert units.platform({"target_os": system, "target_pointer_width": bits}) == folder
    with pytest.raises(SystemExit, match="expected one of linux, macos, windows, got android"):
        units.platform({"target_os": "android", "target_pointer_width": bits})


def test_the_oldest_versions_are_those_of_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    versions = module_of_docs(monkeypatch, "lowest_versions")
    lowest = versions.lowest((ROOT / "pyproject.toml").read_text("utf-8"))
    assert {"numpy==1.24", "click==8.2", "matplotlib==3.8", "scipy==1.12"} <= set(lowest)
    assert not any("mpi_hyst" in one or ">=" in one for one in lowest)


def test_a_release_packs_units_in_every_wheel_and_tries_what_it_can() -> None:
    jobs = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text("utf-8"))["jobs"]
    assert set(jobs) == {"linux", "musllinux", "windows", "macos", "sdist", "release"}
    for name in ("linux", "musllinux", "windows", "macos"):
        steps = jobs[name]["steps"]
        build = [one.get("name") for one in steps].index("Build wheels")
        scripts = [one.get("run", "") for one in steps[:build]]
        scripts.append(steps[build]["with"].get("before-script-linux", ""))
        assert sum(script.endswith("docs/make_units.py") for script in scripts) == 1
        assert name == "musllinux" or any("mpi-hyst demo" in one.get("run", "") for one in steps)
    assert set(jobs["release"]["needs"]) == set(jobs) - {"release"}


@pytest.mark.parametrize(
    ("needs", "wrong"),
    [
        ("manylinux_2_28_x86_64", False),
        ("manylinux_2_17_x86_64", False),
        ("manylinux_2_35_x86_64", True),
    ],
)
def test_a_wheel_that_needs_a_newer_linux_is_found(needs: str, wrong: bool) -> None:
    name = "p-1-cp310-abi3-manylinux_2_17_x86_64.manylinux_2_28_x86_64.whl"
    told = f'{name} is consistent with\nthe following platform tag:\n"{needs}".\n'
    assert fault(name, told) == (f"{name}: needs {needs}" if wrong else "")
    assert fault(name, "nothing").startswith("auditwheel names no platform")


def test_the_version_is_that_of_the_crates() -> None:
    crates = (ROOT / "Cargo.toml").read_text("utf-8")
    assert f'\nversion = "{mpi_hyst.__version__}"\n' in crates
    assert importlib.metadata.version("mpi_hyst") == mpi_hyst.__version__
