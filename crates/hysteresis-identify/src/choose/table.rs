//! The table of the terms that are judged by stretches of the records: a term is a type here and a row of the table.

use crate::choose::dynamics::starts;
use crate::choose::found::{LinearEvidence, Place};
use crate::choose::linear_part::{amplifier_starts, to_compare};
use crate::choose::must_gain::{MUST_GAIN_OF_LIKE_LOOPS, OfLikeLoops};
use crate::choose::term_search::{Candidate, PASSES, Row, Term, TermSearch, Variant};
use crate::choose::trial::{COUPLED_PLAYS, TermTrial, TrialOutcome};
use crate::error::Error;
use crate::fit::descent::{best_attempt, best_points};
use crate::fit::point::Parameter;
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::rough;
use crate::fit::space::Space;
use crate::options::Options;
use crate::records::record::Record;
use crate::terms::creep::CreepModel;
use crate::terms::duhem::DuhemModel;
use crate::terms::dynamics::{DynamicsModel, Order};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::maps::MapModel;
use crate::terms::operators::ModelKind;
use crate::terms::relaxing_plays::RelaxingPlaysModel;
use crate::terms::slow_gain::SlowGainModel;

/// What a term must gain where all loops are alike: a map less where the fit is poor.
const CURVE: OfLikeLoops = OfLikeLoops { usual_left: 0.005, gain_of_poor: 1.5 };
const OTHER: OfLikeLoops = OfLikeLoops { usual_left: 0.005, gain_of_poor: MUST_GAIN_OF_LIKE_LOOPS };
const COUPLING: OfLikeLoops = OfLikeLoops { usual_left: 0.0, gain_of_poor: MUST_GAIN_OF_LIKE_LOOPS };

/// The terms. What makes a stage harder to read must gain a tenth of the error: more unknowns cost something.
pub(crate) const TABLE: [Row; 10] = [
    Row { terms: 1, is_costly: false, of_like_loops: CURVE, term: &Curves { in_front: true, behind: false } },
    Row { terms: 1, is_costly: false, of_like_loops: CURVE, term: &Curves { in_front: false, behind: true } },
    Row { terms: 1, is_costly: false, of_like_loops: COUPLING, term: &CoupledPlays },
    Row { terms: 1, is_costly: false, of_like_loops: OTHER, term: &CreepOfEveryDecade },
    Row { terms: 1, is_costly: false, of_like_loops: OTHER, term: &SlowGainOfUsualTime },
    Row { terms: 0, is_costly: false, of_like_loops: OTHER, term: &NoDynamics },
    Row { terms: 2, is_costly: true, of_like_loops: CURVE, term: &Curves { in_front: true, behind: true } },
    Row { terms: 1, is_costly: true, of_like_loops: OTHER, term: &LagInFront },
    Row { terms: 1, is_costly: true, of_like_loops: OTHER, term: &RelaxingPlays },
    Row { terms: 1, is_costly: true, of_like_loops: OTHER, term: &DynamicsBehindMap },
];

