"""What notebooks show of objects: valid HTML without scripts, escaped, with the numbers."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from stages import BENCHES, RATE
from support import any_models

VOID = {"br", "hr", "img", "meta", "polyline"}
MODEL = mh.paper.table_1_recovered()


class Page(HTMLParser):
    """Reads HTML strictly: every element is closed, in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        for name, value in attrs:
            assert not name.startswith("on") and name not in ("src", "href"), (tag, name, value)
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def page(shown: Any) -> Page:
    made = Page(shown._repr_html_())
    assert "script" not in made.tags and "style" not in made.tags
    return made


@pytest.fixture(scope="module")
def found() -> mh.results.Identification:
    u = mh.signals.decaying_triangle(500.0, 1.0, cycles=6, rate=200.0)
    y = MODEL.forward().run(u) + np.random.default_rng(1).normal(0.0, 0.01, u.size)
    return mh.identify(u, y, dt=5e-3, operators=6, validate=0.2)


def test_a_page_that_is_not_closed_is_found() -> None:
    for wrong in ("<div><b></div></b>", "<div>", '<div onclick="x"></div>'):
        with pytest.raises(AssertionError):
            Page(wrong)


@given(any_models())
def test_every_model_has_a_table(drawn: Any) -> None:
    model = drawn.model()
    shown = page(model)
    assert f"operators {model.operators}" in shown.text
    because = model.not_invertible_because
    assert ("exact inverse yes" if because is None else "exact inverse no:") in shown.text


def test_units_and_names_are_escaped() -> None:
    nasty = "<b>&\"'\u202e"
    stage = mh.Stage(MODEL, limits=(-5.0, 5.0), slew=3.0, noise=1e-3, units=(nasty, nasty))
    shown = page(stage)
    escaped = "<b>&\"'\\u202e"
    assert shown.text.startswith(f"Stage, {escaped} to {escaped}")
    assert f"-5.000 to 5.000 {escaped}" in shown.text and "b" not in shown.tags


def test_names_of_records_are_escaped(found: mh.results.Identification) -> None:
    stage = found.stage.with_records([("<script>x</script>.csv", "ab" * 32)])
    shown = page(stage)
    assert "record <script>x</script>.csv, SHA-256 abababababab…" in shown.text
    assert f"verdict: {found.verdict}" in shown.text


STAGES: dict[str, Callable[[], mh.Stage]] = {
    "A1": lambda: mh.paper.plant("A1").stage,
    "P3": lambda: mh.paper.plant("P3").stage,
    "bare": lambda: mh.Stage(mh.PrandtlIshlinskii([1.0], [0.0])),
    "huge": lambda: mh.Stage(mh.PrandtlIshlinskii([1e90, 1e90], [0.0, 1e9])),
    "everything": lambda: mh.Stage(
        MODEL,
        limits=(-500.0, 500.0),
        slew=1e4,
        dead_time=1e-4,
        amplifier_bandwidth=3e3,
        dynamics=[mh.plant.Modes([0.8, 0.2], [mh.plant.SecondOrder(800.0, 0.02)] * 2)],
        creep=mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8),
        loop_shift=mh.plant.LoopShift(0.0, 500.0, (0.01, 0.02), 0.5, 400.0),
        input_map=([-600.0, 600.0], [-500.0, 550.0]),
        output_map=([-6.0, 0.0, 6.0], [-5.0, 0.0, 7.0]),
        noise=1e-3,
        units=("counts", "mrad"),
    ),
}


