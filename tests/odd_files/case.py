"""A case: what a user runs first, what must be said, and what follows from that."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import mpi_hyst as mh
import numpy as np
from commands import run

from odd_files.bench import RATE, Bench

Write = Callable[[Path], Sequence[Path]]
"""Writes the files of a trial into a directory."""

# Where neither creep nor dynamics is the point: a fit of a quarter of a second.
PLAIN = (
    "--operators",
    "8",
    "--weights",
    "free",
    "--smoothness",
    "0",
    "--creep",
    "none",
    "--loop-shift",
    "none",
    "--dynamics",
    "none",
)
WITH_DYNAMICS = PLAIN[:-2]

_ROUNDS = 3  # a defect may hide another one
_ALL = re.compile(r"--(?:leave-out|mend) \d+:\d+")
_ONE = re.compile(r"--negate-output|--(?:skip|rows) \d+")


@dataclass(frozen=True)
class Trial:
    """Files, and the options with which they are identified."""

    write: Write
    options: Sequence[str] = ()
    scale: tuple[float, float] = (1.0, 1.0)
    """Drive and position in the file, over those of the bench."""


@dataclass(frozen=True)
class Case:
    """A name, the trial of a user who knows nothing, and the trial that follows the hint.

    Without `then` the first trial must give a right model. With it the first must be amber, red or
    refused, saying the words of `says`; and the second must give a right model. "hint" is the first
    trial with the options that the hints spell out.
    """

    name: str
    bench: Bench
    first: Trial
    says: Sequence[str] = ()
    then: Trial | Literal["hint"] | None = None
    limit: float = 0.01
    """Error of the prediction, rms, as a share of the range."""
    fit: Sequence[str] = PLAIN


@dataclass(frozen=True)
class Outcome:
    """What a trial came to."""

    verdict: str
    """green, amber, red or refused."""
    text: str
    error: float
    """Of the prediction of an unseen trajectory, rms over its range; inf without a stage."""


def attempt(case: Case, trial: Trial, place: Path) -> Outcome:
    """Run one trial in an empty directory."""
    place.mkdir()
    paths = [str(path) for path in trial.write(place)]
    before = set(place.iterdir())
    stage = place / "stage.json"
    result = run("identify", *paths, *trial.options, *case.fit, "-o", str(stage))
    if result.exit_code != 0:
        assert result.exit_code == 2 and set(place.iterdir()) == before, result.output
        return Outcome("refused", result.output, np.inf)
    verdict = result.output.partition("verdict: ")[2].split()[0]
    return Outcome(verdict, result.output, prediction_error(case.bench, stage, trial.scale))


def prediction_error(bench: Bench, path: Path, scale: tuple[float, float]) -> float:
    """Return how far a stage is from the bench on a clean, unseen trajectory."""
    stage = mh.load(str(path))
    assert isinstance(stage, mh.Stage)
    drive, known = bench.unseen()
    true = scale[1] * bench.position(drive)[known:]
    error = stage.forward(dt=1.0 / RATE).run(scale[0] * drive)[known:] - true
    # The zero of a sensor is that of its record.
    return float(np.std(error) / np.ptp(true))


def spelled_out(text: str) -> list[list[str]]:
    """Return the options in the hints: all places, or the first of what excludes each other."""
    hints = [line for line in text.splitlines() if "try: " in line or "error: " in line]
    found = [option for line in hints for option in _ALL.findall(line)]
    one = [option for line in hints for option in _ONE.findall(line)]
    chosen = found or one[:1]
    return [option.split() for option in dict.fromkeys(chosen)]


def followed(case: Case, found: Outcome, place: Path) -> Outcome:
    """Follow the hints until the verdict is green, or nothing else is spelled out."""
    options: list[list[str]] = []
    for number in range(_ROUNDS):
        more = spelled_out(found.text)
        if found.verdict == "green" or not more:
            break
        once = {option[0] for option in more} & {"--skip", "--rows"}
        options = [option for option in options if option[0] not in once] + more
        words = [word for option in options for word in option]
        trial = replace(case.first, options=[*case.first.options, *words])
        found = attempt(case, trial, place / f"then{number}")
    assert options, found.text
    return found


def check(case: Case, place: Path) -> None:
    """Fail unless the case ends in a right model, or in a hint that leads to one."""
    found = attempt(case, case.first, place / "first")
    if case.then is None:
        assert found.error < case.limit, (found.error, found.text)
        return
    assert found.verdict in ("amber", "red", "refused"), (found.error, found.text)
    for words in case.says:
        assert words in found.text, found.text
    second = (
        followed(case, found, place)
        if case.then == "hint"
        else attempt(case, case.then, place / "then")
    )
    assert second.error < case.limit, (second.error, second.text)
