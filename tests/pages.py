"""Pages of any text, and pages in a headless browser: how wide they are, what reaches beyond."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from mpi_hyst._report.page import Card, Table, environment

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
LEFT_OUT = f"LEFT OUT: no report is looked at in a browser, as there is none of {BROWSERS}"
WIDTHS = (1200, 500)
_PAPER = 688  # A4 between its margins, in px
_SECONDS = 120  # a machine under load starts a browser in ten

# A page is loaded into a frame of the width of the screen. What scrolls within a box of its own has
# room; everything else must end within the page.
_PROBE = """<!DOCTYPE html><meta charset="utf-8"><body style="margin:0">
<iframe id="page" style="border:0;width:{width}px;height:900px" srcdoc="{page}"></iframe>
<pre id="told"></pre><script>
const frame = document.getElementById("page");
frame.addEventListener("load", () => {{
  const made = frame.contentDocument, root = made.documentElement, wide = root.clientWidth;
  const scrolling = ["auto", "scroll"], blocks = made.body.querySelectorAll("section, tr").length;
  const boxed = (one) => {{
    for (let up = one.parentElement; up; up = up.parentElement)
      if (scrolling.includes(frame.contentWindow.getComputedStyle(up).overflowX)) return true;
    return false;
  }};
  const beyond = [...made.body.querySelectorAll("*")].filter((one) => !boxed(one))
    .filter((one) => one.getBoundingClientRect().right > wide + 1)
    .map((one) => `${{one.tagName.toLowerCase()}}: ${{one.textContent.trim().slice(0, 40)}}`);
  document.getElementById("told").textContent = JSON.stringify(
    {{ wide, scrolls: root.scrollWidth, beyond, blocks }});
}});</script></body>"""


_PAGE = """
{% extends "page.html.j2" %}
{% import "blocks.html.j2" as blocks with context %}
{% block title %}{{ text }}{% endblock %}
{% block subtitle %}{{ text }}{% endblock %}
{% block sections %}
{% call blocks.section("a", text) %}
<p>{{ text }}</p>
{% if table %}{{ blocks.table(table, table.caption, table.note, best) }}{% endif %}
{% if pairs %}{{ blocks.pairs(pairs, text) }}{% endif %}
{% if lines %}{{ blocks.lines(lines) }}{% endif %}
{% endcall %}
{% endblock %}
{% block footer %}{{ text }}{% endblock %}
"""


def page_of(
    text: str,
    cards: Sequence[Card],
    *,
    table: Table | None = None,
    best: Sequence[int] = (),
    **others: Any,
) -> str:
    """A report in which this text stands wherever a report has text."""
    left_out = dict.fromkeys(("verdict", "provenance", "pairs", "lines"))
    values = {"text": text, "cards": cards, "contents": [], "table": table, "best": best}
    return environment().from_string(_PAGE).render(left_out | values | others)


def browser() -> str:
    """The browser of this machine; without one the test is left out, which its reason says."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(LEFT_OUT)
    return found


def overflow(text: str, width: int, directory: Path) -> list[str]:
    """What of a page reaches beyond a screen of this width, by its element and its text."""
    probe = directory / f"probe{width}.html"
    probe.write_text(_PROBE.format(width=width, page=html.escape(text)), encoding="utf-8")
    options = [
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--virtual-time-budget=5000",
    ]
    profile = f"--user-data-dir={directory / 'profile'}"
    ended = subprocess.run(
        [browser(), *options, profile, "--window-size=1400,1000", "--dump-dom", probe.as_uri()],
        capture_output=True,
        text=True,
        timeout=_SECONDS,
        check=True,
    )
    said = re.search(r'<pre id="told">(.*?)</pre>', ended.stdout, re.DOTALL)
    assert said and said[1], f"the browser told nothing: {ended.stderr[-500:]}"
    told = json.loads(html.unescape(said[1]))
    assert told["wide"] == width and told["blocks"] > 0, told
    found: list[str] = told["beyond"]
    return found or [f"the page scrolls: {told['scrolls']}"] * (told["scrolls"] > width)


def assert_fits(report: Path, folder: Path) -> None:
    """Look at a report on every screen, and on paper."""
    text = report.read_text("utf-8")
    for width in WIDTHS:
        assert overflow(text, width, folder) == []
    assert overflow(_printed(text), _PAPER, folder) == []


def _printed(text: str) -> str:
    """Return a page whose style is that of paper, on the screen."""
    assert "@media print" in text and "@media screen" in text
    return text.replace("@media print", "@media all").replace("@media screen", "@media not all")
