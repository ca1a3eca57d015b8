"""The result says which terms were tried, and why they are in the model or not."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
from law_stages import DT as LAW_DT
from law_stages import way
from mpi_hyst._report.summary import OUTCOMES
from support import Array

ROOT = Path(__file__).parents[1]
DT = 1e-3


def loops(*heights: float) -> Array:
    """Strokes of these heights, there and back, a tenth in a sample."""
    return way([*(end for height in heights for end in (0.0, height)), 0.0], 0.1 / LAW_DT)


def bent(u: Array) -> Array:
    """A play beside the drive, and a curve of both."""
    z, out = 0.0, np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        z = min(max(z, now - 1.5), now + 1.5)
        h = now + 0.5 * z
        out[k] = h + 0.01 * h * h
    return out


def noisy(y: Array) -> Array:
    return y + 2e-4 * np.ptp(y) * np.random.default_rng(1).standard_normal(y.size)


VARIOUS = loops(20, 10, 15, 5, 20, 8, 12, 3, 18)


def outcomes(found: mh.results.Identification, term: str) -> list[str]:
    return [one["outcome"] for one in found.terms_tried if one["term"] == term]


def test_a_term_that_is_there_gained_more_than_was_asked() -> None:
    found = mh.identify(VARIOUS, noisy(bent(VARIOUS)), dt=DT)
    there = {"input map": found.input_map, "output map": found.output_map}
    taken = [name for name, one in there.items() if one is not None]
    assert taken
    for name in taken:
        best = [
            one
            for one in found.terms_tried
            if one["term"] in (name, "both maps") and one["outcome"] == "better"
        ]
        assert best, found.terms_tried
        for one in best:
            assert one["judged_by"] == "held_out_error"
            assert one["gain"] >= one["needed"] > 1.0
    # The next trial was made beside it.
    assert any(set(one["beside"]) & set(taken) for one in found.terms_tried)


def test_a_term_that_is_not_there_says_why() -> None:
    model = mh.ModifiedPrandtlIshlinskii.from_ratios([1.0, 0.5], [0.0, 1.5], ra=1.0, rb=1.0, rc=1.0)
    play = model.forward().run(VARIOUS)
    found = mh.identify(VARIOUS, noisy(play), dt=DT)
    assert found.input_map is None and found.output_map is None
    for name in ("input map", "output map"):
        tried = outcomes(found, name)
        assert tried and "better" not in tried, found.terms_tried
    for one in found.terms_tried:
        if one["outcome"] in ("not_promising", "not_fitted", "nothing_left"):
            assert one["gain"] is None
        elif one["outcome"] == "not_better" and one["judged_by"] == "evidence":
            assert one["gain"] < one["needed"]


def test_what_records_cannot_tell_is_named_first() -> None:
    alike = loops(20, 20, 20)
    found = mh.identify(alike, noisy(bent(alike)), dt=DT)
    untold = [one["term"] for one in found.terms_tried if one["outcome"] == "cannot_be_told"]
    assert untold == ["loop shift", "slow gain", "relaxing plays"]
    assert [one["term"] for one in found.terms_tried[:3]] == untold
    # What was given is not open, so it is not in the list.
    given = mh.identify(alike, noisy(bent(alike)), dt=DT, slow_gain=None, input_map=None)
    assert not outcomes(given, "slow gain") and not outcomes(given, "input map")


def test_the_answers_of_cross_validation_are_trials() -> None:
    found = mh.identify(VARIOUS, noisy(bent(VARIOUS)), dt=DT)
    (_, simplest), *laws = found.weights_validation
    trials = {one["term"]: one for one in found.terms_tried if one["judged_by"] == "held_out_error"}
    assert laws
    for law, error in laws:
        assert trials[f"{law} weights"]["gain"] == simplest / error
    for count, error in found.cross_validation[1:]:
        assert trials[f"{count} operators"]["gain"] == found.cross_validation[0][1] / error
    assert trials["smooth weights"]["gain"] > 0.0 or found.smoothness == 0.0
    # A loop shift is compared with the same creep, all else with none.
    errors = {(creep, shift.split("(")[0]): error for creep, shift, error in found.terms_validation}
    none = next(shift for creep, shift in errors if creep == 0)
    names = {1: "slow creep", 2: "slow and fast creep"}
    for creep, name in names.items():
        alone = next(one for one in found.terms_tried if one["term"] == name)
        assert alone["gain"] == errors[0, none] / errors[creep, none] and alone["beside"] == []
        shifted = [one for one in found.terms_tried if one["beside"] == [name]]
        assert [one["term"] for one in shifted] == [
            "loop shift of one amplitude",
            "loop shift of two amplitudes",
        ]
    # Where the simplest answer is taken no other one is better; else one is, and by what was asked.
    for question in (list(names.values()), [f"{law} weights" for law, _ in laws]):
        taken = [one for one in map(trials.get, question) if one and one["outcome"] == "better"]
        assert len(taken) <= 1 and all(one["gain"] >= one["needed"] for one in taken)


def test_free_weights_that_are_taken_say_what_they_gained() -> None:
    ragged = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [1.0, 0.05, 0.9, 0.02, 0.8], [0.0, 1.0, 2.0, 3.0, 4.0], ra=1.0, rb=1.0, rc=1.0
    )
    position = noisy(ragged.forward().run(VARIOUS))
    found = mh.identify(VARIOUS, position, dt=DT, thresholds=[0.0, 1.0, 2.0, 3.0, 4.0])
    assert found.weights_law == "free"
    (free,) = (one for one in found.terms_tried if one["term"] == "free weights")
    assert free["outcome"] == "better" and free["gain"] >= free["needed"] > 1.0


def test_a_result_keeps_its_trials() -> None:
    found = mh.identify(VARIOUS, noisy(bent(VARIOUS)), dt=DT)
    assert found.terms_tried
    assert pickle.loads(pickle.dumps(found)).terms_tried == found.terms_tried


def test_without_an_interval_it_is_not_the_records_that_are_wanting() -> None:
    found = mh.identify(VARIOUS, noisy(bent(VARIOUS)))
    closed = {one["term"]: one["outcome"] for one in found.terms_tried if one["needed"] is None}
    assert closed["input map"] == closed["creep"] == "not_open"


def test_every_outcome_has_words() -> None:
    source = (ROOT / "crates/hysteresis-identify/src/choose/trial.rs").read_text("utf-8")
    variants = re.findall(
        r"^    ([A-Z]\w+),$", source.split("enum TrialOutcome")[1].split("}")[0], re.M
    )
    words = {re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower() for name in variants}
    assert words == set(OUTCOMES) and len(words) > 10
    page = (ROOT / "docs/explanation/identification.md").read_text("utf-8")
    assert all(f"| `{word}` |" in page for word in words)


def reduced(found: mh.results.Identification) -> tuple[Any, Any]:
    made: Any = found.__reduce__()
    return made[0], made[1]


def test_a_result_of_a_release_that_kept_no_trials_is_read() -> None:
    found = mh.identify(VARIOUS, noisy(bent(VARIOUS)), dt=DT)
    make, (state, *rest) = reduced(found)
    kept = dict(state["found"])
    assert kept.pop("terms_tried")
    old = {**state, "found": kept}
    assert make(old, *rest).terms_tried == []
