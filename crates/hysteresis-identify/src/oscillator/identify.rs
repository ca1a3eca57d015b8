//! The way from a record to an oscillator: linear at first, then with ever more knots.

use std::f64::consts::TAU;

use hysteresis_control::oscillator::{Hold, HystereticOscillator, usual_sub_steps};
use hysteresis_core::{Duhem, MAX_KNOTS};

use super::data::{Data, Part};
use super::descent::{Fit, descend};
use super::friction;
use super::pass::{Excitation, KNOTS, Point};
use super::result::{OscillatorIdentification, OscillatorTrial, findings, standard_errors};
use crate::error::Error;
use crate::records::signal::{as_f64, bounds, mean, rms};

/// How an oscillator is identified. By default everything is found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OscillatorOptions {
    /// How many periods the record has, all steady; 1 for one from rest that does not repeat. None looks for them.
    pub periods: Option<usize>,
    /// What the drive does between samples. None takes what fits better.
    pub hold: Option<Hold>,
    /// The number of knots: 3, 5 or 9. None takes what held-out samples ask for.
    pub knots: Option<usize>,
    /// Leading samples that are not fitted, of a record that does not repeat.
    pub skip: usize,
}

/// More knots must make held-out samples better by this many standard deviations of the difference.
const SIGNIFICANT: f64 = 2.0;

/// Samples whose errors are correlated: differences are judged by means of so many, or of fewer if that makes less
/// than eight blocks. Less than four tell nothing.
const BLOCK: usize = 64;
const BLOCKS: (usize, usize) = (4, 8);

/// By how much of their reach the knots lie beyond the largest z.
const MARGIN: f64 = 0.02;

/// What z may go beyond the knots, or fall short of them, before they are set anew.
const MOVED: (f64, f64) = (1.0, 0.9);

/// Friction slides at an end of the knots where f has fallen to this share of its largest value.
const SLIDES: f64 = 1e-2;

/// The force at which friction slides is searched by steps of this share of it, halved as long as they are larger than
/// the second number. A better force lowers the squares by a noise variance, and so many are tried at most.
const FORCE_STEPS: (f64, f64) = (0.08, 4e-3);
const FORCES: usize = 24;

/// The fewest periods of an oscillator in its record.
const SLOWEST: f64 = 2.0;

/// How often knots are set anew.
const PLACEMENTS: usize = 4;

