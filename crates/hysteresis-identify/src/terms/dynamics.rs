//! The linear part: amplifier, dynamics of one mode or several, and dead time; what they do from sample to sample.
//!
//! Their options are here too: which dynamics, how many modes, which amplifier.

use core::f64::consts::TAU;

use hysteresis_control::linear::{Block, CreepBlock, Dynamics, SecondOrder};

use crate::error::Error;

/// The order of linear dynamics, of unit static gain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// A first-order lag.
    First,
    /// Second-order dynamics: a resonance, or two lags.
    #[default]
    Second,
}

/// Which linear dynamics to fit behind the hysteresis, of unit static gain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DynamicsModel {
    /// None.
    None,
    /// Of second order, if the records tell them, or of first order where they do not tell overdamped ones from that,
    /// or where a lag beside a map predicts better than a dead time; none without a sampling interval.
    #[default]
    Auto,
    /// These.
    Order(Order),
}

/// The most modes that are fitted.
pub(crate) const MAX_MODES: usize = 3;

/// How many modes in parallel the dynamics of second order have:
/// G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1), sum_i g_i = 1.
///
/// ```
/// use hysteresis_identify::{ModesModel, Options};
/// let options = Options { dt: Some(1e-4), modes: ModesModel::Number(2), ..Options::default() };
/// assert_ne!(options.modes, ModesModel::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ModesModel {
    /// One, and a second and a third as far as the records tell them.
    #[default]
    Auto,
    /// So many, 1 to 3, as far as the records tell them: a finding says if there are fewer. More than one ask for
    /// dynamics of second order.
    Number(usize),
}

impl ModesModel {
    /// How many modes there may be.
    pub(crate) fn most(self) -> usize {
        match self {
            Self::Auto => MAX_MODES,
            Self::Number(number) => number,
        }
    }

    /// Whether dynamics of second order are asked for.
    pub(crate) fn asks_for_dynamics(self) -> bool {
        matches!(self, Self::Number(number) if number > 1)
    }

    /// Checks a number, and that several modes have dynamics of second order.
    pub(crate) fn check(self, may_have_modes: bool) -> Result<(), Error> {
        let Self::Number(number) = self else { return Ok(()) };
        if !(1..=MAX_MODES).contains(&number) {
            return Err(Error::whole("modes", "1, 2 or 3", number));
        }
        if number > 1 && !may_have_modes {
            return Err(Error::whole("modes", "1 without second-order dynamics (dynamics 2)", number));
        }
        Ok(())
    }
}

/// The amplifier in front of the hysteresis: a lag of first order.
///
/// ```
/// use hysteresis_identify::{AmplifierModel, DynamicsModel, Options, Order};
/// let dynamics = DynamicsModel::Order(Order::Second);
/// let options =
///     Options { dt: Some(1e-4), dynamics, amplifier: AmplifierModel::Bandwidth(400.0), ..Options::default() };
/// assert_ne!(options.amplifier, AmplifierModel::default());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AmplifierModel {
    /// None.
    None,
    /// One whose bandwidth is fitted, if second-order dynamics are and the records tell it from a dead time, or if it
    /// predicts better than they do, or than a dead time.
    #[default]
    Auto,
    /// Of this bandwidth in Hz; beside second-order dynamics or in place of dynamics.
    Bandwidth(f64),
}

impl AmplifierModel {
    /// Checks a bandwidth, and that dynamics beside it are of second order or known to be none.
    pub(crate) fn check(self, dynamics: DynamicsModel) -> Result<(), Error> {
        let Self::Bandwidth(bandwidth) = self else { return Ok(()) };
        if !(bandwidth.is_finite() && bandwidth > 0.0) {
            return Err(Error::domain("amplifier", None, "a bandwidth in Hz above 0", bandwidth));
        }
        if !matches!(dynamics, DynamicsModel::None | DynamicsModel::Order(Order::Second)) {
            let expected = "none but beside second-order dynamics (dynamics 2) or without dynamics";
            return Err(Error::domain("amplifier", None, expected, bandwidth));
        }
        Ok(())
    }
}

