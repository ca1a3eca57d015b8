"""The result says which terms were tried, and why they are in the model or not."""

from __future__ import annotations

import pickle
import re
from itertools import pairwise
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


def creeping() -> Array:
    """Plays behind creep, and loops whose centre moves with what the drive did before."""
    stage = mh.Stage(
        mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 1.5]), creep=mh.plant.Creep([0.05, 0.05], [0.3, 3.0])
    )
    y = np.asarray(stage.forward(DT).run(VARIOUS))
    speed, followed = np.abs(np.diff(VARIOUS, prepend=VARIOUS[0])) / DT, np.empty(y.size)
    mean = 0.0
    for k, now in enumerate(speed.tolist()):
        followed[k] = mean
        mean += (now - mean) * DT / 0.1
    return y + 0.002 * followed * VARIOUS / 20.0


def test_what_cross_validation_chose_is_better_by_what_was_asked() -> None:
    found = mh.identify(VARIOUS, noisy(creeping()), dt=DT, amplifier=None, dynamics=None)
    trials = {one["term"]: one for one in found.terms_tried}
    errors = {(creep, shift.split("(")[0]): error for creep, shift, error in found.terms_validation}
    creeps = {1: "slow creep", 2: "slow and fast creep"}
    # Creep beside the loop shift that is chosen, and the other way round.
    shift = (
        "none" if found.loop_shift is None else ["square", "both"][len(found.loop_shift_std) - 1]
    )
    creep = 0 if found.creep is None else len(found.creep_amplitudes)
    assert creep > 0, found.terms_tried
    for amplitudes, name in creeps.items():
        one = trials[name]
        assert one["gain"] == errors[0, shift] / errors[amplitudes, shift]
        assert (one["outcome"] == "better") == (amplitudes == creep)
    taken = trials[creeps[creep]]
    assert taken["gain"] >= taken["needed"] > 1.0
    assert len(taken["beside"]) == (shift != "none")
    for one in found.terms_tried:
        if one["term"].startswith("loop shift"):
            assert one["beside"] == [creeps[creep]]
            assert (one["outcome"] == "better") == (
                (shift == "square" and "one" in one["term"])
                or (shift == "both" and "two" in one["term"])
            )


def test_a_given_loop_shift_is_no_trial() -> None:
    found = mh.identify(VARIOUS, noisy(creeping()), dt=DT, dynamics=None, loop_shift=0.1)
    names = [one["term"] for one in found.terms_tried]
    assert "slow creep" in names and not any("loop shift" in name for name in names)


def test_weights_and_operators_say_what_they_gained() -> None:
    ragged = mh.ModifiedPrandtlIshlinskii.from_ratios(
        [1.0, 0.05, 0.9, 0.02, 0.8], [0.0, 1.0, 2.0, 3.0, 4.0], ra=1.0, rb=1.0, rc=1.0
    )
    position = noisy(ragged.forward().run(VARIOUS))
    found = mh.identify(VARIOUS, position, dt=DT, thresholds=[0.0, 1.0, 2.0, 3.0, 4.0])
    assert found.weights_law == "free"
    (free,) = (one for one in found.terms_tried if one["term"] == "free weights")
    (_, simplest), (_, error) = found.weights_validation[:2]
    assert free["outcome"] == "better"
    assert free["gain"] == simplest / error > free["needed"] > 1.0
    (smooth,) = (one for one in found.terms_tried if one["term"] == "smooth weights")
    assert (smooth["outcome"] == "better") == (found.smoothness > 0.0)
    found = mh.identify(VARIOUS, position, dt=DT)
    number = found.model.weights.size
    tried = [one for one in found.terms_tried if one["term"].endswith(" operators")]
    assert [one["term"] for one in tried] == [
        f"{count} operators" for count, _ in found.cross_validation[1:]
    ]
    for one, (before, after) in zip(tried, pairwise(found.cross_validation), strict=True):
        assert one["gain"] == before[1] / after[1]
        assert (one["outcome"] == "better") == (after[0] == number)
        assert one["beside"] == [f"{found.weights_law} weights"]


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
