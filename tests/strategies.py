"""Hypothesis strategies for thresholds, weights, models and input histories.

Models are plain keyword dicts, so that the twin and the package under test can both be
built from one draw: ``Model(**draw)``. Magnitudes are chosen so that a round trip through
an inverse is well conditioned (w_0 >= 0.1, sum of weights <= about 100, |x| <= about 2000).
"""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

MAX_THRESHOLD = 500.0
SMALLEST = 5e-324  # the least positive denormal

Numbers = list[float]
ModelDict = dict[str, Any]


def _finite(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def _thresholds() -> st.SearchStrategy[float]:
    special = st.sampled_from([0.0, SMALLEST, 1e-9, 1.0, 25.0, MAX_THRESHOLD])
    return special | _finite(0.0, MAX_THRESHOLD)


def nested_thresholds(n: int) -> st.SearchStrategy[Numbers]:
    """n non-decreasing thresholds that start at 0.0: evenly spaced, or any, ties included."""
    even = _finite(0.0, MAX_THRESHOLD / n).map(lambda step: [step * i for i in range(n)])
    free = st.lists(_thresholds(), min_size=n - 1, max_size=n - 1)
    return even | free.map(lambda values: [0.0, *sorted(values)])


@st.composite
def coupled_play_thresholds(draw: st.DrawFn) -> tuple[float, float, float, float]:
    """(r, ra, rb, rc) with r >= rc >= 0 and ra >= rb >= 0; zeros and equal ones included."""
    r, ra = draw(_thresholds()), draw(_thresholds())
    if draw(st.booleans()):
        ra = r
    rc = draw(st.sampled_from([0.0, r]) | _finite(0.0, r))
    rb = draw(st.sampled_from([0.0, ra]) | _finite(0.0, ra))
    return r, ra, rb, rc


@st.composite
def weights(draw: st.DrawFn, n: int | None = None) -> Numbers:
    """n weights (1..8 if not given): w_0 in [0.1, 10], the others in [0, 10], 0.0 included."""
    count = draw(st.integers(1, 8)) if n is None else n
    rest = st.just(0.0) | _finite(0.0, 10.0)
    return [draw(_finite(0.1, 10.0)), *draw(st.lists(rest, min_size=count - 1, max_size=count - 1))]


@st.composite
def split_or_not(draw: st.DrawFn, models: st.SearchStrategy[ModelDict]) -> ModelDict:
    """Modified models, half of them with weights_negative, and w_0 shared in half of those."""
    model = draw(models)
    if not draw(st.booleans()):
        return model
    below = draw(weights(len(model["weights"])))
    first = model["weights"][0] if draw(st.booleans()) else below[0]
    return {**model, "weights_negative": [first, *below[1:]]}


def _offsets() -> st.SearchStrategy[dict[str, float]]:
    offset = st.just(0.0) | _finite(-100.0, 100.0)
    return st.fixed_dictionaries({"input_offset": offset, "output_offset": offset})


@st.composite
def conventional_models(draw: st.DrawFn, max_operators: int = 8) -> ModelDict:
    """Invertible, nested: weights, thresholds, input_offset, output_offset."""
    n = draw(st.integers(1, max_operators))
    return {
        "weights": draw(weights(n)),
        "thresholds": draw(nested_thresholds(n)),
        **draw(_offsets()),
    }


@st.composite
def modified_models(draw: st.DrawFn, max_operators: int = 8) -> ModelDict:
    """Invertible, nested: weights, r, ra, rb, rc, input_offset, output_offset.

    Half by ratios, as in the paper (0.95, 0.30, 0.35), half with four free families.
    """
    n = draw(st.integers(1, max_operators))
    r = draw(nested_thresholds(n))
    if draw(st.booleans()):
        ka, kb, kc = draw(st.tuples(_finite(0.1, 2.0), _finite(0.0, 1.0), _finite(0.0, 1.0)))
        ra = [ka * v for v in r]
        rb, rc = [kb * v for v in ra], [kc * v for v in r]
    else:
        ra, rb, rc = (draw(nested_thresholds(n)) for _ in range(3))
        rb, rc = list(map(min, rb, ra)), list(map(min, rc, r))
    return {"weights": draw(weights(n)), "r": r, "ra": ra, "rb": rb, "rc": rc, **draw(_offsets())}


@st.composite
def not_nested_models(draw: st.DrawFn, max_operators: int = 8) -> ModelDict:
    """Invertible, for ``ModifiedPrandtlIshlinskii``, but r falls at least once (>= 3 operators)."""
    first = (0.0, 0.0, 0.0, 0.0)
    middle = draw(st.lists(coupled_play_thresholds(), max_size=max_operators - 3))
    r, ra = draw(_finite(1.0, MAX_THRESHOLD)), draw(_finite(0.0, MAX_THRESHOLD))
    big = (r, ra, ra * draw(_finite(0.0, 1.0)), r * draw(_finite(0.0, 1.0)))
    shrink = draw(_finite(0.0, 0.9))
    rows = [first, *middle, big, tuple(shrink * value for value in big)]
    columns = (list(column) for column in zip(*rows, strict=True))
    thresholds = dict(zip(("r", "ra", "rb", "rc"), columns, strict=True))
    return {"weights": draw(weights(len(rows))), **thresholds, **draw(_offsets())}


def special_inputs(model: ModelDict) -> Numbers:
    """Both signs of every threshold of a model dict, moved by its input offset."""
    names = ("thresholds", "r", "ra", "rb", "rc")
    values = {v for name in names for v in model.get(name, ())}
    offset = model.get("input_offset", 0.0)
    return sorted({offset + s * v for v in values for s in (-1.0, 1.0)})


@st.composite
def input_histories(
    draw: st.DrawFn, model: ModelDict | None = None, *, scale: float = 1000.0, max_moves: int = 20
) -> Numbers:
    """A list of 1 or more finite inputs, |x| <= 2 scale, made of random moves.

    jump anywhere; land exactly on a threshold of ``model`` (a dict as above, if given);
    +-0.0 and denormals; back to an earlier sample; hold; small steps; ramps.
    """
    exact = [0.0, -0.0, SMALLEST, -SMALLEST, 1e-310, -2.2e-308, scale, -scale]
    exact += special_inputs(model) if model else []
    jump = st.tuples(st.just("jump"), st.sampled_from(exact) | _finite(-scale, scale))
    ramp = st.tuples(st.just("ramp"), _finite(-scale, scale), st.integers(2, 6))
    hold = st.tuples(st.just("hold"), st.integers(1, 4))
    back = st.tuples(st.just("back"), st.integers(0, 1000))
    tiny = st.sampled_from([1e-15, -1e-15, 1e-9, -1e-9, SMALLEST]) | _finite(-1.0, 1.0)
    small = st.tuples(st.just("small"), tiny)
    move: st.SearchStrategy[tuple[Any, ...]] = st.one_of(jump, ramp, hold, back, small)
    moves = draw(st.lists(move, max_size=max_moves))
    xs = [draw(st.sampled_from(exact) | _finite(-scale, scale))]
    for kind, value, *rest in moves:
        x = xs[-1]
        if kind == "jump":
            xs.append(value)
        elif kind == "ramp":
            xs += [x + (value - x) * (k / rest[0]) for k in range(1, rest[0] + 1)]
        elif kind == "hold":
            xs += [x] * value
        elif kind == "back":
            xs.append(xs[value % len(xs)])
        else:
            xs.append(x + value)
    return xs


@st.composite
def oscillations(draw: st.DrawFn, scale: float = 500.0) -> Numbers:
    """Swings to and fro, each smaller or each larger than the last, by steps down to denormals."""
    xs: Numbers = []
    for _ in range(draw(st.integers(1, 3))):
        centre = draw(st.just(0.0) | _finite(-scale, scale))
        swing = draw(_finite(0.0, scale))
        step = draw(st.sampled_from([0.0, SMALLEST, 1e-9, scale / 20]) | _finite(0.0, scale / 5))
        count = draw(st.integers(1, 40))
        train = [centre + max(swing - k * step, 0.0) * (-1.0) ** k for k in range(count)]
        xs += draw(st.sampled_from([train, train[::-1]]))
    return xs