/// Creep, dynamics and dead time behind the hysteresis.
///
/// With h(k) the output of the hysteresis for the drive put out at t_k = k T,
///
/// ```text
/// p(k) = h(k) + sum_j c_j q_j(k),   q_j(k+1) = a_j q_j(k) + (1 - a_j) h(k),   a_j = exp(-T / tau_j)
/// y(k) = x(t_k - d),   x the answer of the dynamics to p(k), held from t_k to t_(k+1)
/// ```
///
/// Without dynamics y(k) is p(t_k - d), straight between samples. With several modes x = sum_i g_i x_i, x_i the answer
/// of mode i alone and sum_i g_i = 1.
///
/// Behind an amplifier, p(k) is that at the end of the interval, and on the way there from p(k-1) it goes as the
/// voltage does:
///
/// ```text
/// p(t_k + s) = p_end + (p(k-1) - p_end) exp(-s / tau),   p_end = p(k-1) + (p(k) - p(k-1)) / (1 - exp(-T / tau))
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct LinearPart {
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::dynamics"))]
    pub(crate) dynamics: Option<Dynamics>,
    /// The modes beside the one that `dynamics` then are, which has the rest of the gain.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) further: Vec<Mode>,
    /// c_j.
    pub(crate) amplitudes: Vec<f64>,
    /// tau_j, in seconds.
    pub(crate) time_constants: Vec<f64>,
    /// d, in seconds; in samples for records without a sampling interval.
    pub(crate) dead_time: f64,
    /// Of the amplifier in front of the hysteresis, in Hz.
    pub(crate) bandwidth: Option<f64>,
}

/// One of several modes in parallel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Mode {
    /// In Hz.
    pub(crate) frequency: f64,
    pub(crate) damping: f64,
    /// g_i, its share in the static gain.
    pub(crate) gain: f64,
}

impl Mode {
    /// By how much slow motion is seen later.
    pub(crate) fn lag(&self) -> f64 {
        2.0 * self.damping / (TAU * self.frequency)
    }

    /// The mode alone.
    pub(crate) fn dynamics(&self) -> Dynamics {
        let valid = "the bounds of the search hold frequency and damping within their domains";
        SecondOrder::new(self.frequency, self.damping).expect(valid).into()
    }
}

impl LinearPart {
    /// A dead time alone.
    pub(crate) fn delay(dead_time: f64) -> Self {
        Self { dead_time, ..Self::default() }
    }

    /// Whether the output is that of the hysteresis, only later.
    pub(crate) fn is_dead_time_alone(&self) -> bool {
        self.dynamics.is_none() && self.time_constants.is_empty()
    }

    /// The lag of the amplifier.
    pub(crate) fn amplifier_lag(&self) -> f64 {
        self.bandwidth.map_or(0.0, |bandwidth| 1.0 / (TAU * bandwidth))
    }

    /// All modes, the first one first; none without dynamics of second order.
    pub(crate) fn modes(&self) -> Vec<Mode> {
        let Some(Dynamics::SecondOrder(first)) = self.dynamics else { return Vec::new() };
        let first = Mode { frequency: first.frequency(), damping: first.damping(), gain: self.first_gain() };
        std::iter::once(first).chain(self.further.iter().copied()).collect()
    }

    /// The same from the lowest frequency up, each with its number.
    pub(crate) fn in_order(&self) -> Vec<(usize, Mode)> {
        let mut modes: Vec<_> = self.modes().into_iter().enumerate().collect();
        modes.sort_by(|(_, a), (_, b)| a.frequency.total_cmp(&b.frequency));
        modes
    }

    /// g of the first mode.
    fn first_gain(&self) -> f64 {
        1.0 - self.further.iter().map(|mode| mode.gain).sum::<f64>()
    }

    /// How much later slow motion is seen: the dead time and the lags of the amplifier and of the dynamics, tau or
    /// sum_i g_i 2 zeta_i / w_i.
    pub(crate) fn lag(&self) -> f64 {
        let dynamics = match self.dynamics {
            Some(Dynamics::FirstOrder(lag)) => lag.time_constant(),
            _ => self.modes().iter().map(|mode| mode.gain * mode.lag()).sum(),
        };
        self.dead_time + self.amplifier_lag() + dynamics
    }
}

/// [`LinearPart`] for a sampling interval.
#[derive(Clone, Debug)]
pub(crate) struct SampledPart {
    pub(crate) amplitudes: Vec<f64>,
    /// a_j.
    pub(crate) decays: Vec<f64>,
    pub(crate) dynamics: Option<SampledDynamics>,
    /// The share of these dynamics, and the modes beside them with theirs.
    pub(crate) first_gain: f64,
    pub(crate) further: Vec<(f64, SampledDynamics)>,
    /// By how many whole samples the sample that is held lies back.
    pub(crate) whole: isize,
    /// Without dynamics: the share of the sample before it.
    pub(crate) share: f64,
}

