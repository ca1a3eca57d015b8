//! What a linear part that the model lacks would add to its output, as a sum of lags.

/// Each lag is so many times as long as the one before: half a decade.
const RATIO: f64 = 3.162_277_660_168_379_5;

/// From here on a lag is creep, which comes on top of the output at once; a shorter one is of dynamics, which have unit static
/// gain. In sampling intervals.
const CREEP_SAMPLES: f64 = 30.0;

/// Time constants from one sample to the length of the longest record, in its unit of time.
///
/// Left-out dynamics or creep add a linear response to the modelled output h. It is nearly a sum of c_j q_j, or c_j (q_j - h) for
/// short time constants, with q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k) and a_j = exp(-dt / tau_j).
pub(crate) struct Lags {
    time_constants: Vec<f64>,
    creep_from: f64,
}

impl Lags {
    /// For records that are sampled every `dt` at least, the longest of this length.
    pub(crate) fn new(dt: f64, longest: f64) -> Self {
        let constants = std::iter::successors(Some(dt), |tau| Some(tau * RATIO));
        Self { time_constants: constants.take_while(|tau| *tau <= longest).collect(), creep_from: CREEP_SAMPLES * dt }
    }

    /// None.
    pub(crate) fn none() -> Self {
        Self { time_constants: Vec::new(), creep_from: 0.0 }
    }

    pub(crate) fn len(&self) -> usize {
        self.time_constants.len()
    }

    /// How much later slow motion is seen per unit of the amplitude of a lag: dynamics delay it, creep does not count.
    pub(crate) fn delay(&self, number: usize, dt: f64) -> f64 {
        let tau = self.time_constants[number];
        if tau < self.creep_from { -dt / (-dt / tau).exp_m1() } else { 0.0 }
    }

    /// The lags of one record, at rest at the first value of its output.
    pub(crate) fn of_record(&self, rest: f64, dt: f64) -> LagLane<'_> {
        let shares = self.time_constants.iter().map(|tau| -(-dt / tau).exp_m1()).collect();
        LagLane { lags: self, rest, shares, states: vec![0.0; self.len()] }
    }
}

/// See [`Lags::of_record`].
pub(crate) struct LagLane<'a> {
    lags: &'a Lags,
    rest: f64,
    shares: Vec<f64>,
    states: Vec<f64>,
}

impl LagLane<'_> {
    /// Writes what the lags add at the next sample of the output, which goes on.
    pub(crate) fn next(&mut self, output: f64, row: &mut [f64]) {
        let h = output - self.rest;
        let states = self.states.iter_mut().zip(&self.shares).zip(&self.lags.time_constants);
        for (value, ((q, share), tau)) in row.iter_mut().zip(states) {
            *value = if *tau < self.lags.creep_from { *q - h } else { *q };
            *q += share * (h - *q);
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
        assert!((lags.delay(0, 0.1) - 0.1 / (1.0 - (-1.0_f64).exp())).abs() < 1e-12 && lags.delay(3, 0.1) == 0.0);
        assert!(row[..3].iter().all(|q| q.abs() < 1e-9) && row[3..].iter().all(|q| (q - 1.0).abs() < 1e-9), "{row:?}");
    }
}
