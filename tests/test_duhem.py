"""The laws of the Duhem operator, named as in duhem.rs, and the oscillator with it inside."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import duhem as reference

Tables = tuple[list[float], list[float], list[float]]
AGREE = 1e-12


@st.composite
def tables(draw: st.DrawFn) -> Tables:
    n = draw(st.integers(2, 9))
    slopes = st.lists(st.floats(0.1, 3.0) | st.just(1.0), min_size=n, max_size=n)
    widths = draw(st.lists(st.floats(0.3, 1.0), min_size=n - 1, max_size=n - 1))
    knots = [draw(st.floats(-2.0, 0.0))]
    for width in widths:
        knots.append(knots[-1] + width)
    sign = draw(st.sampled_from([1.0, 1.0, -1.0]))
    return knots, [sign * f for f in draw(slopes)], [sign * f for f in draw(slopes)]


def gain_beside(drawn: Tables, gain: float) -> float:
    """Return a slope beside which the sum rises."""
    fall = -min(*drawn[1], *drawn[2])
    return fall * (1.1 + gain) if fall > 0.0 else gain


histories = st.lists(st.floats(-1.5, 1.5) | st.sampled_from([0.0, -0.0, 1.0, 5e-324]), max_size=20)


@given(tables(), histories)
def test_equals_twin(drawn: Tables, xs: list[float]) -> None:
    duhem, twin = mh.Duhem(*drawn), reference.Duhem(*drawn)
    scale = 1.0
    for x in xs:
        expected = twin.step(x)
        scale = max(scale, abs(expected))
        # Differences grow no faster than the largest z did.
        assert duhem.step(x) == pytest.approx(expected, rel=0, abs=100 * AGREE * scale)


@given(tables(), histories, st.integers(2, 8))
def test_sampling_independence(drawn: Tables, xs: list[float], parts: int) -> None:
    whole, split = mh.Duhem(*drawn), mh.Duhem(*drawn)
    last = 0.0
    for x in xs:
        split.run([last + (x - last) * part / parts for part in range(1, parts)])
        assert whole.step(x) == split.step(x)
        last = x


@given(tables(), histories, st.integers(2, 4))
def test_rate_independence(drawn: Tables, xs: list[float], times: int) -> None:
    once, held = mh.Duhem(*drawn), mh.Duhem(*drawn)
    assert held.run(np.repeat(xs, times))[times - 1 :: times].tolist() == once.run(xs).tolist()


@given(tables(), histories)
def test_monotony(drawn: Tables, xs: list[float]) -> None:
    duhem, least = mh.Duhem(*drawn), min(*drawn[1], *drawn[2])
    x0 = z0 = 0.0
    for x in xs:
        z = duhem.step(x)
        rounding = AGREE * max(1.0, abs(z), abs(z0))
        assert (z - z0) * np.sign(x - x0) >= least * abs(x - x0) - rounding
        x0, z0 = x, z


@given(tables(), histories, st.floats(0.0, 2.0))
def test_inverse_undoes_forward(drawn: Tables, xs: list[float], gain: float) -> None:
    gain = gain_beside(drawn, gain)
    duhem, least = mh.Duhem(*drawn), gain + min(*drawn[1], *drawn[2])
    inverse, scale = duhem.inverse(gain), 10.0
    for x in xs:
        z = duhem.step(x)
        scale = max(scale, abs(z))
        assert inverse.step(gain * x + z) == pytest.approx(
            x, rel=0, abs=100 * AGREE * scale / least
        )


@given(tables(), histories, st.floats(0.0, 2.0))
def test_forward_undoes_inverse(drawn: Tables, sums: list[float], gain: float) -> None:
    gain = gain_beside(drawn, gain)
    duhem = mh.Duhem(*drawn)
    inverse, scale = duhem.inverse(gain), 10.0
    for target in sums:
        x = inverse.step(target)
        z = duhem.step(x)
        scale = max(scale, abs(gain * x), abs(z))
        assert gain * x + z == pytest.approx(target, rel=0, abs=10 * AGREE * scale)


@given(tables(), histories, histories)
def test_a_saved_state_continues_bit_for_bit(
    drawn: Tables, xs: list[float], ys: list[float]
) -> None:
    gain = gain_beside(drawn, 0.5)
    for one, other in (
        (mh.Duhem(*drawn), mh.Duhem(*drawn)),
        (mh.Duhem(*drawn).inverse(gain), mh.Duhem(*drawn).inverse(gain)),
    ):
        one.run(xs)
        other.state = one.state
        assert one.run(ys).tolist() == other.run(ys).tolist()


def test_an_operator_that_falls_is_the_h_that_the_piezo_form_subtracts() -> None:
    xs = [30.0, -50.0, 10.0, 10.5, 0.0]
    h = mh.Duhem.from_bouc_wen(0.4, 0.03, 0.8, 0.3)
    less = mh.Duhem.from_bouc_wen(-0.4, 0.03, 0.8, -0.3)
    assert less.run(xs).tolist() == (-h.run(xs)).tolist()
    assert less.rising.max() < 0.0 and eval(repr(less), {"Duhem": mh.Duhem}).knots.size == 3
    with pytest.raises(ValueError, match="gain: expected a number above minus the smallest f"):
        less.inverse(0.4)
    again = mh.Duhem(less.knots, less.rising, less.falling)
    less.reset()
    assert again.run(xs).tolist() == less.run(xs).tolist()


def test_a_state_of_another_operator_is_refused() -> None:
    one, other = (
        mh.Duhem.from_bouc_wen(1.0, 1.0, 0.5, 0.1),
        mh.Duhem.from_bouc_wen(1.0, 1.0, 0.5, 0.2),
    )
    for stream, same, different in (
        (one, mh.Duhem.from_bouc_wen(1.0, 1.0, 0.5, 0.1), other),
        (one.inverse(0.5), one.inverse(0.5), other.inverse(0.5)),
        (
            oscillator(1.0).forward(1e-3),
            oscillator(1.0).forward(1e-3),
            oscillator(2.0).forward(1e-3),
        ),
    ):
        stream.run([0.3, -0.2])
        same.state = stream.state
        with pytest.raises(ValueError, match="the state was saved with another model"):
            different.state = stream.state


def oscillator(stiffness: float) -> mh.plant.HystereticOscillator:
    hysteresis = mh.Duhem.from_bouc_wen(1.0, 1.0, 0.5, 0.1)
    return mh.plant.HystereticOscillator(0.5, 5.0, stiffness, hysteresis)


def benchmark() -> mh.plant.HystereticOscillator:
    hysteresis = mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    return mh.plant.HystereticOscillator(0.5, 5.0, 2.5e4, hysteresis)


def drive(n: int, dt: float) -> npt.NDArray[np.float64]:
    t = dt * np.arange(n)
    u: npt.NDArray[np.float64] = 20.0 * sum(np.sin(2 * np.pi * f * t) for f in (7.0, 31.0, 83.0))
    return u


def test_oscillator_equals_its_equations() -> None:
    u = drive(200, 1e-3)

    def slope(z: float, rising: bool) -> float:
        return 2.5e4 - 1e3 * ((0.8 if rising else -0.8) * z - 1.1 * abs(z))

    expected = reference.oscillator((0.5, 5.0, 2.5e4), slope, u.tolist(), 1e-3, 200)
    fine = benchmark().response(u, dt=1e-3, sub_steps=30)
    assert np.std(fine - expected) < 1e-5 * np.std(expected)
    y = benchmark().response(u, dt=1e-3)
    assert np.std(y - expected) < 1e-4 * np.std(expected)
    assert benchmark().forward(1e-3).run(u).tolist() == y.tolist()


def test_oscillator_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "oscillator.json"
    benchmark().save(path)
    assert mh.plant.HystereticOscillator.load(path) == benchmark()
    path.write_text(path.read_text("utf-8").replace("oscillator/1", "oscillator/9"), "utf-8")
    with pytest.raises(ValueError, match="schema: expected"):
        mh.plant.HystereticOscillator.load(path)


def test_identification_of_a_noisy_periodic_record() -> None:
    dt, n, noise = 1e-3, 2000, 2e-6
    rng = np.random.default_rng(3)
    lines = np.arange(10, 300)
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    u = np.fft.irfft(spectrum)
    u *= 50.0 / u.std()
    y = benchmark().response(u, dt=dt, hold="zero", settle=1, sub_steps=20)
    record = np.tile(y, 4) + noise * rng.standard_normal(4 * n)
    found = mh.identify_oscillator(np.tile(u, 4), record, dt=dt)
    assert (found.periods, found.hold) == (4, "zero")
    assert found.noise == pytest.approx(noise, rel=0.1)
    assert (found.verdict, found.warnings) == ("green", [])
    # Another drive, without noise: what the linear oscillator misses is a quarter of the motion.
    other = drive(n, dt)
    expected = benchmark().response(other, dt=dt)
    got = found.model.response(other, dt=dt)
    assert np.std(got - expected) < 1e-6 < 3e-5 < found.linear_rms
    assert [row["knots"] for row in found.tried][:2] == [0, 3]
    assert "<- chosen" in found.summary()
    assert found.standard_errors.shape == (4 + 2 * len(found.model.hysteresis.knots),)
    # The truth lies within a few standard errors.
    assert abs(found.model.gain - 0.5) < 5 * found.standard_errors[0]


def test_a_record_from_rest() -> None:
    u = drive(1500, 1e-3)
    y = benchmark().response(u, dt=1e-3) + 1e-3
    found = mh.identify_oscillator(u, y, dt=1e-3, knots=3)
    assert (found.periods, found.noise) == (1, None)
    assert found.output_offset == pytest.approx(1e-3, rel=1e-3)
    assert found.rms < 1e-3 * found.linear_rms
    assert found.covered == ("z goes beyond" not in found.summary())


def test_a_linear_oscillator_has_no_hysteresis_inside() -> None:
    u = drive(1500, 1e-3)
    flat = mh.Duhem([-1.0, 1.0], [1e-6, 1e-6], [1e-6, 1e-6])
    y = mh.plant.HystereticOscillator(0.5, 5.0, 5e4, flat).response(u, dt=1e-3)
    noise = 1e-3 * y.std() * np.random.default_rng(4).standard_normal(y.size)
    found = mh.identify_oscillator(u, y + noise, dt=1e-3)
    assert [finding.code for finding in found.warnings] == ["hysteresis_inside_not_told"]
    assert found.verdict == "amber"
    assert "hysteresis_inside_not_told (amber)" in found.summary()


def test_hysteresis_of_another_kind_is_told() -> None:
    # In front of the dynamics, and with a memory of turning points.
    u = drive(1500, 1e-3)
    stage = mh.PrandtlIshlinskii([0.3, *[0.2] * 8], np.linspace(0.0, 100.0, 9)).forward()
    flat = mh.Duhem([-1.0, 1.0], [1e-6, 1e-6], [1e-6, 1e-6])
    y = mh.plant.HystereticOscillator(0.5, 20.0, 5e4, flat).response(stage.run(u), dt=1e-3)
    found = mh.identify_oscillator(u, y, dt=1e-3)
    assert "poor_fit" in [finding.code for finding in found.warnings]


def test_a_mass_without_a_spring_is_refused() -> None:
    u = np.sin(2 * np.pi * 5e-3 * np.arange(2000))
    y = np.cumsum(np.cumsum(u)) * 1e-6
    with pytest.raises(ValueError, match="y: expected a position that a spring brings back"):
        mh.identify_oscillator(u, y, dt=1e-3)


@pytest.mark.parametrize(
    ("keywords", "parameter"),
    [
        ({"knots": 4}, "knots"),
        ({"periods": 7}, "periods"),
        ({"periods": 4}, "periods"),
        ({"periods": 0}, "periods"),
        ({"hold": "linear"}, "hold"),
        ({"dt": 0.0}, "dt"),
        ({"skip": 1000}, "skip"),
        ({"y": np.zeros(1000)}, "y"),
        ({"y": np.zeros(10)}, "y"),
    ],
)
def test_wrong_records_are_refused(keywords: dict[str, Any], parameter: str) -> None:
    u = drive(1000, 1e-3)
    with pytest.raises((ValueError, TypeError)) as raised:
        mh.identify_oscillator(**{"u": u, "y": u, "dt": 1e-3, **keywords})
    assert getattr(raised.value, "parameter", None) == parameter


def test_wrong_arguments_are_refused() -> None:
    oscillator = benchmark()
    for call, parameter in (
        (lambda: mh.Duhem([0.0, 1.0], [1.0, 0.0], [1.0, 1.0]), "rising"),
        (lambda: mh.Duhem.from_bouc_wen(1.0, 1.0, -1.0, 0.0), "gamma"),
        (lambda: oscillator.hysteresis.inverse(-1e9), "gain"),
        (lambda: oscillator.forward(1e-3, 0), "sub_steps"),
        (lambda: oscillator.response(drive(9, 1e-3), dt=1e-3, settle=1001), "settle"),
        (lambda: oscillator.inverse([0.0], dt=1e-3, velocity=[0.0]), "acceleration"),
        (lambda: mh.plant.HystereticOscillator(0.0, 1.0, 1.0, oscillator.hysteresis), "gain"),
    ):
        with pytest.raises(ValueError) as raised:
            call()
        assert raised.value.parameter == parameter  # type: ignore[attr-defined]
