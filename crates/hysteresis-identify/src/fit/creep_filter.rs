//! Creep of one signal, sample by sample.

use super::linear_part::SampledPart;

/// p(k) = h(k) + sum_j c_j q_j(k), at rest before the first sample.
pub(crate) struct CreepFilter {
    terms: Vec<Term>,
    is_at_rest: bool,
}

struct Term {
    /// c_j and a_j.
    amplitude: f64,
    decay: f64,
    /// q_j(k).
    q: f64,
}

impl CreepFilter {
    pub(crate) fn new(part: &SampledPart) -> Self {
        let both = part.amplitudes.iter().zip(&part.decays);
        let terms = both.map(|(amplitude, decay)| Term { amplitude: *amplitude, decay: *decay, q: 0.0 }).collect();
        Self { terms, is_at_rest: true }
    }

    /// Takes h(k) and returns p(k).
    pub(crate) fn next(&mut self, h: f64) -> f64 {
        if std::mem::take(&mut self.is_at_rest) {
            self.terms.iter_mut().for_each(|term| term.q = h);
        }
        let mut p = h;
        for Term { amplitude, decay, q } in &mut self.terms {
            p += *amplitude * *q;
            // The distance from rest decays: at rest nothing moves, not even a rounding.
            *q = h + *decay * (*q - h);
        }
        p
    }
}
