//! What a linear part that the model lacks would add to its output, as a sum of lags.

use faer::{Mat, c64};

use super::autoregression::Autoregression;

/// Each lag is so many times as long as the one before: half a decade.
const RATIO: f64 = 3.162_277_660_168_379_5;

/// From here on a lag is creep, which comes on top of the output at once; a shorter one is of dynamics, which have unit static
/// gain. In sampling intervals.
const CREEP_SAMPLES: f64 = 30.0;

/// Residuals ring where a pole of their model is at least so large: the ringing falls to 1/e in more than four samples.
const RINGING: f64 = 0.8;

/// The residuals of a record ring at so many frequencies at most.
const MAX_RINGING: usize = 3;

/// Time constants from one sample to the length of the longest record, in its unit of time, and the poles at which residuals ring.
///
/// Left-out dynamics or creep add a linear response to the modelled output h. It is nearly a sum of c_j q_j, or c_j (q_j - h) for
/// short time constants, with q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k) and a_j = exp(-dt / tau_j). Left-out dynamics of low damping
/// ring with a frequency and a damping of their own, and so does what they leave. There a_j = exp(s_j dt), with a complex s_j: the
/// real part of q_j - h and the imaginary part each have an amplitude.
pub(crate) struct Lags {
    time_constants: Vec<f64>,
    creep_from: f64,
    /// s_j, with a positive imaginary part.
    ringing: Vec<c64>,
}

impl Lags {
    /// For records that are sampled every `dt` at least, the longest of this length.
    pub(crate) fn new(dt: f64, longest: f64) -> Self {
        let constants = std::iter::successors(Some(dt), |tau| Some(tau * RATIO));
        let time_constants = constants.take_while(|tau| *tau <= longest).collect();
        Self { time_constants, creep_from: CREEP_SAMPLES * dt, ringing: Vec::new() }
    }

    /// Those of dynamics alone, shorter than any creep that is in the model: longer ones are not told from it.
    pub(crate) fn beside_creep(mut self, time_constants: &[f64]) -> Self {
        if let Some(shortest) = time_constants.iter().copied().reduce(f64::min) {
            let from = shortest.min(self.creep_from);
            self.time_constants.retain(|tau| *tau < from);
        }
        self
    }

    /// The same with the frequencies at which the residuals of a record ring, by their model.
    pub(crate) fn with_ringing(mut self, residuals: &Autoregression, dt: f64) -> Self {
        self.ringing.extend(ringing(residuals).into_iter().map(|a| a.ln() / dt));
        self
    }

    /// None.
    pub(crate) fn none() -> Self {
        Self { time_constants: Vec::new(), creep_from: 0.0, ringing: Vec::new() }
    }

    /// How many columns they have.
    pub(crate) fn len(&self) -> usize {
        self.time_constants.len() + 2 * self.ringing.len()
    }

    /// Whether each column is one of creep.
    pub(crate) fn are_creep(&self) -> Vec<bool> {
        let of_ringing = std::iter::repeat_n(false, 2 * self.ringing.len());
        self.time_constants.iter().map(|tau| *tau >= self.creep_from).chain(of_ringing).collect()
    }

    /// How much later slow motion is seen per unit of the amplitude of every column: dynamics delay it, creep does not count.
    pub(crate) fn delays(&self, dt: f64) -> Vec<f64> {
        let of_lag = |tau: &f64| if *tau < self.creep_from { -dt / (-dt / tau).exp_m1() } else { 0.0 };
        let of_ringing = |s: &c64| {
            let delay = dt / (1.0 - (s * dt).exp());
            [delay.re, delay.im]
        };
        self.time_constants.iter().map(of_lag).chain(self.ringing.iter().flat_map(of_ringing)).collect()
    }

    /// The lags of one record, at rest at the first value of its output.
    pub(crate) fn of_record(&self, rest: f64, dt: f64) -> LagLane<'_> {
        LagLane {
            lags: self,
            rest,
            shares: self.time_constants.iter().map(|tau| -(-dt / tau).exp_m1()).collect(),
            states: vec![0.0; self.time_constants.len()],
            factors: self.ringing.iter().map(|s| (s * dt).exp()).collect(),
            ringing: vec![c64::new(0.0, 0.0); self.ringing.len()],
        }
    }
}