/// The terms that are open in what was asked for and closed in what that was
/// [`resolved`](Options::resolved) to.
pub(crate) fn closed_terms(
    asked: &Options,
    resolved: &Options,
    records: &[Record<'_>],
) -> Result<Vec<TermTrial>, Error> {
    let is_modified = asked.model == ModelKind::Modified;
    let outcome =
        if is_modified && asked.has_enough(records)? { TrialOutcome::CannotBeTold } else { TrialOutcome::NotOpen };
    let is_closed = |row: &&Row| row.term.is_open(asked, asked) && !row.term.is_open(resolved, resolved);
    // What stands for two terms, or takes the place of what the search begins with, is told by these.
    let rows = TABLE.iter().filter(|row| row.terms == 1 && row.term.is_more()).filter(is_closed);
    let beside_the_table = [
        ("dynamics", asked.dynamics == DynamicsModel::Auto && resolved.dynamics != DynamicsModel::Auto),
        ("creep", asked.creep == CreepModel::Auto && resolved.creep != CreepModel::Auto),
        ("loop shift", asked.loop_shift == LoopShiftModel::Auto && resolved.loop_shift != LoopShiftModel::Auto),
    ];
    let closed = beside_the_table.into_iter().filter(|(_, is_closed)| *is_closed).map(|(name, _)| name);
    Ok(closed.chain(rows.map(|row| row.term.name())).map(|name| TermTrial::not_tried(name, outcome)).collect())
}

/// Whether a parameter lies within the bounds of its search, if it is searched.
fn is_inside(one: &Candidate, parameter: Parameter) -> bool {
    let Place { space, point } = &one.place;
    space.axis(parameter).is_none_or(|axis| axis.is_inside(point))
}

/// Creep with an amplitude for every decade, in place of the two that the linear part has: creep by a power of time.
struct CreepOfEveryDecade;

impl Term for CreepOfEveryDecade {
    fn name(&self) -> &'static str {
        "creep of every decade"
    }

    fn is_open(&self, asked: &Options, options: &Options) -> bool {
        asked.creep == CreepModel::Auto && options.creep == CreepModel::SlowAndFast
    }

    fn is_in(&self, one: &Candidate) -> bool {
        one.options.creep == CreepModel::EveryDecade
    }

    /// At its bound it stands for a transient, or for hysteresis of another kind.
    fn stands_for_itself(&self, one: &Candidate) -> bool {
        let Place { space, point } = &one.place;
        let is_below_its_bound =
            |number| space.axis(Parameter::Creep(number)).is_none_or(|axis| !axis.is_at_upper(point));
        !self.is_in(one) || (0..space.creep_amplitudes()).all(is_below_its_bound)
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        _: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let Place { space, point } = &from.place;
        if !self.is_open(search.asked, &from.options) || space.creep_amplitudes() == 0 {
            return Ok(Vec::new());
        }
        let creep = CreepModel::EveryDecade;
        let Some((space, point)) = to_compare(space.with_creep(&creep, point))? else { return Ok(Vec::new()) };
        let options = Options { creep, ..from.options.clone() };
        Ok(vec![Variant { options, ..from.with(space, vec![point]) }])
    }
}

/// Coupled plays in place of plays.
struct CoupledPlays;

/// From so many ratios and input offsets, those that fit best as they are, the search for coupled plays begins.
const STARTS_OF_COUPLED_PLAYS: usize = 6;

impl Term for CoupledPlays {
    fn name(&self) -> &'static str {
        COUPLED_PLAYS
    }

    fn is_open(&self, _: &Options, options: &Options) -> bool {
        options.chooses_coupling()
    }

    fn is_in(&self, one: &Candidate) -> bool {
        !one.options.has_plays()
    }

    /// With them everything is sought anew.
    fn is_more(&self) -> bool {
        false
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let Place { space, point } = &from.place;
        // An operator beside the plays does what they would.
        if !self.is_open(search.asked, &from.options) || matches!(from.options.duhem, DuhemModel::Near(_)) {
            return Ok(Vec::new());
        }
        let options = from.options.with_coupled_plays();
        let space = space.with_coupled_plays(search.records, &options, point, &from.fit.weights);
        let basis = options.weight_basis(space.sides());
        let Some(projection) = to_compare(rough(search.records, &space, &basis, search.smoothness))? else {
            return Ok(Vec::new());
        };
        let starts = [space.with_other_ratios(point), space.starts_at(point)].concat();
        monitor.hold();
        let starts = best_points(&projection, &starts, STARTS_OF_COUPLED_PLAYS, Span { from: 0.0, to: 0.0 }, monitor)?;
        drop(projection);
        Ok(vec![Variant { options, ..from.with(space, starts) }])
    }
}

/// A slow gain of the usual time constant.
struct SlowGainOfUsualTime;

impl Term for SlowGainOfUsualTime {
    fn name(&self) -> &'static str {
        "slow gain"
    }

    fn is_open(&self, asked: &Options, _: &Options) -> bool {
        asked.slow_gain == SlowGainModel::Auto
    }

    fn is_in(&self, one: &Candidate) -> bool {
        one.place.space.has_slow_gain()
    }

    fn stands_for_itself(&self, one: &Candidate) -> bool {
        is_inside(one, Parameter::SlowGain)
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        _: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let Place { space, point } = &from.place;
        let is_open = self.is_open(search.asked, &from.options) && !self.is_in(from);
        let usual = SlowGainModel::usual(space.intervals().longest_record()).filter(|_| is_open);
        let Some(slow_gain) = usual else { return Ok(Vec::new()) };
        let (space, point) = space.with_slow_gain(slow_gain, point)?;
        let options = Options { slow_gain, ..from.options.clone() };
        Ok(vec![Variant { options, ..from.with(space, vec![point]) }])
    }
}

