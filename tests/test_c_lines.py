"""The lines of `cc` in README and docs/c.md, run as they stand there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
EXAMPLES = CHECKOUT / "crates" / "hysteresis-capi" / "examples"

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that looks like the checkout after `make capi`."""
    made = tmp_path_factory.mktemp("checkout")
    library = made / "target" / "capi"
    subprocess.run(["make", "capi", f"CAPI={library}"], cwd=CHECKOUT, check=True)
    (made / "crates").symlink_to(CHECKOUT / "crates")
    return made


def lines(file: str) -> list[str]:
    """Return the lines of the block of commands that calls the compiler."""
    text = (CHECKOUT / file).read_text("utf-8")
    (block,) = (one for one in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) if "cc -std" in one)
    return str(block).replace("\\\n", " ").splitlines()


def run(folder: Path, *commands: str) -> str:
    # Nothing of this machine's own settings helps them along.
    names = {"LD_LIBRARY_PATH", "LIBRARY_PATH", "CPATH", "PKG_CONFIG_PATH"}
    there = {name: value for name, value in os.environ.items() if name not in names}
    done = subprocess.run(
        ["sh", "-e", "-c", "\n".join(commands)],
        cwd=folder,
        env=there,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_those_of_the_readme(folder: Path) -> None:
    first, *others = lines("README.md")
    assert first == "make capi" and len(others) == 3
    assert "stopped at 0" in run(folder, *others)


@pytest.mark.skipif(shutil.which("pkg-config") is None, reason="no pkg-config")
@pytest.mark.parametrize("which", [0, 1], ids=["shared", "static"])
def test_those_of_the_page_of_c(folder: Path, which: int) -> None:
    shutil.copy(EXAMPLES / "c" / "closed_loop.c", folder / "loop.c")
    export, *compile_ = lines("docs/c.md")
    assert len(compile_) == 2
    asked = [export, compile_[which], f"./loop {EXAMPLES / 'stage.json'}"]
    assert "stopped at 0" in run(folder, *asked)
