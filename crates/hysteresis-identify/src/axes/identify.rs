//! The way from records to a stage of several axes: linear at first, then with operators, coarse and fine.

use super::bank::{Bank, Kind};
use super::candidate::{AxesHysteresis, AxesPlace, Candidate};
use super::data::{AxesRecord, Data, Stretch};
use super::descent::{descend, errors};
use super::pass::{missed, reaches};
use super::point::{Free, Point};
use super::result::{AxesIdentification, AxesTrial, findings};
use super::subspace::{Observability, fewest_samples};
use super::uncertainty::{modes, standard_errors};
use crate::error::Error;
use crate::records::signal::as_f64;

/// How a stage of several axes is identified. By default everything is found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxesOptions {
    /// The number of states. None takes what held-out samples ask for.
    pub order: Option<usize>,
    /// The kind of hysteresis. None takes what held-out samples ask for.
    pub hysteresis: Option<AxesHysteresis>,
    /// Where it stands. None takes what held-out samples ask for.
    pub place: Option<AxesPlace>,
    /// Leading samples of each record that are simulated but not fitted.
    pub skip: usize,
}

/// The orders that are tried.
const ORDERS: [usize; 14] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 28, 36];

/// More states, and other structures, must lower the error of held-out samples to this share.
const BETTER: f64 = 0.98;

/// What misses less, in standard deviations, is exact but for rounding: operators would be fitted to that.
const EXACT: f64 = 1e-9;

/// Hysteresis is looked for at all orders at which a linear model misses at most so many times what the best one does.
const SIMILAR: f64 = 1.4;

/// What misses more than so many times what the best structure does is not refined.
const HOPELESS: f64 = 2.0;

/// Steps of a descent: of numbers that enter linearly, in front of the dynamics, inside them, and to the end.
const LINEAR_STEPS: usize = 4;
const COARSE_STEPS: usize = 15;
const INSIDE_STEPS: usize = 30;
const FINE_STEPS: usize = 40;

/// Thresholds or knots at first, and ever more.
fn sizes(kind: Kind) -> [usize; 3] {
    if kind == Kind::Duhem { [3, 5, 9] } else { [4, 8, 16] }
}

/// How far beyond what was reached the knots of a Duhem operator lie. Thresholds lie within it: what hardly moves a
/// play tells no weight.
const MARGIN: f64 = 1.05;

fn margin(kind: Kind) -> f64 {
    if kind == Kind::Duhem { MARGIN } else { 1.0 }
}

/// How far beyond the reach of q knots lie at first, inside: z goes further than q where f grows.
const Z_BEYOND_Q: f64 = 2.0;