/// Plays that relax, beside those that do not, and in place of creep that nobody asked for: with a threshold of 0 they
/// are creep.
struct RelaxingPlays;

impl Term for RelaxingPlays {
    fn name(&self) -> &'static str {
        "relaxing plays"
    }

    fn is_open(&self, asked: &Options, _: &Options) -> bool {
        asked.relaxing_plays == RelaxingPlaysModel::Auto
    }

    fn is_in(&self, one: &Candidate) -> bool {
        one.place.space.relaxing().is_some()
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        _: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        if !self.is_open(search.asked, &from.options) || self.is_in(from) {
            return Ok(Vec::new());
        }
        let Place { space, point } = &from.place;
        let mut options = Options { relaxing_plays: RelaxingPlaysModel::Fit, ..from.options.clone() };
        let (mut space, mut start) = (space.with_relaxing_plays(&options.relaxing_plays)?, *point);
        if search.asked.creep == CreepModel::Auto {
            options.creep = CreepModel::UnderWay;
            (space, start) = space.with_creep(&options.creep, &start)?;
        }
        Ok(vec![Variant { options, ..from.with(space, vec![start]) }])
    }
}

/// A map of the drive in front of the hysteresis, one of the position behind it, or both at once: loops that bend at
/// both ends, as those of relays do, are told by neither alone.
struct Curves {
    in_front: bool,
    behind: bool,
}

impl Term for Curves {
    fn name(&self) -> &'static str {
        match (self.in_front, self.behind) {
            (true, false) => "input map",
            (true, true) => "both maps",
            _ => "output map",
        }
    }

    fn is_open(&self, asked: &Options, _: &Options) -> bool {
        (!self.in_front || asked.input_map == MapModel::Auto) && (!self.behind || asked.output_map == MapModel::Auto)
    }

    fn is_in(&self, one: &Candidate) -> bool {
        let space = &one.place.space;
        (!self.in_front || space.has_input_map()) && (!self.behind || space.has_output_map())
    }

    /// One map.
    fn left_out(&self, asked: &Options, from: &Candidate) -> Option<Variant> {
        let Place { space, point } = &from.place;
        let is_there = self.in_front != self.behind && self.is_open(asked, &from.options) && self.is_in(from);
        let without = if self.in_front { space.without_input_map() } else { space.without_output_map() };
        is_there.then(|| from.with(without, vec![*point]))
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        _: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let space = &from.place.space;
        let is_there = self.in_front && space.has_input_map() || self.behind && space.has_output_map();
        if !self.is_open(search.asked, &from.options) || is_there {
            return Ok(Vec::new());
        }
        let mut with = space.clone();
        if self.behind {
            with = with.with_output_map(search.output_range(space, &from.fit));
        }
        if self.in_front {
            with = with.with_input_map();
        }
        Ok(vec![from.with_curve(with)])
    }
}

/// A dead time in place of dynamics, or of a lag in front: beside the hysteresis, and beside that which was fitted
/// alone.
struct NoDynamics;

impl Term for NoDynamics {
    fn name(&self) -> &'static str {
        "no dynamics"
    }

    /// Those of the linear part stay where nothing else is open.
    fn is_open(&self, _: &Options, _: &Options) -> bool {
        false
    }

    fn is_in(&self, one: &Candidate) -> bool {
        one.place.space.order().is_none() && !one.place.space.has_amplifier()
    }

    fn is_more(&self) -> bool {
        false
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        _: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let Place { space, point } = &from.place;
        if search.asked.dynamics != DynamicsModel::Auto || self.is_in(from) {
            return Ok(Vec::new());
        }
        let (options, without) = search.without_dynamics(from)?;
        let within = |lag| without.nearest(Parameter::DeadTime, lag);
        let here = point.with(Parameter::DeadTime, within(space.linear_part(point).lag()));
        let alone = Parameter::of_hysteresis().fold(here, |point, one| point.with(one, search.plain.get(one)));
        let alone = alone.with(Parameter::DeadTime, within(search.plain.get(Parameter::DeadTime)));
        let linear = Some(LinearEvidence::default());
        Ok(vec![Variant { options, linear, adds: false, ..from.with(without, vec![here, alone]) }])
    }
}

