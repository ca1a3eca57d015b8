"""Models compared on held-out stretches: each wins where it is the truth, and nowhere else."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from commands import COLUMNS, HEADER, RATE, assert_refused, names_in, record_rows, run, write_csv
from support import Array, parameter_of
from test_report import parsed, sections, words

DT = 5e-3
R = 10.0 * np.arange(8)
WEIGHTS = np.array([0.4, 0.05, 0.04, 0.03, 0.03, 0.02, 0.02, 0.02])
PLAYS = mh.PrandtlIshlinskii(WEIGHTS, R)
COUPLED = mh.ModifiedPrandtlIshlinskii.from_ratios(WEIGHTS, R, ra=0.95, rb=0.3, rc=0.35)
NOISE = 0.02  # um of some 80
SIMPLE = ["conventional", "polynomial + plays", "modified"]
FAST: dict[str, Any] = {"operators": 8, "weights": "free", "smoothness": 0.0}


def drive(cycles: int = 10, rests: Sequence[float] = ()) -> Array:
    """Loops of many sizes about 0, that come back; before them rests."""
    sizes = 80.0 * np.abs(np.cos(0.55 * np.arange(cycles)))
    sizes[0] = 80.0
    corners = [0.0, *(end for size in sizes for end in (size, -size)), 0.0]
    ways = [np.linspace(p, q, 60, endpoint=False) for p, q in pairwise(corners)]
    return np.concatenate([*(np.full(400, rest) for rest in rests), *ways])


def noisy(y: Array, seed: int = 1) -> Array:
    return y + np.random.default_rng(seed).normal(0.0, NOISE, y.size)


def by_name(found: mh.results.Comparison) -> dict[str, mh.results.ComparedModel]:
    return {row.model: row for row in found.rows}


U = drive()


# ---- each model where it is the truth


def test_coupled_plays_buy_nothing_where_plays_are_the_truth() -> None:
    found = mh.compare(U, noisy(PLAYS.forward().run(U)), **FAST)
    assert [row.model for row in found.rows] == [*SIMPLE, "modified + duhem"]
    assert found.simplest == "conventional"
    plays, *others = (row.held_out for row in found.rows)
    assert plays == pytest.approx(NOISE, rel=0.1)
    assert min(others) > 0.99 * plays


def test_coupled_plays_win_where_loops_are_lopsided() -> None:
    found = mh.compare(U, noisy(COUPLED.forward().run(U)), **FAST)
    plays, polynomial, modified, _ = (row.held_out for row in found.rows)
    assert found.simplest == "modified"
    assert modified == pytest.approx(NOISE, rel=0.1)
    assert polynomial > 5.0 * modified and plays > polynomial


def test_the_polynomial_wins_where_it_is_the_truth() -> None:
    x = U / 80.0
    found = mh.compare(U, noisy(PLAYS.forward().run(U) + 3.0 * x**2 - 2.0 * x**3), **FAST)
    plays, polynomial, modified, _ = (row.held_out for row in found.rows)
    assert found.simplest == "polynomial + plays"
    assert polynomial == pytest.approx(NOISE, rel=0.1)
    assert plays > 10.0 * polynomial and modified > 2.0 * polynomial


def stage_of(*, dt: float = DT, **parts: Any) -> Array:
    u = drive(rests=(0.0, 60.0, -40.0, 20.0))
    return np.stack([u, noisy(mh.Stage(COUPLED, **parts).forward(dt).run(u))])


BENT = np.linspace(-200.0, 200.0, 81)

TRUTHS: dict[str, dict[str, Any]] = {
    "creep": {"creep": mh.plant.Creep.logarithmic(0.03, 0.1, 100.0, 6)},
    "loop shift": {"loop_shift": mh.plant.LoopShift(0.0, 80.0, (-4.0, 2.0), 0.1, 2.0)},
    "relaxing plays": {
        "relaxing_plays": mh.plant.RelaxingPlays([12.0, 48.0], [0.1], [[0.01, 0.01]])
    },
    "slow gain": {"slow_gain": mh.plant.SlowGain(80.0, -0.08, 0.0, 30.0)},
    "dynamics": {"dynamics": mh.plant.SecondOrder(12.0, 0.1)},
    "maps": {"output_map": (BENT, 100.0 * np.tanh(BENT / 100.0))},
    "duhem": {"duhem": mh.Duhem.from_bouc_wen(0.3, 0.03, 0.5, 0.3)},
}

# Ten times as slow as the others: records of two minutes tell a slow gain, those of 14 s do not.
SLOW = 0.05
TOO_SHORT = {"slow gain": "the records cannot tell it: too short, or loops that are all alike"}


@pytest.mark.parametrize("truth", TRUTHS)
def test_an_extension_wins_where_it_is_the_truth(truth: str) -> None:
    dt, omitted = (SLOW, {}) if truth == "slow gain" else (DT, TOO_SHORT)
    # Its time constant lies between two of those that are tried by default.
    asked: dict[str, Any] = {"relaxing_plays": [0.1]} if truth == "relaxing plays" else {}
    u, y = stage_of(dt=dt, **TRUTHS[truth])
    found = mh.compare(u, y, **{"dt": dt, **asked, **FAST})
    rows = by_name(found)
    extensions = [f"modified + {name}" for name in TRUTHS if name not in omitted]
    assert list(rows) == [*SIMPLE, *extensions, "modified + all"]
    best = rows[f"modified + {truth}"]
    assert best.kept == [truth] and found.omitted == omitted
    assert best.held_out < 1.2 * NOISE
    assert rows["modified"].held_out > 2.0 * best.held_out
    # Plays that relax are creep, too, where their threshold is 0.
    alike = {"creep": "modified + relaxing plays"}.get(truth)
    others = [rows[name] for name in extensions if name not in {best.model, alike}]
    assert all(row.held_out > 1.5 * best.held_out for row in others)
    assert truth in rows["modified + all"].kept
    assert rows["modified + all"].held_out < 1.1 * best.held_out
    # Of two that are alike to a part in 500 the other one may be taken.
    assert rows[found.simplest].held_out == pytest.approx(best.held_out, rel=2e-3)


def test_what_is_not_kept_changes_nothing() -> None:
    found = mh.compare(*stage_of(), dt=DT, **FAST)
    rows = by_name(found)
    assert found.simplest == "modified"
    for name in (f"modified + {extension}" for extension in TRUTHS if extension != "slow gain"):
        assert rows[name].kept == [] and rows[name].model == name
        assert rows[name].stretches == rows["modified"].stretches
        assert rows[name].fit.rmse == rows["modified"].fit.rmse
    assert rows["modified + all"].kept == []
    assert rows["modified + all"].held_out == pytest.approx(rows["modified"].held_out, rel=1e-2)


def test_terms_that_are_given_are_in_their_own_rows() -> None:
    given: dict[str, Any] = {"duhem": TRUTHS["duhem"]["duhem"], "slow_gain": 5.0}
    others = ("creep", "loop_shift", "relaxing_plays", "dynamics", "input_map", "output_map")
    left_out = dict.fromkeys(others)
    u, y = stage_of(**TRUTHS["duhem"])
    found = mh.compare(u, y, dt=DT, **{**left_out, **given, **FAST})
    assert {row.model: row.kept for row in found.rows} == {
        **{name: [] for name in SIMPLE},
        "modified + slow gain": ["slow gain"],
        "modified + duhem": ["duhem"],
        "modified + all": ["slow gain", "duhem"],
    }


def test_modified_models_differ_by_their_extensions_alone() -> None:
    u, y = stage_of(**TRUTHS["loop shift"])
    found = mh.compare(u, y, dt=DT, operators=8)
    fitted = mh.identify(u, y, dt=DT, operators=8)
    assert {row.weights_law for row in found.rows[2:]} == {fitted.weights_law}
    unknowns = {row.unknowns - 2 * ("loop shift" in row.kept) for row in found.rows[2:]}
    assert len(unknowns) == 1


# ---- the judge


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("model", ["conventional", "polynomial + plays"])
def test_stretches_are_predicted_from_a_fit_to_the_others(model: str) -> None:
    """What is linear is fitted anew exactly: least squares by hand, of two records with a skip."""
    inputs, skips = [U, drive(7)[::-1].copy()], [50, 35]
    outputs = [noisy(PLAYS.forward().run(u), seed) for seed, u in enumerate(inputs)]
    records = list(zip(inputs, outputs, strict=True))
    found = mh.compare(records, skip=skips, dead_time=0.0, **FAST)
    row = by_name(found)[model]
    low, high = min(u.min() for u in inputs), max(u.max() for u in inputs)
    rows, target, stretch = [], [], []
    for place, (u, y, skip) in enumerate(zip(inputs, outputs, skips, strict=True)):
        # The conventional model rests at the middle of the range.
        columns = [np.full(u.size, float(place == number)) for number in (0, 1)]
        columns += [mh.Play(r).run(u - 0.5 * (low + high)) for r in R]
        if model != "conventional":
            x = (u - 0.5 * (low + high)) / (0.5 * (high - low))
            columns += [x**2, x**3]
        rows.append(np.stack(columns, axis=1)[skip:])
        target.append(y[skip:])
        stretch.append(np.arange(u.size - skip) * 8 // (u.size - skip))
    a, b, part = np.concatenate(rows), np.concatenate(target), np.concatenate(stretch)
    expected = []
    for number in range(8):
        solution = np.linalg.lstsq(a[part != number], b[part != number], rcond=None)[0]
        assert solution[2:10].min() > 0.0  # no bound counts
        expected.append(rms((b - a @ solution)[part == number]))
    np.testing.assert_allclose(row.stretches, expected, rtol=1e-7)
    assert row.held_out == pytest.approx(rms(np.array(expected)), rel=1e-7)
    assert row.worst_stretch == max(row.stretches)
    weights = np.linalg.lstsq(a, b, rcond=None)[0]
    assert row.fit.rmse == pytest.approx(rms(b - a @ weights), rel=1e-7)
    # 8 weights, 2 output offsets, and the polynomial
    assert row.unknowns == (10 if model == "conventional" else 12)
    for place, (u, y, skip) in enumerate(zip(inputs, outputs, skips, strict=True)):
        left = row.residuals(u, y, record=place)
        assert left.shape == u.shape and abs(left[skip:].mean()) < 1e-9


def test_the_last_row_is_what_identify_fits() -> None:
    u, y = stage_of(**TRUTHS["loop shift"])
    found = mh.compare(u, y, dt=DT, operators=8)
    fitted = mh.identify(u, y, dt=DT, operators=8)
    row = found.rows[-1]
    assert row.model == "modified + all"
    assert row.fit.rmse == pytest.approx(fitted.fit.rmse, rel=1e-12)
    assert row.held_out_percent == pytest.approx(100.0 * row.held_out / fitted.fit.range)
    assert row.worst_stretch_percent == pytest.approx(100.0 * row.worst_stretch / np.ptp(y))
    np.testing.assert_allclose(row.residuals(u, y), fitted.residuals(u, y, record=0), atol=1e-12)


# ---- what is tried


def test_extensions_that_cannot_be_told_are_named_with_the_reason() -> None:
    y = noisy(COUPLED.forward().run(U))
    seconds = mh.compare(U, y, **FAST)
    assert set(seconds.omitted.values()) == {"needs a sampling interval"}
    assert list(seconds.omitted) == [name for name in TRUTHS if name != "duhem"]
    maps = ("input_map", "output_map", "duhem")
    left_out: dict[str, Any] = dict.fromkeys(
        ("creep", "loop_shift", "relaxing_plays", "slow_gain", *maps)
    )
    asked = mh.compare(U, y, dt=DT, **left_out, **FAST)
    left_out_names = [name for name in TRUTHS if name != "dynamics"]
    assert asked.omitted == dict.fromkeys(left_out_names, "not asked for")
    assert [row.model for row in asked.rows] == [*SIMPLE, "modified + dynamics"]
    same = mh.signals.triangle(80.0, 1.0, seconds=6.0, rate=1.0 / DT)
    alike = mh.compare(
        *(same, noisy(COUPLED.forward().run(same))), dt=DT, dynamics=None, skip="1s", **FAST
    )
    assert "loops that are all alike" in alike.omitted["loop shift"]
    assert "loops that are all alike" in alike.omitted["creep"]


def test_creep_under_way_is_in_all_models_alike() -> None:
    """A record that begins while the stage still creeps from elsewhere."""
    u, y = stage_of(**TRUTHS["creep"])
    others = ("loop_shift", "relaxing_plays", "dynamics", "input_map", "output_map", "duhem")
    left_out = dict.fromkeys(others)
    given = {"dt": DT, **left_out, **FAST}
    with_it = mh.compare(u[1100:], y[1100:], skip=30, **given)
    without = mh.compare(u[1100:], y[1100:], skip=30, creep=None, **given)
    assert with_it.creep_under_way and not without.creep_under_way
    assert "creep under way" in with_it.table() and "creep under way" not in without.table()
    for one, other in zip(with_it.rows, without.rows, strict=False):
        assert one.unknowns == other.unknowns + 1 and one.fit.rmse < other.fit.rmse
    assert not mh.compare(u, y, **given).creep_under_way


def test_split_weights_are_those_of_coupled_plays() -> None:
    y = noisy(COUPLED.forward().run(U))
    plays, polynomial, modified, _ = mh.compare(
        U, y, operators=8, weights="split", smoothness=0.0, ratios=(0.95, 0.3, 0.35)
    ).rows
    # weights, output offset, dead time; polynomial; weights below zero and input offset
    assert (plays.unknowns, polynomial.unknowns, modified.unknowns) == (10, 12, 18)


def test_the_table_says_what_it_is_of() -> None:
    found = mh.compare(U, noisy(COUPLED.forward().run(U)), **FAST)
    lines = found.table("um").splitlines()
    assert lines[0].split("  ")[0] == "model" and "held out (um)" in lines[0]
    assert lines[3].startswith("modified *")
    modified = found.rows[2]
    assert f"{modified.held_out:.5f}" in lines[3] and f"{modified.held_out_percent:.3f}" in lines[3]
    text = "\n".join(lines[4:])
    assert "8 stretches" in text and f"range, {modified.fit.range:.2f} um peak-to-peak" in text
    assert "not tried: creep: needs a sampling interval" in text
    assert "(um)" not in found.table()
    again = pickle.loads(pickle.dumps(found))
    assert (
        again == found and again.table() == found.table() and again != mh.compare(U, 2 * U, **FAST)
    )
    assert np.array_equal(again.rows[0].residuals(U, U), found.rows[0].residuals(U, U))
    assert "modified" in repr(found) and "held out" in repr(modified)


# ---- arguments


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "operators": ({"operators": 0}, "expected a whole number of at least one, got 0"),
    "weights": ({"weights": "ragged"}, 'got "ragged"'),
    "dt": ({"dt": -1.0}, "expected a finite number of seconds above 0"),
    "creep": ({"creep": "much", "dt": DT}, "expected None"),
    "skip": ({"skip": U.size}, "expected"),
    "smoothness": ({"smoothness": -1.0}, ">= 0"),
    "progress": ({"progress": 3}, "expected a callable or None, got 3"),
    "y": ({"y": U[:5]}, f"expected {U.size} samples, got 5"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_is_named(name: str) -> None:
    given, said = WRONG[name]
    with pytest.raises((ValueError, TypeError)) as caught:
        mh.compare(U, **{"y": PLAYS.forward().run(U), **given})
    assert parameter_of(caught.value) == name and said in str(caught.value)


def test_what_counts_in_seconds_needs_them() -> None:
    with pytest.raises(ValueError, match="dt"):
        mh.compare(U, PLAYS.forward().run(U), creep="log")


def test_residuals_are_those_of_fitted_records() -> None:
    row = mh.compare(U, noisy(PLAYS.forward().run(U)), **FAST).rows[0]
    for given, name in (({"record": 1}, "record"), ({"record": -1}, "record")):
        with pytest.raises(ValueError) as caught:
            row.residuals(U, U, **given)
        assert parameter_of(caught.value) == name
    with pytest.raises(ValueError, match=rf"^y: expected {U.size} samples, got 3$"):
        row.residuals(U, U[:3])
    with pytest.raises(ValueError, match=r"^u\[0\]: expected a finite number"):
        row.residuals(np.full(U.size, np.nan), U)


def test_progress_never_goes_back_and_an_interrupt_ends_it() -> None:
    y, told = noisy(PLAYS.forward().run(U)), list[float]()
    mh.compare(U, y, progress=lambda fraction, _best: told.append(fraction), **FAST)
    assert all(p <= q for p, q in pairwise(told)) and 0.9 < told[-1] <= 1.0

    def stop(fraction: float, _best: float) -> None:
        if fraction > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mh.compare(U, y, progress=stop, **FAST)


# ---- the command line and the report

FIT = ["--operators", "4", "--weights", "free", "--smoothness", "0"]


def test_the_command_compares_after_the_summary(there: Path) -> None:
    write_csv(there / "other.csv", HEADER, record_rows(300.0))
    result = run(
        *("identify", "record.csv", "other.csv", *COLUMNS, *FIT, "--skip", "20"),
        *("--compare", "--creep", "none", "--amplifier", "none", "--input-map", "none"),
        *("--slow-gain", "none"),
        *("-o", "found.json", "--report", "report.html"),
    )
    assert result.exit_code == 0, result.output
    summary, _, table = result.stdout.partition("models compared on held-out stretches\n\n")
    assert summary.startswith("verdict: ")
    for name in (
        *SIMPLE,
        "modified + loop shift",
        "modified + dynamics",
        "modified + maps",
        "modified + duhem",
        "modified + all",
    ):
        assert f"\n  {name}" in table
    assert "held out (µm)" in table and "not tried: creep: not asked for" in table
    assert "not tried: slow gain: not asked for" in table
    assert "stage   found.json" in table
    page = parsed(there / "report.html")
    assert sections(page)[2] == "comparison"
    section = next(one for one in page.iter("section") if one.get("id") == "comparison")
    assert len(list(section.iter("img"))) == 3  # errors, residuals of two records
    assert "polynomial + plays" in words(section) and "Not tried: creep: not asked for." in words(
        section
    )
    best = [row for row in section.iter("tr") if row.get("class") == "best"]
    assert len(best) == 1 and "modified" in words(best[0])


def test_a_report_without_the_option_has_no_comparison(there: Path) -> None:
    result = run("identify", "record.csv", *COLUMNS, *FIT, "--report", "report.html")
    assert result.exit_code == 0 and "compared" not in result.stdout
    assert "comparison" not in sections(parsed(there / "report.html"))


def test_files_without_times_are_compared_without_what_needs_them(there: Path) -> None:
    rows = [row[1:] for row in record_rows()]
    write_csv(there / "plain.csv", HEADER.partition(",")[2], rows)
    result = run("identify", "plain.csv", *COLUMNS, *FIT, "--model", "conventional", "--compare")
    assert result.exit_code == 0, result.output
    tried = [line for line in result.stdout.splitlines() if line.startswith("  modified +")]
    assert len(tried) == 1 and tried[0].startswith("  modified + duhem")
    assert "not tried: dynamics: needs a sampling interval" in result.stdout


def test_held_out_rows_are_no_part_of_the_comparison(there: Path) -> None:
    rows = record_rows()
    write_csv(there / "short.csv", HEADER, rows[:700])
    options = [*COLUMNS, *FIT, "--creep", "none", "--loop-shift", "none", "--dynamics", "none"]
    whole = run("identify", "record.csv", *options, "--compare", "--validate-from", "700")
    short = run("identify", "short.csv", *options, "--compare")
    tables = [one.stdout.partition("models compared")[2] for one in (whole, short)]
    assert tables[0] and tables[0] == tables[1]


def test_options_of_the_comparison_are_refused_by_name(there: Path) -> None:
    before = names_in(there)
    result = run("identify", "record.csv", *COLUMNS, "--compare", "--rate", "-1")
    assert_refused(result, there, before)
    result = run("identify", "record.csv", *COLUMNS, "--compare", "--smoothness", "-1")
    assert_refused(result, there, before, "--smoothness", ">= 0")


def test_ctrl_c_in_the_comparison(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_given: Any, **_named: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(mh, "compare", interrupted)
    arguments = ["identify", "record.csv", *COLUMNS, *FIT, "--compare", "-o", "found.json"]
    stopped = run(*arguments)
    assert stopped.exit_code == 130 and stopped.stdout == ""
    assert "interrupted, nothing written" in stopped.stderr
    assert not (there / "found.json").exists()
    result = run(*arguments, "--keep-partial")
    assert result.exit_code == 130 and "compared" not in result.stdout
    assert (there / "found.json").exists()


def test_strict_looks_at_the_verdict_alone(there: Path) -> None:
    drive = np.array([float(str(row[1])) for row in record_rows()])
    seconds = np.arange(drive.size) / RATE
    position = -np.array([float(str(row[2])) for row in record_rows()])
    rows = np.stack([seconds, drive, position], axis=1).tolist()
    write_csv(there / "turned.csv", HEADER, rows)
    options = ["--creep", "none", "--loop-shift", "none", "--dynamics", "none", "--strict"]
    result = run("identify", "turned.csv", *COLUMNS, *FIT, *options, "--compare")
    assert result.exit_code == 1 and "polynomial + plays" in result.stdout
