"""Identification: known models come back, options are kept, progress, measured loops."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array

PAPER_RATIOS = (0.95, 0.30, 0.35)
THRESHOLDS = 25.0 * np.arange(20)


def actuator(input_offset: float = 0.0, output_offset: float = 0.0) -> mh.ModifiedPrandtlIshlinskii:
    weights = mh.paper.table_1_recovered().weights
    ra, rb, rc = PAPER_RATIOS
    return mh.ModifiedPrandtlIshlinskii.from_ratios(
        weights,
        THRESHOLDS,
        ra=ra,
        rb=rb,
        rc=rc,
        input_offset=input_offset,
        output_offset=output_offset,
    )


def delayed(y: Array, samples: float) -> Array:
    """The output held before the first sample, straight between samples."""
    k = np.arange(y.size)
    held: Array = np.interp(k - samples, k, y)
    return held


def sweep(samples: int = 4000, amplitude: float = 500.0, cycles: int = 12) -> Array:
    return mh.signals.decaying_triangle(amplitude, 1.0, cycles=cycles, rate=samples / cycles)


def error(found: mh.results.Identification, u: Array, y: Array) -> float:
    return float(np.abs(found.predict(u) - y).max())


# ---- known models come back


@pytest.fixture(scope="module")
def noise_free() -> tuple[Array, Array, mh.results.Identification]:
    u = sweep(6000, cycles=20)
    y = delayed(actuator(12.5, -3.0).forward().run(u), 2.35)
    return u, y, mh.identify(u, y, thresholds=THRESHOLDS)


def test_the_papers_actuator_comes_back(
    noise_free: tuple[Array, Array, mh.results.Identification],
) -> None:
    _, y, found = noise_free
    model, true = found.model, actuator(12.5, -3.0)
    assert isinstance(model, mh.ModifiedPrandtlIshlinskii)
    # where a search ends: squared errors near 1e-20 of the range
    assert found.ratios == pytest.approx(PAPER_RATIOS, abs=1e-6)
    assert found.dead_time_samples == pytest.approx(2.35, abs=1e-6)
    assert model.input_offset == pytest.approx(12.5, abs=1e-6)
    assert model.output_offset == pytest.approx(-3.0, abs=1e-6)
    np.testing.assert_allclose(model.weights, true.weights, rtol=1e-4)
    assert np.array_equal(model.r, THRESHOLDS)
    np.testing.assert_allclose(model.ra, found.ratios[0] * THRESHOLDS, rtol=1e-15)
    assert found.fit.rmse < 1e-9 * np.ptp(y)
    assert model.invertible


def test_predict_includes_the_delay(
    noise_free: tuple[Array, Array, mh.results.Identification],
) -> None:
    u, y, found = noise_free
    assert error(found, u, y) < 1e-8
    undelayed = found.model.forward().run(u)
    assert np.abs(undelayed - y).max() > 1e-2
    np.testing.assert_allclose(
        found.predict(u), delayed(undelayed, found.dead_time_samples or 0.0), atol=1e-12
    )
    other = sweep(1000, 300.0, 7)
    expected = delayed(actuator(12.5, -3.0).forward().run(other), 2.35)
    assert error(found, other, expected) < 1e-6
    assert found.predict([]).shape == (0,)
    with pytest.raises(ValueError, match=r"^u\[1\]: expected a finite number"):
        found.predict([1.0, np.nan])


def test_quality_is_of_the_fitted_samples_with_its_base(
    noise_free: tuple[Array, Array, mh.results.Identification],
) -> None:
    u, y, _ = noise_free
    found = mh.identify(u, y, skip=700, ratios=(1, 1, 1), input_offset=0.0, dead_time=0.0)
    residual, fitted = (found.predict(u) - y)[700:], y[700:]
    fit = found.fit
    assert fit.samples == fitted.size
    assert fit.max_error == pytest.approx(np.abs(residual).max(), rel=1e-9)
    assert fit.mse == pytest.approx(np.mean(residual**2), rel=1e-9)
    assert fit.rmse == pytest.approx(fit.mse**0.5, rel=1e-12)
    assert fit.range == pytest.approx(np.ptp(fitted), rel=1e-15)
    assert fit.max_error_percent == pytest.approx(100 * fit.max_error / fit.range, rel=1e-12)
    assert fit.rmse_percent == pytest.approx(100 * fit.rmse / fit.range, rel=1e-12)
    assert [record.rmse for record in found.records] == pytest.approx([fit.rmse], rel=1e-12)
    assert f"{fit.samples} samples" in repr(fit) and repr(fit) in repr(found)


def test_15_nm_of_noise_are_all_that_is_left() -> None:
    u = sweep(6000, cycles=20)
    clean = actuator(12.5, -3.0).forward().run(u)
    y = clean + np.random.default_rng(5).normal(0.0, 0.015, u.size)
    found = mh.identify(u, y, thresholds=THRESHOLDS)
    # rms of 6000 samples is known to 1 % (3e-4 of it taken up by 25 unknowns)
    assert 0.0145 < found.fit.rmse < 0.0155
    # an estimate of 25 unknowns: 15 nm x sqrt(25 / 6000) = 1 nm rms
    assert np.sqrt(np.mean((found.predict(u) - clean) ** 2)) < 0.002
    assert found.ratios == pytest.approx(PAPER_RATIOS, abs=0.05)
    assert found.dead_time_samples == pytest.approx(0.0, abs=0.3)
    again = mh.identify(u, y, thresholds=THRESHOLDS)
    assert again.model == found.model and again.dead_time_samples == found.dead_time_samples


def test_several_records_each_have_their_output_offset() -> None:
    model = actuator(-20.0, 1.5)
    inputs = [sweep(3000, cycles=9), 50.0 + sweep(2000, 300.0, 8)]
    outputs = [
        model.forward().run(u) + shift for u, shift in zip(inputs, (0.0, 100.0), strict=True)
    ]
    records = list(zip(inputs, outputs, strict=True))
    found = mh.identify(records, thresholds=THRESHOLDS, skip=[100, 0])
    np.testing.assert_allclose(found.output_offsets, [1.5, 101.5], rtol=0, atol=1e-6)
    assert found.model.output_offset == found.output_offsets[0]
    assert found.model.input_offset == pytest.approx(-20.0, abs=1e-6)
    assert [record.samples for record in found.records] == [2900, 2000]
    assert found.fit.samples == 4900
    assert not found.output_offsets.flags.writeable


def test_skipped_samples_set_the_memory_and_nothing_else() -> None:
    # A stroke to 500 V that the fitted part, from 0 to 400 V, never repeats.
    first = 500.0 * np.abs(np.sin(np.arange(200) / 63.0))
    u = np.concatenate([first, 200.0 + sweep(2500, 200.0)])
    y = actuator().forward().run(u)
    known: dict[str, Any] = {"ratios": PAPER_RATIOS, "input_offset": 0.0, "dead_time": 0.0}
    # The weights of the paper follow a quadratic to their printed digits only.
    known |= {"thresholds": THRESHOLDS, "weights": "free"}

    def found(garbage: float) -> mh.results.Identification:
        measured = np.concatenate([np.full(200, garbage), y[200:]])
        return mh.identify(u, measured, skip=200, **known)

    one, other = found(1e6), found(-7.0)
    assert one.model == other.model and one.fit.rmse == other.fit.rmse < 1e-9
    cut = mh.identify(u[200:], y[200:], **known)
    assert cut.fit.rmse > 1e-4  # another memory


# ---- options


@pytest.mark.parametrize("model", ["modified", "conventional"])
def test_fixed_parameters_are_kept_bit_for_bit(model: Any) -> None:
    u = sweep(1500)
    y = actuator().forward().run(u)
    ratios = (0.9, 0.37, 0.41) if model == "modified" else (1.0, 1.0, 1.0)
    found = mh.identify(u, y, model=model, ratios=ratios, input_offset=3.0, dead_time=0.7)
    assert (found.ratios, found.model.input_offset, found.dead_time_samples) == (ratios, 3.0, 0.7)
    # uniform thresholds r_i = i X / n: X the largest |u - offset|, or half the peak-to-peak
    reach = np.abs(u - 3.0).max() if model == "modified" else np.ptp(u) / 2
    fitted = found.model
    r = fitted.r if isinstance(fitted, mh.ModifiedPrandtlIshlinskii) else fitted.thresholds
    np.testing.assert_allclose(r, np.arange(20) * reach / 20, rtol=1e-14)


def test_operators_says_how_many_and_thresholds_say_where() -> None:
    u = sweep(1500)
    y = actuator().forward().run(u)
    fixed: dict[str, Any] = {"ratios": (1, 1, 1), "input_offset": 0.0, "dead_time": 0.0}
    assert mh.identify(u, y, operators=7, **fixed).model.operators == 7
    found = mh.identify(u, y, thresholds=[0, 10, 300], **fixed).model
    assert isinstance(found, mh.ModifiedPrandtlIshlinskii) and found.r.tolist() == [0, 10, 300]
    with pytest.raises(ValueError, match="operators: expected 3, one for each of the thresholds"):
        mh.identify(u, y, operators=7, thresholds=[0, 10, 300], **fixed)


def test_what_may_be_fitted_is_fitted_by_default() -> None:
    u = sweep(600, cycles=6)
    y = delayed(actuator(5.0).forward().run(u), 1.2)
    one = mh.identify(u, y, operators=5)
    other = mh.identify(
        u, y, operators=5, ratios="auto", input_offset="fit", dead_time="fit", skip=0
    )
    assert one.model == other.model and one.evaluations == other.evaluations


def test_arguments_are_converted_as_everywhere() -> None:
    u = np.round(sweep(800))
    y = np.round(1000 * actuator().forward().run(u)).astype("i4")
    fixed: dict[str, Any] = {
        "ratios": PAPER_RATIOS,
        "input_offset": 0,
        "dead_time": 0,
        "operators": 5,
    }
    expected = mh.identify(u, y.astype(float), **fixed).model
    for a, b in ((u.astype(int), y), (list(u), y.tolist()), (np.repeat(u, 2)[::2], y)):
        assert mh.identify(a, b, **fixed).model == expected
        assert mh.identify([(a, b)], **fixed).model == expected


def test_no_weight_is_negative_and_the_modified_model_fits_better() -> None:
    u = sweep(2000)
    y = actuator().forward().run(u)
    modified, conventional = mh.identify(u, y), mh.identify(u, y, model="conventional")
    assert isinstance(conventional.model, mh.PrandtlIshlinskii)
    assert conventional.ratios == (1.0, 1.0, 1.0)
    for found in (modified, conventional):
        assert found.model.weights.min() >= 0.0
    # the best conventional fit errs 1.2 to 2.1 % of the range (erratum 16)
    assert 0.5 < conventional.fit.max_error_percent < 2.5
    assert modified.fit.max_error_percent < 0.1 * conventional.fit.max_error_percent


def test_a_conventional_model_comes_back() -> None:
    u = sweep(2000, 5.0)
    middle = (u.max() + u.min()) / 2  # where the fit puts the rest of the conventional model
    true = mh.PrandtlIshlinskii([1, 0.4, 0, 0.3], [0, 1, 2, 3], input_offset=middle)
    y = delayed(true.forward().run(u), 1.25)
    found = mh.identify(u, y, model="conventional", thresholds=true.thresholds)
    assert found.dead_time_samples == pytest.approx(1.25, abs=1e-6)
    assert found.model.input_offset == pytest.approx(middle, abs=1e-12)
    np.testing.assert_allclose(found.model.weights, true.weights, rtol=0, atol=1e-6)


# ---- progress


def short() -> tuple[Array, Array]:
    u = sweep(400, cycles=6)
    return u, actuator().forward().run(u)


def test_progress_grows_to_one() -> None:
    seen: list[tuple[float, float]] = []
    found = mh.identify(*short(), progress=lambda *now: seen.append(now))
    fractions = [fraction for fraction, _ in seen]
    # The number of operators is judged last, and stays: then one more call says that all is done.
    assert len(seen) - 1 == found.evaluations > 10
    assert fractions == sorted(fractions) and fractions[0] >= 0.0 and fractions[-1] == 1.0
    # the same residual from another factorisation: 1e-9 of the range
    assert seen[-1][1] == pytest.approx(found.fit.rmse, abs=1e-9 * found.fit.range)


class StoppedError(Exception):
    """Raised by the test's own progress function."""