/// Dynamics for a sampling interval. The state is (x, v), v = x' / w; of a lag only x.
#[derive(Clone, Debug)]
pub(crate) struct SampledDynamics {
    /// exp(T A): (x - p, v) at t_(k+1) from that at t_k.
    pub(crate) step: Transition,
    /// exp(s A): the same at t_k + s, where the output is read; 0 <= s < T.
    pub(crate) reading: Transition,
    /// w, in radians per second (or sample).
    w: f64,
    is_lag: bool,
    pub(crate) amplifier: Option<SampledAmplifier>,
}

/// An input that does not jump to what it will be, but decays towards it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampledAmplifier {
    /// 1 / (1 - exp(-T / tau)).
    pub(crate) reach: f64,
    /// The state (x, v) for an input exp(-t / tau), at its start.
    pub(crate) start: [f64; 2],
    /// exp(-T / tau), and exp(-s / tau) where the output is read.
    pub(crate) step: f64,
    pub(crate) reading: f64,
    /// 1 / tau.
    sigma: f64,
}

impl SampledPart {
    pub(crate) fn new(part: &LinearPart, dt: f64) -> Self {
        let samples = part.dead_time / dt;
        // What acts at t_k - d: with dynamics the sample that was put out last, and what passed since; without, the
        // straight line between the one put out next and the one before.
        let back = if part.dynamics.is_some() { samples.ceil() } else { samples.floor() };
        #[expect(clippy::cast_possible_truncation, reason = "a dead time is not longer than a record")]
        let whole = back as isize;
        let since = (back - samples) * dt;
        let sampled = |dynamics: Dynamics| SampledDynamics::new(&dynamics, part.bandwidth, dt, since);
        let dynamics = part.dynamics.map(sampled);
        let further = part.further.iter().map(|mode| (mode.gain, sampled(mode.dynamics())));
        Self {
            amplitudes: part.amplitudes.clone(),
            decays: part.time_constants.iter().map(|tau| (-dt / tau).exp()).collect(),
            dynamics,
            first_gain: part.first_gain(),
            further: further.collect(),
            whole,
            share: samples - samples.floor(),
        }
    }

    /// Its creep, at rest at what comes first.
    pub(crate) fn creep_at(&self, first: Option<f64>) -> CreepBlock {
        let mut creep = CreepBlock::of_decays(&self.amplitudes, &self.decays);
        creep.settle(first.unwrap_or_default());
        creep
    }

    /// The sample that acts on the reading at `sample`; none before the record.
    pub(crate) fn source(&self, sample: usize) -> Option<usize> {
        sample.checked_add_signed(-self.whole)
    }
}

impl SampledDynamics {
    fn new(dynamics: &Dynamics, bandwidth: Option<f64>, dt: f64, since: f64) -> Self {
        let (w, damping) = match dynamics {
            Dynamics::FirstOrder(lag) => (TAU * lag.frequency(), None),
            Dynamics::SecondOrder(resonance) => (TAU * resonance.frequency(), Some(resonance.damping())),
        };
        let transition =
            |t: f64| damping.map_or_else(|| Transition::lag(w * t), |zeta| Transition::resonance(w * t, zeta));
        let amplifier = bandwidth.map(|bandwidth| SampledAmplifier::new(TAU * bandwidth, w, damping, dt, since));
        Self { step: transition(dt), reading: transition(since), w, is_lag: damping.is_none(), amplifier }
    }

    /// What of x at the reading decays with an input that is so far from where it goes at t_k.
    #[inline]
    pub(crate) fn decaying(&self, left: f64) -> f64 {
        self.amplifier.map_or(0.0, |amplifier| amplifier.start[0] * amplifier.reading * left)
    }

    /// x - p at the reading, for a state (x - p, v) and an input that is so far from where it goes.
    #[inline]
    pub(crate) fn answer(&self, deviation: f64, v: f64, left: f64) -> f64 {
        self.reading.xx * deviation + self.reading.xv * v + self.decaying(left)
    }

    /// x' at the reading, for the same.
    #[inline]
    pub(crate) fn speed(&self, deviation: f64, v: f64, left: f64) -> f64 {
        let e = &self.reading;
        // A lag moves towards its input; of second-order dynamics v is x' / w.
        let speed = self.w * if self.is_lag { -e.xx * deviation } else { e.vx * deviation + e.vv * v };
        self.amplifier.as_ref().map_or(speed, |amplifier| speed - amplifier.sigma * self.decaying(left))
    }
}