/// Identifies x+ = A x + B u + Bw w, q = Cq x + Dq u, w = H\[q\], y = C x + D u + offset from records of m drives and
/// p positions that begin at rest.
///
/// It begins at linear models: a subspace method for A and C, least squares for the rest, the order by
/// held-out samples, and Gauss-Newton (Levenberg-Marquardt) steps for all numbers. Then every drive gets an operator,
/// plays or a Duhem operator, in front of the dynamics, which may see the states next. Inside the dynamics it also
/// begins with an operator of each position, at every order at which a linear model is nearly as good as the best, and
/// with operators of what each mode gives to the positions, at the smallest of these orders. All numbers descend by
/// forward tangents. Each structure is fitted to a part of the records and judged by a free simulation of the others
/// (the last 30 % of several records, or of the samples of one). The best of each kind in front and inside get ever
/// finer operators, as long as that pays; the best of them is fitted to all.
///
/// # Errors
/// [`Error::Record`] for signals of a wrong length or with numbers that are not finite; [`Error::Core`] for an option
/// outside its domain, a column that does not vary, or records from which no model that runs comes;
/// [`Error::TooFewSamples`].
///
/// ```
/// use hysteresis_identify::{AxesOptions, AxesRecord, identify_axes};
/// // One drive, one position: a lag of one sample.
/// let mut seed = 1_u32;
/// let mut random = || {
///     seed = seed.wrapping_mul(1_664_525).wrapping_add(1);
///     f64::from(seed >> 16)
/// };
/// let u: Vec<f64> = (0..2000).map(|_| random()).collect();
/// let mut y = vec![0.0; 2000];
/// for k in 1..2000 { y[k] = 0.8 * y[k - 1] + 0.1 * u[k - 1]; }
/// let found = identify_axes(&[AxesRecord { u: &u, y: &y }], 1, 1, 1e-3, &AxesOptions::default())?;
/// assert_eq!(found.model.operators().len(), 0);
/// assert!(found.errors[0] < 1e-3 * 8000.0);
/// # Ok::<(), hysteresis_identify::Error>(())
/// ```
pub fn identify_axes(
    records: &[AxesRecord<'_>],
    drives: usize,
    positions: usize,
    dt: f64,
    options: &AxesOptions,
) -> Result<AxesIdentification, Error> {
    if !(dt > 0.0 && hysteresis_core::is_admissible(dt)) {
        return Err(Error::domain("dt", None, "a finite number of seconds above 0", dt));
    }
    let data = Data::new(records, drives, positions, options.skip)?;
    let (fitted, held_out) = data.split();
    let mut search = Search { data: &data, fitted, held_out, tried: Vec::new(), passes: 0 };
    let (linear, near) = search.linear(options.order)?;
    let best = search.with_operators(&linear, &near, options);
    search.finish(&linear, best, dt)
}

struct Search<'a> {
    data: &'a Data,
    fitted: Vec<Stretch>,
    held_out: Vec<Stretch>,
    tried: Vec<AxesTrial>,
    passes: usize,
}

