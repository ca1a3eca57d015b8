"""Checks the built pages; `make linkcheck`.

Links that stay in them need their file and anchor. What a page loads must lie beside it: pages show
without a network.
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links of a page, and the anchors that links may name."""

    def __init__(self) -> None:
        """Begin with none."""
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take what a tag links to and what it is called."""
        for name, value in attrs:
            if value and (name == "id" or (tag == "a" and name == "name")):
                self.anchors.add(value)
            if value and (name == "href" or (name == "src" and tag in {"img", "script"})):
                self.links.append(value)
                style = tag == "link" and ("rel", "stylesheet") in attrs
                if (name == "src" or style) and urlsplit(value).netloc:
                    self.loads.append(value)


def read(path: Path) -> Page:
    """Return what is in a page."""
    page = Page()
    page.feed(path.read_text("utf-8"))
    return page


def broken(site: Path) -> list[str]:
    """Return a line for all that is wrong. Pages of rustdoc are checked by rustdoc."""
    own = [
        path for path in sorted(site.rglob("*.html")) if "rust" not in path.relative_to(site).parts
    ]
    pages = {path.resolve(): read(path) for path in own}
    found = []
    for path, page in pages.items():
        found += [
            f"{path.relative_to(site.resolve())}: {load}: needs the network" for load in page.loads
        ]
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                found.append(f"{path.relative_to(site.resolve())}: {link}: no such file")
            elif (
                parts.fragment
                and target in pages
                and unquote(parts.fragment) not in pages[target].anchors
            ):
                found.append(f"{path.relative_to(site.resolve())}: {link}: no such anchor")
    return found


def main(arguments: list[str]) -> int:
    """Write what is broken, and return how the check ended."""
    site = Path(arguments[0])
    if not (site / "index.html").is_file():
        sys.stderr.write(f"{site}: no index.html in it: make docs\n")
        return 2
    lines = broken(site)
    for line in lines:
        sys.stderr.write(f"{line}\n")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