impl SampledAmplifier {
    /// Of x'' = w^2 (u - x) - 2 zeta w x', or x' = w (u - x), the part that decays with the input.
    fn new(sigma: f64, w: f64, damping: Option<f64>, dt: f64, since: f64) -> Self {
        /// Below this share a divisor is near its zero; 1 / tau is then moved by the other share.
        const SMALL: f64 = 1e-7;
        const MOVED: f64 = 1.001;
        // Over w, or w^2.
        let divisor = |sigma: f64| damping.map_or(1.0 - sigma / w, |zeta| (sigma / w - 2.0 * zeta) * sigma / w + 1.0);
        let sigma = if divisor(sigma).abs() < SMALL { MOVED * sigma } else { sigma };
        let x = 1.0 / divisor(sigma);
        let start = [x, if damping.is_some() { -sigma * x / w } else { 0.0 }];
        let step = (-sigma * dt).exp();
        Self { reach: -1.0 / (-sigma * dt).exp_m1(), start, step, reading: (-sigma * since).exp(), sigma }
    }
}

/// exp(t A) for (x - p, v), A = \[0, w; -w, -2 zeta w\]; of a lag, A = -w, only the first entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transition {
    pub(crate) xx: f64,
    pub(crate) xv: f64,
    pub(crate) vx: f64,
    pub(crate) vv: f64,
}

impl Transition {
    fn lag(angle: f64) -> Self {
        Self { xx: (-angle).exp(), xv: 0.0, vx: 0.0, vv: 0.0 }
    }

    /// With C = cos r and S = sin r / r, r^2 = angle^2 (1 - zeta^2), both hyperbolic where that is negative:
    /// exp(-zeta angle) \[C + zeta angle S, angle S; -angle S, C - zeta angle S\].
    fn resonance(angle: f64, zeta: f64) -> Self {
        let (decay, square) = (zeta * angle, angle * angle * (1.0 - zeta * zeta));
        let root = square.abs().sqrt();
        let (c, s) = if root < 1e-4 {
            // The next terms of the series are below rounding.
            ((-decay).exp() * (1.0 - 0.5 * square), (-decay).exp() * (1.0 - square / 6.0))
        } else if square > 0.0 {
            ((-decay).exp() * root.cos(), (-decay).exp() * root.sin() / root)
        } else {
            // exp(-decay) cosh(root) would overflow on its own; root is at most decay.
            let (slow, fast) = ((root - decay).exp(), (-root - decay).exp());
            (0.5 * (slow + fast), 0.5 * (slow - fast) / root)
        };
        Self { xx: c + decay * s, xv: angle * s, vx: -angle * s, vv: c - decay * s }
    }
}

/// At rest before the first sample.
pub(crate) struct DynamicsFilter {
    /// The first one, and those beside it.
    modes: Vec<ModeFilter>,
    /// Behind an amplifier: what of a reading decays with the input, for an input that is 1 from where it goes at t_k.
    decaying_gain: f64,
    share: f64,
    /// The last input, and the one before.
    p: f64,
    before: f64,
    /// Behind an amplifier: how far the input is from where it goes, at t_k.
    decaying: f64,
    is_at_rest: bool,
}

/// A mode with its share in the static gain.
struct ModeFilter {
    gain: f64,
    dynamics: SampledDynamics,
    /// x - p and v at t_k, but for what decays with the input behind an amplifier.
    deviation: f64,
    v: f64,
}

impl DynamicsFilter {
    pub(crate) fn new(part: &SampledPart) -> Self {
        let first = part.dynamics.iter().map(|dynamics| (part.first_gain, dynamics));
        let all = first.chain(part.further.iter().map(|(gain, dynamics)| (*gain, dynamics)));
        let modes: Vec<_> = all
            .map(|(gain, dynamics)| ModeFilter { gain, dynamics: dynamics.clone(), deviation: 0.0, v: 0.0 })
            .collect();
        let decaying_gain = modes.iter().fold(0.0, |sum, mode| sum + mode.gain * mode.dynamics.decaying(1.0));
        let (share, is_at_rest) = (part.share, true);
        Self { modes, decaying_gain, share, p: 0.0, before: 0.0, decaying: 0.0, is_at_rest }
    }

    /// Takes p(k).
    pub(crate) fn take(&mut self, p: f64) {
        if std::mem::take(&mut self.is_at_rest) {
            (self.p, self.before) = (p, p);
        }
        match self.modes.first().and_then(|first| first.dynamics.amplifier) {
            Some(amplifier) => self.lead(p, amplifier.reach),
            None => self.hold(p),
        }
    }

