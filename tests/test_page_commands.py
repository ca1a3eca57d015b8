"""Commands on the pages: `mpi-hyst` takes their options, and `make` has their targets."""

from __future__ import annotations

import re
import shlex
from contextlib import suppress
from pathlib import Path

import click
import pytest
from mpi_hyst._cli.commands import commands
from test_docs import CHECKOUT, NAMES, PAGES, blocks

INLINE = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
TARGET = re.compile(r"^([a-z-]+):", re.MULTILINE)
# What stands for something else, or for what is left out.
NO_COMMAND = re.compile(r"\.\.\.|…|[|=] *$|\w\|\w")


def named(page: Path) -> list[str]:
    """All commands of a page: the lines of its blocks for a shell, and those within a sentence."""
    text = page.read_text("utf-8")
    found = INLINE.findall(re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE))
    for block in blocks(page):
        if block.kind == "sh" or block.text.startswith("%%shell"):
            found += block.text.replace("\\\n", " ").splitlines()
    return [line.strip() for line in found if not NO_COMMAND.search(line)]


def words(line: str, program: str) -> list[str]:
    """What a line gives to a program; nothing if it is a line for another one."""
    given = shlex.split(line, comments=True) if line.startswith(f"{program} ") else []
    end = given.index("|") if "|" in given else len(given)
    return given[1:end]


def parse(given: list[str]) -> None:
    """Let click read options and arguments, but run nothing."""
    # A command keeps the help options of the first context it meets: it must be the real one.
    context = click.Context(commands, **commands.context_settings)
    for word in given:
        if "." in word and not word.startswith("-"):  # a file that the command reads
            Path(word).touch()
    name, command, rest = commands.resolve_command(context, given)
    assert command is not None
    if not {"--help", "--version"} & set(rest):
        # A sentence leaves out what does not matter there.
        with suppress(click.MissingParameter):
            command.make_context(name, rest, parent=context)


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_the_command_line_takes_what_is_shown(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [given for line in named(page) if (given := words(line, "mpi-hyst"))]
    monkeypatch.chdir(tmp_path)
    for given in lines:
        # A sentence may name a command alone.
        if len(given) > 1 or given[0] not in commands.commands:
            parse(given)


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_make_has_what_is_named(page: Path) -> None:
    targets = set(TARGET.findall((CHECKOUT / "Makefile").read_text("utf-8")))
    wanted = {
        word
        for line in named(page)
        for word in words(line, "make")
        if "=" not in word and not word.startswith("-")
    }
    assert wanted <= targets


def test_commands_are_found_and_wrong_ones_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert sum(bool(words(line, "mpi-hyst")) for page in PAGES for line in named(page)) > 15
    assert sum(bool(words(line, "make")) for page in PAGES for line in named(page)) > 30
    monkeypatch.chdir(tmp_path)
    parse(["precompensate", "stage.json", "target.csv", "--lead-in", "0.1", "-o", "drive.csv"])
    with pytest.raises(click.UsageError):
        parse(["precompensate", "stage.json", "target.csv", "--lead", "0.1", "--none"])
    with pytest.raises(click.UsageError):
        parse(["compensate", "stage.json"])