/// Identifies y'' + c y' + k y + z\[y\] = b u, z a Duhem operator of y, from a record of the drive u and the position
/// y.
///
/// It begins at the best linear oscillator: a scan over frequency and damping, then a descent. Half of its stiffness
/// becomes f+ = f- over three knots at the reach of z; two other starts have friction that bends over a share of the
/// motion, then slides, by least squares. From each all parameters descend by Gauss-Newton steps with the
/// derivatives of the integration, exact but for the moment of turning, and the knots are set anew until they cover
/// all of z. Then come five knots, and nine, each from where the last ended, as long as that pays. Each model is
/// fitted to the first 70 % of the samples (of a period, if the record has several: they are averaged) and judged by
/// the last 30 %, which it simulates freely; more knots must be better there by two standard deviations. The chosen
/// one is fitted to all.
///
/// # Errors
/// [`Error::Record`] for signals of unequal length, without variation or with numbers that are not finite;
/// [`Error::Core`] for an option outside its domain, and for a position that no spring brings back;
/// [`Error::TooFewSamples`] for fewer fitted samples than twice the parameters of the smallest model.
///
/// ```
/// use hysteresis_control::oscillator::{Hold, HystereticOscillator};
/// use hysteresis_core::{Duhem, MAX_KNOTS};
/// use hysteresis_identify::{OscillatorOptions, identify_oscillator};
/// let plant = HystereticOscillator::new(0.5, 5.0, 2.5e4, Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)?)?;
/// let u: Vec<f64> = (0..1500).map(f64::from).map(|k| 40.0 * ((0.01 * k).sin() + (2e-4 * k * k).sin())).collect();
/// let y = plant.response(&u, 1e-3, Hold::Zero, None)?;
/// let options = OscillatorOptions { knots: Some(3), hold: Some(Hold::Zero), ..OscillatorOptions::default() };
/// let found = identify_oscillator(&u, &y, 1e-3, &options)?;
/// assert!(found.rms < 2e-3 * found.linear_rms);
/// # Ok::<(), hysteresis_identify::Error>(())
/// ```
pub fn identify_oscillator(
    u: &[f64],
    y: &[f64],
    dt: f64,
    options: &OscillatorOptions,
) -> Result<OscillatorIdentification, Error> {
    if let Some(got) = options.knots.filter(|knots| !KNOTS.contains(knots)) {
        return Err(Error::whole("knots", "3, 5 or 9", got));
    }
    let data = Data::new(u, y, dt, options.periods, options.skip)?;
    let expected = fewest_samples(options.knots.unwrap_or(KNOTS[0]));
    let got = data.samples(Part::Fitted).count();
    if got < expected {
        return Err(Error::TooFewSamples { expected, got });
    }
    let holds: &[Hold] = match &options.hold {
        Some(hold) => std::slice::from_ref(hold),
        None => &[Hold::Zero, Hold::BandLimited],
    };
    let (mut searches, mut first_error) = (Vec::new(), None);
    for hold in holds {
        match Search::new(&data, *hold) {
            Ok(search) => searches.push(search),
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    // The same model over another drive: what it misses of the fitted samples decides.
    searches.sort_by(|p, q| p.first.at.squares.total_cmp(&q.first.at.squares));
    match (searches.into_iter().next(), first_error) {
        (Some(best), _) => best.finish(options),
        (None, error) => Err(error.unwrap_or_else(|| unstable(dt))),
    }
}

/// The motion of a model left all bounds.
fn unstable(dt: f64) -> Error {
    let expected =
        "an interval in which the motion of the model stays finite, and y to be that of an oscillator that u drives";
    Error::domain("dt", None, expected, dt)
}

/// A linear oscillator, and the fits with ever more knots.
struct Search<'a> {
    excitation: Excitation<'a>,
    hold: Hold,
    sub_steps: usize,
    linear: Fit,
    /// With three knots, where they were put at first.
    first: Fit,
    passes: usize,
}

impl<'a> Search<'a> {
    /// As far as three knots.
    fn new(data: &'a Data, hold: Hold) -> Result<Self, Error> {
        let unstable = || unstable(data.dt);
        let coarse = Excitation::new(data, &data.u, hold, 4);
        let start = best_linear(&coarse).ok_or_else(unstable)?;
        // The model that is found may be half as stiff again.
        let sub_steps = usual_sub_steps(start.parameters[1], 1.5 * start.parameters[2], data.dt);
        let excitation = Excitation::new(data, &data.u, hold, sub_steps);
        let linear = descend(&excitation, &start, start.parameters[2], Part::Fitted).ok_or_else(unstable)?;
        let stiffness = linear.point.parameters[2];
        if stiffness < (SLOWEST * TAU / data.seconds()).powi(2) {
            let expected = "a position that a spring brings back, twice within the record at least: the best linear oscillator takes longer \
                            (stiffness in 1/s^2)";
            return Err(Error::domain("y", None, expected, stiffness));
        }
        let mut starts = friction::starts(data, &linear.point, hold, sub_steps).ok_or_else(unstable)?;
        starts.push(placed_evenly(&linear.point, data));
        let descended = |start: Point| {
            let start = placed(&start, excitation.range(&start)?, KNOTS[0])?;
            descend(&excitation, &start, stiffness, Part::Fitted)
        };
        let found: Vec<Fit> = starts.into_iter().filter_map(descended).collect();
        let passes = linear.passes + found.iter().map(|fit| fit.passes).sum::<usize>();
        // Enough to tell one hold from another.
        let first = found.into_iter().min_by(|one, other| one.at.squares.total_cmp(&other.at.squares));
        let first = first.ok_or_else(unstable)?;
        Ok(Self { excitation, hold, sub_steps, linear, first, passes })
    }

    /// What a fit misses of the samples held out.
    fn held_out(&self, fit: &Fit) -> Option<Vec<f64>> {
        self.excitation.residual(&fit.point, Part::HeldOut)
    }

    fn stiffness(&self) -> f64 {
        self.linear.point.parameters[2]
    }

    /// Descends with so many knots, which are set anew until they cover what z does.
    fn settled(&mut self, start: Point, knots: usize, part: Part) -> Result<Fit, Error> {
        let dt = self.excitation.data.dt;
        let mut point = start;
        let mut best: Option<Fit> = None;
        for _ in 0..PLACEMENTS {
            let range = self.excitation.range(&point).ok_or_else(|| unstable(dt))?;
            point = placed(&point, range, knots).ok_or_else(|| unstable(dt))?;
            let fit = descend(&self.excitation, &point, self.stiffness(), part).ok_or_else(|| unstable(dt))?;
            self.passes += fit.passes;
            let covered = covers(&fit.point.knots, fit.at.range);
            point = fit.point.clone();
            let better = best.as_ref().is_none_or(|best| fit.at.squares < best.at.squares);
            if better || covered {
                best = Some(fit);
            }
            if covered {
                break;
            }
        }
        let best = best.ok_or_else(|| unstable(dt))?;
        Ok(self.sliding(best, part))
    }

    /// Searches the force at which friction slides: f falls to nothing at the end of the knots then, which no derivative
    /// moves.
    fn sliding(&mut self, mut best: Fit, part: Part) -> Fit {
        let mut step = FORCE_STEPS.0;
        for _ in 0..FORCES {
            if step < FORCE_STEPS.1 || slides(&best.point) == (false, false) {
                break;
            }
            let enough = (1.0 - 1.0 / as_f64(best.at.residual.len())) * best.at.squares;
            let scaled = |factor: f64| {
                let knots = best.point.knots.iter().map(|z| factor * z).collect();
                descend(&self.excitation, &Point { knots, ..best.point.clone() }, self.stiffness(), part)
            };
            let found: Vec<Fit> = [1.0 - step, 1.0 + step].into_iter().filter_map(scaled).collect();
            self.passes += found.iter().map(|fit| fit.passes).sum::<usize>();
            match found.into_iter().find(|fit| fit.at.squares < enough) {
                Some(better) => best = better,
                None => step *= 0.5,
            }
        }
        best
    }

    /// Tries more knots as long as that pays, or goes as far as what was asked for; chooses; and fits all samples.
    fn finish(mut self, options: &OscillatorOptions) -> Result<OscillatorIdentification, Error> {
        let dt = self.excitation.data.dt;
        let unstable = || unstable(dt);
        let most = options.knots.unwrap_or(KNOTS[KNOTS.len() - 1]);
        let samples = self.excitation.data.samples(Part::Fitted).count();
        let mut fits = vec![self.linear.clone()];
        let mut held_out = vec![self.held_out(&self.linear).ok_or_else(unstable)?];
        let mut start = self.first.point.clone();
        for knots in KNOTS.into_iter().filter(|knots| *knots <= most && samples >= fewest_samples(*knots)) {
            let fit = self.settled(start, knots, Part::Fitted)?;
            start = fit.point.clone();
            held_out.push(self.held_out(&fit).ok_or_else(unstable)?);
            fits.push(fit);
            if options.knots.is_none() && chosen(&held_out) + 1 < fits.len() {
                break;
            }
        }
        let row = |(fit, held_out): (&Fit, &Vec<f64>)| OscillatorTrial {
            knots: fit.point.knots.len(),
            parameters: fit.at.jacobian.ncols(),
            fitted_rms: rms(&fit.at.residual),
            held_out_rms: rms(held_out),
        };
        let tried = fits.iter().zip(&held_out).map(row).collect();
        // Hysteresis is what was asked for: the linear oscillator is a row to compare with.
        let chosen = if options.knots.is_some() { fits.len() - 1 } else { chosen(&held_out).max(1) };
        let start = fits[chosen].point.clone();
        let knots = start.knots.len();
        let last = self.settled(start, knots, Part::All)?;
        let linear = descend(&self.excitation, &self.linear.point, self.stiffness(), Part::All).ok_or_else(unstable)?;
        self.passes += linear.passes;
        self.result(&last, &linear, tried, chosen)
    }

    fn result(
        &self,
        last: &Fit,
        linear: &Fit,
        tried: Vec<OscillatorTrial>,
        chosen: usize,
    ) -> Result<OscillatorIdentification, Error> {
        let (point, data) = (&last.point, self.excitation.data);
        let hysteresis = Duhem::<MAX_KNOTS>::new(&point.knots, point.rising(), point.falling())?;
        let [gain, damping, stiffness] = [0, 1, 2].map(|i| point.parameters[i]);
        let (low, high) = bounds(&data.y);
        Ok(OscillatorIdentification {
            model: HystereticOscillator::new(gain, damping, stiffness, hysteresis)?,
            output_offset: point.offset,
            dt: data.dt,
            hold: self.hold.name().to_owned(),
            sub_steps: self.sub_steps,
            periods: data.periods,
            rms: rms(&last.at.residual),
            linear_rms: rms(&linear.at.residual),
            held_out_rms: tried[chosen].held_out_rms,
            noise: data.noise,
            covered: point.knots[0] <= last.at.range.0 && last.at.range.1 <= point.knots[point.knots.len() - 1],
            standard_errors: standard_errors(last),
            warnings: findings(&last.at.residual, high - low, &tried, chosen),
            tried,
            evaluations: self.passes,
        })
    }
}

/// Twice the number of parameters.
fn fewest_samples(knots: usize) -> usize {
    2 * (3 + 2 * knots + 1)
}

/// The linear oscillator with half of its stiffness as an operator without hysteresis.
fn placed_evenly(linear: &Point, data: &Data) -> Point {
    let half = 0.5 * linear.parameters[2];
    let reach = data.y.iter().fold(0.0, |reach: f64, y| reach.max((y - linear.offset).abs()));
    let parameters = [&[linear.parameters[0], linear.parameters[1], half][..], &[half; 6]].concat();
    Point { knots: vec![-half * reach, 0.0, half * reach], parameters, offset: linear.offset }
}

/// The same f over `count` knots that cover a range of z: one at 0, where Bouc-Wen hysteresis bends, and as many on
/// each side; none where there is no operator of these numbers.
fn placed(point: &Point, range: (f64, f64), count: usize) -> Option<Point> {
    let width = range.1 - range.0;
    // Where friction slides z goes no further than to the knot there.
    let end = |sign: f64, reach: f64, knot: f64, slides: bool| {
        if slides && within(reach, knot) { knot } else { sign * (sign * reach + MARGIN * width).max(MARGIN * width) }
    };
    let (slides_low, slides_high) = slides(point);
    let low = end(-1.0, range.0, point.knots[0], slides_low);
    let high = end(1.0, range.1, point.knots[point.knots.len() - 1], slides_high);
    let side = count / 2;
    let share = |i: usize| as_f64(i) / as_f64(side);
    let below = (0..side).map(|i| low * (1.0 - share(i)));
    let knots: Vec<f64> = below.chain((0..=side).map(|i| high * share(i))).collect();
    let before = Duhem::<MAX_KNOTS>::new(&point.knots, point.rising(), point.falling()).ok()?;
    let slopes = |rising: bool| knots.iter().map(|z| before.slope(*z, rising)).collect::<Vec<_>>();
    let parameters = [&point.parameters[..3], &slopes(true), &slopes(false)].concat();
    Some(Point { parameters, offset: point.offset, knots })
}

/// Whether the knots reach as far as z does, and not much further.
fn covers(knots: &[f64], (low, high): (f64, f64)) -> bool {
    let (first, last) = (knots[0], knots[knots.len() - 1]);
    let width = high - low;
    // A side on which z hardly goes has a knot at the margin.
    let small = |reach: f64| reach <= MARGIN * width;
    (within(low, first) || small(-low)) && (within(high, last) || small(high))
}

/// Whether z comes near a knot at the end, on its side of 0, and not beyond it.
fn within(reach: f64, outer: f64) -> bool {
    (MOVED.1..=MOVED.0).contains(&(reach / outer))
}

/// Whether f has fallen to nothing at the lowest and at the highest knot, where z would leave them.
fn slides(point: &Point) -> (bool, bool) {
    let (rising, falling) = (point.rising(), point.falling());
    let most = rising.iter().chain(falling).fold(0.0, |most: f64, f| most.max(*f));
    let falls = |f: Option<&f64>| f.is_some_and(|f| *f < SLIDES * most);
    (falls(falling.first()), falls(rising.last()))
}

/// The scan for the best linear oscillator: frequencies from two periods in the record to the highest that the
/// interval resolves.
fn best_linear(excitation: &Excitation<'_>) -> Option<Point> {
    const FREQUENCIES: usize = 48;
    let data = excitation.data;
    let (low, high) = (SLOWEST * TAU / data.seconds(), 2.5 / data.dt);
    let mean = mean(&data.y);
    let mut best: Option<(f64, Point)> = None;
    for i in 0..FREQUENCIES {
        let frequency = low * (high / low).powf(as_f64(i) / as_f64(FREQUENCIES - 1));
        for ratio in [0.03, 0.15, 0.6] {
            let parameters = vec![1.0, 2.0 * ratio * frequency, frequency * frequency];
            let mut point = Point { knots: Vec::new(), parameters, offset: mean };
            let Some(response) = excitation.response(&point) else { continue };
            let pairs = || data.samples(Part::Fitted).map(|k| (response[k], data.y[k] - mean));
            let (squares, product): (f64, f64) = pairs().fold((0.0, 0.0), |(s, p), (r, y)| (s + r * r, p + r * y));
            let gain = product / squares;
            let missed: f64 = pairs().map(|(r, y)| (y - gain * r).powi(2)).sum();
            if missed.is_finite() && best.as_ref().is_none_or(|(least, _)| missed < *least) {
                point.parameters[0] = gain;
                best = Some((missed, point));
            }
        }
    }
    best.map(|(_, point)| point)
}

/// The place of the smallest model that no larger one beats by more than chance.
fn chosen(held_out: &[Vec<f64>]) -> usize {
    let mut best = 0;
    let samples = held_out.first().map_or(0, Vec::len);
    let block = BLOCK.min((samples / BLOCKS.1).max(1));
    if samples.div_ceil(block) < BLOCKS.0 {
        return best;
    }
    for (larger, errors) in held_out.iter().enumerate().skip(1) {
        let gains: Vec<f64> = held_out[best]
            .chunks(block)
            .zip(errors.chunks(block))
            .map(|(p, q)| p.iter().zip(q).map(|(p, q)| p * p - q * q).sum())
            .collect();
        let count = as_f64(gains.len());
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        if mean > SIGNIFICANT * (variance / count).sqrt() {
            best = larger;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_held_out_samples_tell_as_well_as_many() {
        for samples in [4, 12, 100, 1000] {
            let errors = |size: f64| (0..samples).map(|k| size * (1.0 + 0.1 * as_f64(k % 3))).collect::<Vec<_>>();
            assert_eq!(chosen(&[errors(1.0), errors(0.5)]), 1, "{samples}");
            assert_eq!(chosen(&[errors(1.0), errors(1.1)]), 0, "{samples}");
        }
        assert_eq!(chosen(&[vec![1.0; 3], vec![0.5; 3]]), 0);
        // One block of eight is better, and by much.
        let lucky = |k: usize| if k < 10 { 0.0 } else { 1.001 };
        assert_eq!(chosen(&[vec![1.0; 80], (0..80).map(lucky).collect()]), 0);
    }
}
