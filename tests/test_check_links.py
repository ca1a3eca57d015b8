"""The check of links finds files and anchors that are not there, and nothing else."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parent.parent / "docs" / "check_links.py"


def check(site: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(site)], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stderr


def made(site: Path, links: str) -> Path:
    (site / "deep").mkdir(parents=True)
    (site / "index.html").write_text(f'<h1 id="top">one</h1>{links}', "utf-8")
    (site / "deep" / "other page.html").write_text('<a name="old"></a><p id="new">', "utf-8")
    return site


def test_links_that_lead_somewhere_pass(tmp_path: Path) -> None:
    links = (
        '<a href="#top">a</a><a href="deep/other%20page.html#new">b</a><a href="deep/">c</a>'
        '<a href="deep/other%20page.html#old">d</a><a href="https://example.org/none#x">e</a>'
    )
    assert check(made(tmp_path / "site", links)) == (0, "")


def test_files_and_anchors_that_are_not_there_are_named(tmp_path: Path) -> None:
    links = (
        '<a href="none.html">a</a><a href="#none">b</a><a href="deep/other%20page.html#none">c</a>'
        '<img src="none.png">'
    )
    status, said = check(made(tmp_path / "site", links))
    assert status == 1
    assert said.splitlines() == [
        "index.html: none.html: no such file",
        "index.html: #none: no such anchor",
        "index.html: deep/other%20page.html#none: no such anchor",
        "index.html: none.png: no such file",
    ]


def test_what_a_page_loads_from_elsewhere_is_named(tmp_path: Path) -> None:
    loads = (
        '<script src="https://example.org/a.js"></script><img src="//example.org/b.png">'
        '<link rel="stylesheet" href="https://example.org/c.css">'
        '<link rel="canonical" href="https://example.org/d"><img src="data:image/png;base64,AA">'
    )
    status, said = check(made(tmp_path / "site", loads))
    assert status == 1
    assert said.splitlines() == [
        "index.html: https://example.org/a.js: needs the network",
        "index.html: //example.org/b.png: needs the network",
        "index.html: https://example.org/c.css: needs the network",
    ]


def test_a_folder_without_pages_is_told(tmp_path: Path) -> None:
    status, said = check(tmp_path)
    assert status == 2 and "make docs" in said