/// A lag in front of the hysteresis, in place of dynamics and of a part of the dead time: that of an amplifier, or of
/// heat.
struct LagInFront;

impl Term for LagInFront {
    fn name(&self) -> &'static str {
        "lag in front"
    }

    fn is_open(&self, asked: &Options, _: &Options) -> bool {
        asked.leaves_lag_open()
    }

    fn is_in(&self, one: &Candidate) -> bool {
        one.place.space.has_amplifier() && one.place.space.order().is_none()
    }

    /// Beside modes an amplifier that is fast without bound is none.
    fn stands_for_itself(&self, one: &Candidate) -> bool {
        one.place.space.order().is_some() || is_inside(one, Parameter::LogBandwidth)
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        _: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let Place { space, point } = &from.place;
        if !self.is_open(search.asked, &from.options) || self.is_in(from) {
            return Ok(Vec::new());
        }
        let (options, without) = search.without_dynamics(from)?;
        let with = without.with_amplifier();
        // A position that leads the drive has no lag in front.
        let starts = amplifier_starts(&with, point, space.linear_part(point).lag());
        if starts.is_empty() {
            return Ok(Vec::new());
        }
        let (adds, linear) = (space.order().is_none(), Some(LinearEvidence::default()));
        Ok(vec![Variant { options, linear, adds, was_sought: false, ..from.with(with, starts) }])
    }
}

/// Dynamics sought again behind a map: the curve that was not in the model had hidden them, or a lag.
struct DynamicsBehindMap;

impl Term for DynamicsBehindMap {
    fn name(&self) -> &'static str {
        "dynamics behind the map"
    }

    /// Where no map is open there is none to seek them behind.
    fn is_open(&self, _: &Options, _: &Options) -> bool {
        false
    }

    fn is_in(&self, one: &Candidate) -> bool {
        one.was_sought
    }

    fn is_more(&self) -> bool {
        false
    }

    /// At an edge, or overdamped, a resonance stands for a lag or a dead time, which are tried, too.
    fn stands_for_itself(&self, one: &Candidate) -> bool {
        let Place { space, point } = &one.place;
        let is_resonance = point.get(Parameter::LogDamping) < 0.0;
        (is_resonance || !self.is_in(one) || space.order() != Some(Order::Second))
            && [Parameter::LogFrequency, Parameter::LogDamping].into_iter().all(|parameter| is_inside(one, parameter))
    }

    fn variants(
        &self,
        search: &TermSearch<'_>,
        from: &Candidate,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Vec<Variant>, Error> {
        let Place { space, point } = &from.place;
        // Those that were asked for may have been told too little without the map.
        let orders = match search.asked.dynamics {
            DynamicsModel::Auto => vec![Order::First, Order::Second],
            DynamicsModel::Order(order) if from.has_too_little() && !search.asked.modes.asks_for_dynamics() => {
                vec![order]
            }
            _ => Vec::new(),
        };
        if orders.is_empty() || !space.has_map() || self.is_in(from) {
            return Ok(Vec::new());
        }
        monitor.hold();
        let alone = from.options.hysteresis_alone();
        let plain_space = Space::new(search.records, &alone)?.with_maps_of(space);
        let basis = alone.weight_basis(plain_space.sides());
        let lag = plain_space.nearest(Parameter::DeadTime, space.linear_part(point).lag());
        let projection = rough(search.records, &plain_space, &basis, search.smoothness)?;
        let start = point.with(Parameter::DeadTime, lag);
        let plain = best_attempt(&projection, &[start], PASSES, Span { from: 0.0, to: 0.0 }, monitor)?;
        drop(projection);
        let plain_space = plain_space.about(&plain.weights);
        let of_order = |order| {
            let options = Options { dynamics: DynamicsModel::Order(order), ..from.options.clone() };
            let space = Space::new(search.records, &options)?.with_maps_of(&plain_space).without_lead();
            let starts = starts(search.records, &plain, &plain_space, &space, monitor)?;
            let linear = Some(LinearEvidence::default());
            Ok(Variant { options, linear, adds: false, was_sought: true, ..from.with(space, starts) })
        };
        orders.into_iter().map(of_order).collect()
    }
}
