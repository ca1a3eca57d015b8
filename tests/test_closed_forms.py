"""Inverses of the models' own form against the twin, on random models."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import reference
import strategies as own
from hypothesis import given
from hypothesis import strategies as st
from support import Drawn

AGREE = 1e-14
"""45 roundings of the largest number in a sum, as in test_laws.py."""


@given(own.conventional_models())
def test_closed_form_inverse_equals_twin(keywords: own.ModelDict) -> None:
    drawn = Drawn(keywords)
    model = mh.PrandtlIshlinskii(**keywords)
    inverse = model.closed_form_inverse()
    w, r = reference.closed_form_inverse(keywords["weights"], keywords["thresholds"])
    np.testing.assert_allclose(inverse.weights, w, rtol=1e-14)
    # the twin sums differences, the core grows each r' from the last: n roundings of the last
    scale = sum(drawn.weights) * drawn.input_scale([0.0])
    np.testing.assert_allclose(inverse.thresholds, r, rtol=0, atol=AGREE * scale)
    assert inverse.input_offset == model.output_offset
    assert inverse.output_offset == model.input_offset


@given(own.modified_models(), st.floats(0.0, 2.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_parametric_inverse_equals_twin(
    keywords: own.ModelDict, ra: float, share: float, rc: float
) -> None:
    drawn, rb = Drawn(keywords), ra * share
    model = mh.ModifiedPrandtlIshlinskii(**keywords)
    inverse = model.parametric_inverse(ra, rb, rc)
    got = (inverse.weights, inverse.r, inverse.ra, inverse.rb, inverse.rc)
    expected = reference.parametric_inverse(keywords["weights"], keywords["r"], ra, rb, rc)
    np.testing.assert_allclose(got[0], expected[0], rtol=1e-14)
    scale = max(1.0, ra) * sum(drawn.weights) * drawn.input_scale([0.0])
    np.testing.assert_allclose(got[1:], expected[1:], rtol=0, atol=AGREE * scale)
    assert inverse.input_offset == model.output_offset
    assert inverse.output_offset == model.input_offset