@pytest.mark.parametrize("kind", [StoppedError, KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("calls", [1, 20])
def test_what_progress_raises_stops_the_search(kind: type[BaseException], calls: int) -> None:
    seen: list[float] = []
    thrown = kind("enough")

    def progress(fraction: float, _: float) -> None:
        seen.append(fraction)
        if len(seen) == calls:
            raise thrown

    with pytest.raises(kind) as caught:
        mh.identify(*short(), progress=progress)
    assert caught.value is thrown and len(seen) == calls


def test_progress_does_not_change_what_is_found() -> None:
    plain, watched = mh.identify(*short()), mh.identify(*short(), progress=lambda *_: None)
    assert plain.model == watched.model and plain.dead_time_samples == watched.dead_time_samples


# ---- the measured piezo stack


def measured() -> list[tuple[Array, Array]]:
    major, decaying = (
        mh.datasets.piezo_stack("major_loops"),
        mh.datasets.piezo_stack("decaying_loops"),
    )
    return [(major.u[:8000], major.y[:8000]), (decaying.u[:3850], decaying.y[:3850])]


@pytest.mark.parametrize(
    ("model", "low", "high", "percent"),
    [("modified", 0.0, 0.17, "0.34"), ("conventional", 0.29, 0.32, "0.67")],
)
def test_the_measured_stack(model: Any, low: float, high: float, percent: str) -> None:
    # Split weights have their sticky zero elsewhere.
    found = mh.identify(measured(), model=model, weights="free", operators=16, skip=[1000, 400])
    assert low < found.fit.rmse <= high
    # the figures of the README
    assert f"{found.fit.rmse_percent:.2f}" == percent
    assert found.fit.samples == 7000 + 3450
    assert found.dead_time_samples == pytest.approx(3.0, abs=1.0)  # "about 3 samples (15 ms)"
    if model == "modified":
        assert found.model.input_offset == pytest.approx(2.5, abs=0.5)  # "near 2.5 V"


def test_a_loop_shift_explains_the_measured_stack() -> None:
    records, skip = measured(), [1000, 400]
    found = mh.identify(records, dt=0.005, operators=16, skip=skip)
    assert found.loop_shift is not None and found.creep is None and found.dynamics is None
    assert found.fit.rmse < 0.085  # um; without a loop shift 0.122
    loops = [one for one in found.leave_one_loop_out(records, skip=skip) if one.record == 1]
    # 0.095 is asked for; without a loop shift 0.113
    assert np.sqrt(np.mean([one.left_out.mse for one in loops])) < 0.095
    # the true dead time of this stack, 2.3 to 3 samples
    assert found.dead_time_samples == pytest.approx(2.6, abs=0.35)


@pytest.mark.parametrize(
    ("keywords", "mean_of_both"),
    [
        ({}, 0.20),  # the target that is stated
        ({"dt": 0.005}, 0.1695),
        ({"smoothness": "auto"}, 0.20),
        ({"weights": "free"}, 0.22),
        ({"weights": "free", "smoothness": 0.01}, 0.20),
        ({"weights": "quadratic"}, 0.20),
        ({"weights": "split"}, 0.18),
    ],
)
def test_the_measured_stack_predicts_the_other_record(
    keywords: dict[str, Any], mean_of_both: float
) -> None:
    # plays leave 0.30 and 0.34; the figures are those of docs/explanation/identification.md
    assert error_on_the_other_record(keywords) < mean_of_both


def test_the_chosen_number_of_operators_predicts_the_other_record() -> None:
    # Every fourth row: the choice makes many fits.
    assert error_on_the_other_record({"operators": "auto"}, every=4) < 0.20


def error_on_the_other_record(keywords: dict[str, Any], every: int = 1) -> float:
    """The error (um rms) on each of the two records by the fit of the other, their mean."""
    major, decaying = (
        (u[::every], y[::every], skip // every)
        for (u, y), skip in zip(measured(), (1000, 400), strict=True)
    )
    rms = []
    for fitted, other in ((major, decaying), (decaying, major)):
        found = mh.identify(*fitted[:2], skip=fitted[2], validate=other, **keywords)
        assert found.validation is not None
        rms.append(found.validation.rmse)
    return float(np.mean(rms))