/// The poles at which residuals ring, one of every pair, the longest first.
fn ringing(model: &Autoregression) -> Vec<c64> {
    let order = model.order();
    let companion = Mat::from_fn(order, order, |i, j| match (i, j) {
        (0, j) => -model.coefficients[j],
        (i, j) => f64::from(i == j + 1),
    });
    // What rings is told nothing of where its poles cannot be found.
    let poles = if order == 0 { Vec::new() } else { companion.eigenvalues().unwrap_or_default() };
    let mut poles: Vec<c64> = poles.into_iter().filter(|a| a.im > 0.0 && a.norm() > RINGING).collect();
    poles.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    poles.truncate(MAX_RINGING);
    poles
}

/// See [`Lags::of_record`].
pub(crate) struct LagLane<'a> {
    lags: &'a Lags,
    rest: f64,
    shares: Vec<f64>,
    states: Vec<f64>,
    /// exp(s_j dt).
    factors: Vec<c64>,
    ringing: Vec<c64>,
}

impl LagLane<'_> {
    /// Writes what the lags add at the next sample of the output, which goes on.
    pub(crate) fn next(&mut self, output: f64, row: &mut [f64]) {
        let h = output - self.rest;
        let (row, ringing) = row.split_at_mut(self.states.len());
        let states = self.states.iter_mut().zip(&self.shares).zip(&self.lags.time_constants);
        for (value, ((q, share), tau)) in row.iter_mut().zip(states) {
            *value = if *tau < self.lags.creep_from { *q - h } else { *q };
            *q += share * (h - *q);
        }
        for (pair, (q, a)) in ringing.chunks_exact_mut(2).zip(self.ringing.iter_mut().zip(&self.factors)) {
            pair.copy_from_slice(&[q.re - h, q.im]);
            *q = h + a * (*q - h);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lags_of_a_step_go_to_its_height_or_take_nothing_from_it() {
        let lags = Lags::new(0.1, 40.0);
        assert_eq!(lags.len(), 6);
        let mut lane = lags.of_record(2.0, 0.1);
        let mut row = vec![0.0; 6];
        lane.next(2.0, &mut row);
        assert_eq!(row, [0.0; 6]);
        lane.next(3.0, &mut row);
        assert_eq!(row, [-1.0, -1.0, -1.0, 0.0, 0.0, 0.0]);
        lane.next(3.0, &mut row);
        assert!((row[0] + (-1.0_f64).exp()).abs() < 1e-12, "{row:?}");
        (0..10_000).for_each(|_| lane.next(3.0, &mut row));
        let delays = lags.delays(0.1);
        assert!((delays[0] - 0.1 / (1.0 - (-1.0_f64).exp())).abs() < 1e-12 && delays[3] == 0.0);
        assert!(row[..3].iter().all(|q| q.abs() < 1e-9) && row[3..].iter().all(|q| (q - 1.0).abs() < 1e-9), "{row:?}");
    }

    /// 800 Hz, damping 0.05, at 10 kHz: a ramp is seen later by the delay, and a step rings with that frequency.
    #[test]
    fn what_rings_follows_a_ramp_by_its_delay() {
        let (dt, s) = (1e-4, c64::new(-0.05, 0.998_749_2) * (core::f64::consts::TAU * 800.0));
        let a = (s * dt).exp();
        let model = Autoregression { coefficients: vec![-2.0 * a.re, a.norm_sqr()], deviation: 1.0 };
        let lags = Lags { time_constants: Vec::new(), ..Lags::new(dt, 0.0) }.with_ringing(&model, dt);
        assert!(lags.len() == 2 && (lags.ringing[0] - s).norm() < 1e-6 * s.norm(), "{:?}", lags.ringing);
        let (mut lane, mut row, delays) = (lags.of_record(1.0, dt), [0.0; 2], lags.delays(dt));
        (0..3000).for_each(|k| lane.next(1.0 + 5.0 * f64::from(k) * dt, &mut row));
        assert!(
            (row[0] + 5.0 * delays[0]).abs() < 1e-9 && (row[1] + 5.0 * delays[1]).abs() < 1e-9,
            "{row:?} {delays:?}"
        );
    }

    #[test]
    fn white_residuals_and_slow_ones_do_not_ring() {
        let with = |coefficients| ringing(&Autoregression { coefficients, deviation: 1.0 }).len();
        assert_eq!([with(vec![]), with(vec![-0.95]), with(vec![-0.5, 0.3]), with(vec![-1.0, 0.9])], [0, 0, 0, 1]);
    }
}