impl Search<'_> {
    /// Descends, judges and notes.
    fn tried(&mut self, start: &Point, free: Free, steps: usize, name: &str) -> Option<Candidate> {
        let fit = descend(start, self.data, &self.fitted, free, steps)?;
        self.passes += fit.passes;
        let errors = errors(&missed(&fit.point, self.data, &self.held_out)?, self.data.positions);
        let held_out = errors.iter().sum::<f64>() / as_f64(errors.len());
        let samples = self.fitted.iter().map(|(_, range)| range.len()).sum::<usize>() * self.data.positions;
        self.tried.push(AxesTrial {
            name: name.to_owned(),
            states: fit.point.states,
            parameters: fit.point.clone().numbers_mut(free).len(),
            fitted: (fit.squares / as_f64(samples)).sqrt(),
            held_out,
            chosen: false,
        });
        let row = self.tried.len() - 1;
        Some(Candidate { fit, hysteresis: AxesHysteresis::None, place: None, held_out, errors, row })
    }

    /// The best linear model, and those of all orders that are nearly as good.
    fn linear(&mut self, order: Option<usize>) -> Result<(Candidate, Vec<Point>), Error> {
        let expected = fewest_samples(self.data.drives, self.data.positions, self.fitted.len());
        let got = self.fitted.iter().map(|(_, range)| range.len()).sum();
        let few = || Error::TooFewSamples { expected, got };
        let seen = Observability::new(self.data, &self.fitted).ok_or_else(few)?;
        let most = seen.most_states();
        if let Some(got) = order.filter(|order| !(1..=most).contains(order)) {
            return Err(Error::whole("order", "a number of states that the records can tell, 1 to 40", got));
        }
        let bare = Free { dynamics: false, query: false };
        let mut best: Option<Candidate> = None;
        let mut all = Vec::new();
        let mut worse = 0;
        let asked = order.map(|order| [order]);
        for order in asked.as_ref().map_or(&ORDERS[..], |order| order).iter().filter(|order| **order <= most) {
            let start = seen.dynamics(*order);
            let found = start.and_then(|start| self.tried(&start, bare, LINEAR_STEPS, "linear, by subspace"));
            let Some(found) = found else { continue };
            all.push(found.clone());
            if best.as_ref().is_none_or(|best| found.held_out < BETTER * best.held_out) {
                (best, worse) = (Some(found), 0);
            } else {
                worse += 1;
            }
            if worse == 3 {
                break;
            }
        }
        let expected = "records from which stable linear dynamics follow";
        let best = best.ok_or_else(|| Error::whole("y", expected, self.data.records.len()))?;
        let limit = SIMILAR * best.held_out;
        let near = all.into_iter().filter(|found| found.held_out <= limit).map(|found| found.fit.point).collect();
        let free = Free { dynamics: true, query: false };
        let descended = self.tried(&best.fit.point, free, COARSE_STEPS, "linear");
        Ok((descended.filter(|found| found.held_out < best.held_out).unwrap_or(best), near))
    }

    /// The best model with operators, as was asked for.
    fn with_operators(&mut self, linear: &Candidate, near: &[Point], options: &AxesOptions) -> Option<Candidate> {
        let kinds: &[(Kind, AxesHysteresis)] = match options.hysteresis {
            None if linear.held_out < EXACT => &[],
            Some(AxesHysteresis::None) => &[],
            Some(AxesHysteresis::Plays) => &[(Kind::Plays, AxesHysteresis::Plays)],
            Some(AxesHysteresis::Duhem) => &[(Kind::Duhem, AxesHysteresis::Duhem)],
            None => &[(Kind::Plays, AxesHysteresis::Plays), (Kind::Duhem, AxesHysteresis::Duhem)],
        };
        let better =
            |held_out: f64, best: Option<&Candidate>| best.is_none_or(|best| held_out < BETTER * best.held_out);
        let mut coarse: Vec<(Kind, Candidate)> = Vec::new();
        for (kind, hysteresis) in kinds {
            let found = self.places(*kind, &linear.fit.point, near, options.place);
            for place in [AxesPlace::InFront, AxesPlace::Inside] {
                let mut start: Option<&Candidate> = None;
                for found in found.iter().filter(|found| found.place == Some(place)) {
                    if better(found.held_out, start) {
                        start = Some(found);
                    }
                }
                coarse.extend(start.map(|start| (*kind, Candidate { hysteresis: *hysteresis, ..start.clone() })));
            }
        }
        // Fine operators of one kind in one place may do what coarse ones do of another kind, or elsewhere.
        let limit = HOPELESS * coarse.iter().map(|(_, found)| found.held_out).fold(f64::INFINITY, f64::min);
        let mut best: Option<Candidate> = None;
        for (kind, start) in coarse.into_iter().filter(|(_, found)| found.held_out <= limit) {
            let found = self.refined(kind, start);
            if better(found.held_out, best.as_ref()) {
                best = Some(found);
            }
        }
        let best = best?;
        // What does as well without memory is told, and is no stage.
        let near: Vec<Point> = near.iter().filter(|point| point.states == best.fit.point.states).cloned().collect();
        self.places(Kind::Curve, &linear.fit.point, &near, best.place);
        Some(best)
    }

    /// In front of the dynamics, and inside them: from there on, and from operators that see the positions.
    fn places(&mut self, kind: Kind, linear: &Point, near: &[Point], place: Option<AxesPlace>) -> Vec<Candidate> {
        let size = sizes(kind)[0];
        let name = |place: &str| match kind {
            Kind::Plays => format!("plays {place}"),
            Kind::Curve => format!("curves without memory {place}"),
            Kind::Duhem => format!("Duhem {place}"),
        };
        let start = linear.with_banks(|drive| Bank::new(kind, size, margin(kind) * self.data.reach(drive)));
        let free = Free { dynamics: true, query: false };
        let front = self.tried(&start, free, COARSE_STEPS, &name("in front"));
        let mut all: Vec<Candidate> =
            front.into_iter().map(|found| Candidate { place: Some(AxesPlace::InFront), ..found }).collect();
        if place != Some(AxesPlace::InFront) {
            let free = Free { dynamics: true, query: true };
            let mut starts: Vec<(Point, &str)> =
                all.iter().map(|front| (front.fit.point.clone(), "inside, of drives")).collect();
            starts.extend(
                near.iter().filter_map(|linear| Some((self.seeing(linear, None, kind)?, "inside, of positions"))),
            );
            if let Some(smallest) = near.first().filter(|linear| linear.states > 2) {
                let blocks = 0..smallest.states.div_ceil(2);
                let of_block = |block| Some((self.seeing(smallest, Some(block), kind)?, "inside, of modes"));
                starts.extend(blocks.filter_map(of_block));
            }
            for (start, of) in starts {
                let found = self.tried(&start, free, INSIDE_STEPS, &name(of));
                all.extend(found.map(|found| Candidate { place: Some(AxesPlace::Inside), ..found }));
            }
        }
        all.retain(|found| place.is_none_or(|place| found.place == Some(place)));
        all
    }

    /// Operators that see positions, or what a block of states gives to them, over what that reaches.
    fn seeing(&self, linear: &Point, block: Option<usize>, kind: Kind) -> Option<Point> {
        let size = sizes(kind)[0];
        let mut start = linear.with_queries(block, |_| Bank::new(Kind::Curve, size, 1.0));
        let reached = reaches(&start, self.data, &self.fitted)?;
        let beyond = if kind == Kind::Duhem { Z_BEYOND_Q } else { 1.0 };
        start.banks = reached.iter().map(|reach| Bank::new(kind, size, beyond * reach)).collect();
        Some(start)
    }

    /// The same number of thresholds or knots over what is reached, then more of them, with steps to the end, if that
    /// pays.
    fn refined(&mut self, kind: Kind, coarse: Candidate) -> Candidate {
        let free = Free { dynamics: true, query: coarse.place == Some(AxesPlace::Inside) };
        let mut best = coarse;
        for size in &sizes(kind) {
            let name = if *size == sizes(kind)[0] { "coarse, placed anew" } else { "fine" };
            let Some(reached) = reaches(&best.fit.point, self.data, &self.fitted) else { break };
            let mut start = best.fit.point.clone();
            for (bank, reach) in start.banks.iter_mut().zip(reached) {
                *bank = bank.refined(*size, margin(kind) * reach);
            }
            if let Some(found) = self.tried(&start, free, FINE_STEPS, name)
                && found.held_out < BETTER * best.held_out
            {
                best = Candidate { hysteresis: best.hysteresis, place: best.place, ..found };
            }
        }
        best
    }

    /// Fits the chosen model to all, and says how good it is.
    fn finish(mut self, linear: &Candidate, best: Option<Candidate>, dt: f64) -> Result<AxesIdentification, Error> {
        let chosen = match best {
            Some(best) if best.held_out < BETTER * linear.held_out => best,
            _ => linear.clone(),
        };
        self.tried[chosen.row].chosen = true;
        let data = self.data;
        let all = data.all();
        let free = Free { dynamics: true, query: chosen.place == Some(AxesPlace::Inside) };
        let last = descend(&chosen.fit.point, data, &all, free, COARSE_STEPS);
        let last = last.unwrap_or_else(|| chosen.fit.clone());
        self.passes += last.passes;
        let unable = || Error::whole("y", "records from which a model follows that can be run", data.records.len());
        let model = last.point.stage(data, dt)?.ok_or_else(unable)?;
        let residuals = missed(&last.point, data, &all).ok_or_else(unable)?;
        let scaled = |errors: &[f64]| errors.iter().zip(&data.position_scale).map(|(e, s)| e * s).collect::<Vec<_>>();
        let relative = errors(&residuals, data.positions);
        let doubts = standard_errors(&last.point, data, (&all, &residuals), free, dt);
        Ok(AxesIdentification {
            model,
            hysteresis: chosen.hysteresis.name().to_owned(),
            place: chosen.place.map_or("none", AxesPlace::name).to_owned(),
            errors: scaled(&relative),
            held_out_errors: scaled(&chosen.errors),
            linear_errors: scaled(&linear.errors),
            deviations: data.position_scale.clone(),
            modes: modes(&last.point, dt),
            standard_errors: doubts,
            warnings: findings(&self.tried, linear, &chosen, &residuals, data),
            tried: self.tried,
            evaluations: self.passes,
        })
    }
}
