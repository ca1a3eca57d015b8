"""The pages of docs: every code block runs or says why not; links between files lead to one."""

from __future__ import annotations

import doctest
import re
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import mpi_hyst as mh
import pytest

CHECKOUT = Path(__file__).parents[1]
DOCS = CHECKOUT / "docs"
# The first page of a code host, and what lies beside it.
FRONT = [
    CHECKOUT / f"{name}.md" for name in ("README", "ARCHITECTURE", "CONTRIBUTING", "RELIABILITY")
]
PAGES = [*FRONT, *sorted(path for path in DOCS.rglob("*.md") if "auto_gallery" not in path.parts)]
NAMES = [str(page.relative_to(CHECKOUT)) for page in PAGES]
# What is a drawing or a directive of Sphinx, and no code.
NO_CODE = {"text"}
MARK = re.compile(r"<!-- (?:not run|run by): \S.* -->$")
RUNS = re.compile(r"<!-- run by: (?P<runs>\S.*) -->$")
A_FILE = re.compile(r"(?:[\w.-]+/)*[\w.-]+\.(?:py|rs|md)\b")
FENCE = re.compile(r"^```(?P<kind>\S.*)?$")
FORMULA = re.compile(r"\$\$.*?\$\$", re.DOTALL)
COLUMNS = 110
LINK = re.compile(r"\]\((?!https?:|mailto:)(?P<target>[^)\s]+)\)")


class Block(NamedTuple):
    """A fenced block of a page."""

    line: int
    kind: str
    text: str
    mark: str


def blocks(page: Path) -> list[Block]:
    found: list[Block] = []
    opened: tuple[int, str] | None = None
    lines = page.read_text("utf-8").splitlines()
    for i, line in enumerate(lines):
        if opened is None and (begins := FENCE.match(line)):
            opened = (i, begins["kind"] or "")
        elif opened is not None and line == "```":
            first, kind = opened
            before = lines[first - 1] if first else ""
            found.append(Block(first + 1, kind, "\n".join(lines[first + 1 : i]) + "\n", before))
            opened = None
    assert opened is None, f"{page}: a block is not closed"
    return found


def test_there_are_pages_and_blocks() -> None:
    assert len(PAGES) > 40
    assert sum(len(blocks(page)) for page in PAGES) > 100


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_every_block_runs_or_says_why_not(page: Path) -> None:
    executed = page.read_text("utf-8").startswith("---\nfile_format: mystnb\n")
    for block in blocks(page):
        where = f"{page.name}, line {block.line}"
        if block.kind.startswith("{code-cell}"):
            assert executed, f"{where}: the page has no kernel in its head, so this cell never runs"
        elif not block.kind.startswith("{") and block.kind not in NO_CODE:
            runs = block.kind == "python" and block.text.startswith(">>> ")
            assert runs or MARK.match(block.mark), f"{where}: neither run nor marked"


@pytest.mark.parametrize("page", PAGES[len(FRONT) :], ids=NAMES[len(FRONT) :])
def test_every_line_of_code_fits_a_desk_screen(page: Path) -> None:
    """Where 1200 px end: comments at the ends of lines would be cut, and commands scroll."""
    code = [one for one in blocks(page) if not re.match(r"\{(?!code-cell)", one.kind)]
    lines = [line for block in code for line in block.text.splitlines()]
    assert [line for line in lines if len(line) > COLUMNS] == []


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_what_runs_a_block_is_there(page: Path) -> None:
    marks = [match["runs"] for block in blocks(page) if (match := RUNS.match(block.mark))]
    files = [A_FILE.findall(mark) for mark in marks]
    assert [mark for mark, named in zip(marks, files, strict=True) if not named] == []
    assert [name for named in files for name in named if not (CHECKOUT / name).is_file()] == []


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_examples_give_what_they_show(page: Path) -> None:
    """All examples of a page are one session, but for those that run elsewhere."""
    examples = [
        block
        for block in blocks(page)
        if block.text.startswith(">>> ") and not MARK.match(block.mark)
    ]
    text = "\n".join(block.text for block in examples)
    test = doctest.DocTestParser().get_doctest(text, {}, page.name, str(page), 0)
    report: list[str] = []
    failed = doctest.DocTestRunner(verbose=False).run(test, out=report.append).failed
    assert failed == 0, "".join(report)


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_every_link_between_files_leads_to_one(page: Path) -> None:
    """Such links work on a code host too, where no Sphinx is."""
    text = FORMULA.sub("", page.read_text("utf-8"))
    targets = [match["target"].partition("#")[0] for match in LINK.finditer(text)]
    # The gallery is there once it is built.
    sought = [page.parent / target for target in targets if target and "auto_gallery" not in target]
    assert [str(path) for path in sought if not path.exists()] == []


def test_the_example_of_the_first_page_is_that_of_the_readme() -> None:
    """What the README shows is run above; once is enough."""
    (shown,) = (one for one in blocks(DOCS / "index.md") if one.text.startswith(">>> "))
    assert shown.text in (CHECKOUT / "README.md").read_text("utf-8")


def test_every_public_module_has_a_page() -> None:
    modules = [name for name in mh.__all__ if isinstance(getattr(mh, name), ModuleType)]
    contents = (DOCS / "reference" / "index.md").read_text("utf-8").splitlines()
    assert [name for name in modules if name not in contents] == []
    assert [name for name in modules if not (DOCS / "reference" / f"{name}.md").is_file()] == []