    /// Through an interval in which the last p was held; from now on the distance is that from this one.
    fn hold(&mut self, p: f64) {
        (self.before, self.p) = (self.p, p);
        for ModeFilter { dynamics, deviation, v, .. } in &mut self.modes {
            let e = dynamics.step;
            let moved = e.xx * *deviation + e.xv * *v;
            *v = e.vx * *deviation + e.vv * *v;
            *deviation = moved + (self.before - p);
        }
    }

    /// Behind an amplifier the input goes from the last p to this one by the end of the interval. What is kept as p is
    /// where it would go, and of the state what does not decay with it.
    fn lead(&mut self, p: f64, reach: f64) {
        let end = self.before + (p - self.before) * reach;
        let left = self.before - end;
        for ModeFilter { dynamics, deviation, v, .. } in &mut self.modes {
            let Some(amplifier) = dynamics.amplifier else { continue };
            let (e, [x, speed]) = (dynamics.step, amplifier.start);
            let change = self.decaying * amplifier.step - left;
            let moved = e.xx * *deviation + e.xv * *v;
            *v = e.vx * *deviation + e.vv * *v + speed * change;
            *deviation = moved + (self.p - end) + x * change;
        }
        (self.p, self.before, self.decaying) = (end, p, left);
    }

    /// What is read.
    pub(crate) fn reading(&self) -> f64 {
        if self.modes.is_empty() {
            return self.p + self.share * (self.before - self.p);
        }
        let add = |sum: f64, mode: &ModeFilter| {
            let e = mode.dynamics.reading;
            sum + mode.gain * (e.xx * mode.deviation + e.xv * mode.v)
        };
        self.modes.iter().fold(self.p, add) + self.decaying_gain * self.decaying
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_control::linear::{Block, FirstOrder};

    use super::*;

    /// exp(2 t A) = exp(t A)^2 across under-, critically and overdamped, and what the blocks of the other crate do.
    #[test]
    fn transitions_compose_and_equal_the_blocks() {
        for zeta in [1e-4, 0.02, 0.95, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.7, 10.0] {
            for angle in [1e-6, 0.3, 2.0, 300.0] {
                let (one, two) = (Transition::resonance(angle, zeta), Transition::resonance(2.0 * angle, zeta));
                let product = [
                    one.xx * one.xx + one.xv * one.vx,
                    one.xx * one.xv + one.xv * one.vv,
                    one.vx * one.xx + one.vv * one.vx,
                    one.vx * one.xv + one.vv * one.vv,
                ];
                for (got, want) in product.into_iter().zip([two.xx, two.xv, two.vx, two.vv]) {
                    assert!((got - want).abs() < 1e-11, "{zeta} {angle}: {got} {want}");
                }
            }
            let dt = 1e-4;
            let resonance = SecondOrder::new(800.0, zeta).unwrap();
            let mut block = resonance.block(dt).unwrap();
            let sampled = SampledDynamics::new(&resonance.into(), None, dt, 0.0);
            let (mut deviation, mut v, mut last) = (0.0, 0.0, 0.0);
            for (k, p) in [1.0, -2.0, 0.5, 0.5, 3.0].into_iter().enumerate() {
                deviation += last - p;
                (deviation, v) = (
                    sampled.step.xx * deviation + sampled.step.xv * v,
                    sampled.step.vx * deviation + sampled.step.vv * v,
                );
                last = p;
                assert!((p + deviation - block.advance(p)).abs() < 1e-12, "{zeta} {k}");
            }
        }
        let lag = FirstOrder::new(50.0).unwrap();
        let sampled = SampledDynamics::new(&lag.into(), None, 1e-3, 4e-4);
        assert!((sampled.step.xx - (-1e-3 / lag.time_constant()).exp()).abs() < 1e-15);
        assert!((sampled.reading.xx - (-4e-4 / lag.time_constant()).exp()).abs() < 1e-15);
    }

    #[test]
    fn what_acts_on_a_reading() {
        let resonance = Some(SecondOrder::new(800.0, 0.1).unwrap().into());
        let at = |dynamics, dead_time| {
            let part = SampledPart::new(&LinearPart { dynamics, dead_time, ..LinearPart::default() }, 0.5);
            (part.source(3), part.share)
        };
        assert_eq!(at(None, 0.0), (Some(3), 0.0));
        assert_eq!(at(None, 0.625), (Some(2), 0.25));
        assert_eq!(at(resonance, 0.625).0, Some(1)); // held from t_1 on, read three quarters of an interval later
        assert_eq!(at(resonance, -0.5).0, Some(4));
        assert_eq!(at(resonance, -0.25).0, Some(3));
        assert_eq!(at(resonance, 2.5).0, None);
    }
}