@pytest.mark.parametrize("name", STAGES)
def test_every_stage_has_a_table(name: str) -> None:
    shown = page(STAGES[name]())
    assert "svg" in shown.tags and "hysteresis" in shown.text
    if name == "everything":
        for said in ("Stage, counts to mrad", "slew rate 10000 counts/s", "input map 2 points"):
            assert said in shown.text
        assert "dead time 0.1000 ms" in shown.text and "creep of 8 terms" in shown.text


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_stages_that_were_identified_have_verdict_and_findings(bench: Any) -> None:
    u, skip = bench.drive()
    found = mh.identify(u, bench.measured(u), dt=1.0 / RATE, skip=skip, operators=8)
    for shown in (page(found), page(found.stage)):
        assert f"verdict: {found.verdict}" in shown.text
        for finding in found.warnings:
            assert f"{finding.severity} {finding.code}: {finding.message[:40]}" in shown.text


def test_findings_stand_in_the_table_the_worst_first() -> None:
    u = mh.signals.sine(400.0, 1.0, seconds=4.0, rate=200.0)
    y = MODEL.forward().run(u)
    y[700] += 0.5
    found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0, loss="squares")
    assert {"no_minor_loops", "outliers"} <= {one.code for one in found.warnings}
    assert found.verdict != "green"
    shown, of_stage = page(found).text, page(found.stage).text
    for one in found.warnings:
        assert f"{one.severity} {one.code}: {one.message}. Try: {one.hint}" in shown
        assert f"{one.severity} {one.code}: {one.message}" in of_stage
    assert f"verdict: {found.verdict}" in shown and f"verdict: {found.verdict}" in of_stage
    severities = [one for one in shown.split() if one in ("red", "amber")][1:]
    assert severities == sorted(severities, reverse=True)


def test_an_identification_has_its_numbers_with_their_errors(
    found: mh.results.Identification,
) -> None:
    shown = page(found)
    ratio, std = found.ratios[0], found.ratios_std[0]
    assert f"{ratio:.4f} ± {std:.2g}"[:12] in shown.text
    assert f"{found.fit.rmse_percent:.3f} % of the range" in shown.text
    assert found.validation is not None
    assert f"rms error, validation {found.validation.rmse:.5f}"[:24] in shown.text


def test_all_other_results_have_a_table() -> None:
    stage = mh.paper.plant("A1").stage
    u = mh.signals.decaying_triangle(400.0, 2.0, cycles=3, rate=200.0)
    y = MODEL.forward().run(u) + np.random.default_rng(1).normal(0.0, 0.01, u.size)
    chirp = mh.signals.chirp(50.0, 1.0, 60.0, seconds=4.0, rate=500.0)
    moved = mh.Stage(MODEL, dynamics=mh.plant.SecondOrder(40.0, 0.3)).forward(2e-3).run(chirp)
    moved += np.random.default_rng(2).normal(0.0, 1e-3, moved.size)
    dynamics = mh.identify_dynamics(chirp, moved, dt=2e-3, model=MODEL)
    wrong = np.column_stack([y, np.full_like(y, np.nan)])
    many = mh.identify_many(u, wrong, operators=4, weights="free")
    compared = mh.compare(u, y, dt=5e-3, operators=4)
    tuned = mh.control.tune(stage, dt=1e-4)
    loop = mh.realtime.run(
        stage, stage.plant(1e-3), [0.5], rate=1000, seconds=0.05, rest_drive=0.0, rest_rate=5e3
    )
    for shown, said in (
        (dynamics, "natural frequency 40"),
        (many, "1 not fitted"),
        (compared, compared.simplest),
        (tuned, f"{tuned.at_max_slope.phase_margin:.1f}"),
        (loop, "Loop in real time"),
        (stage.simulate(np.sin(np.arange(300) / 20.0), dt=1e-4), "samples at a limit 0"),
    ):
        assert said in page(shown).text


def test_nothing_but_numpy_is_needed() -> None:
    lines = [
        "import sys",
        "sys.modules.update(dict.fromkeys(('matplotlib', 'jinja2', 'tqdm', 'click')))",
        "import mpi_hyst as mh",
        "print(len(mh.paper.plant('A1').stage._repr_html_()) > 1000)",
    ]
    ended = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=False
    )
    assert (ended.stdout, ended.stderr) == ("True\n", "")
