//! Random controllers and what may happen to them.

use hysteresis_core::{
    AntiWindup, Biquad, Command, CompiledModel, ControllerOptions, ControllerState, CreepTerms, FeedForward, Forward,
    HybridController, Inverse, Law, LoopShiftTerms, Mode, ModifiedPrandtlIshlinskii, Offsets, Preview, QuasiStatic,
    Ratios, Sections,
};
use proptest::collection::vec;
use proptest::prelude::*;

pub(crate) const DT: f64 = 1e-4;

/// Two actuators of the same operators, volts in and um out, or two banks that are roughly their inverses.
pub(crate) fn compiled(which: usize, inverse: bool) -> CompiledModel {
    let actuators = ([0.0, 60.0, 150.0, 300.0], [[4.3e-3, 6e-4, 5e-4, 4e-4], [5.0e-3, 2e-4, 9e-4, 0.0]]);
    let banks = ([0.0, 0.25, 0.6, 1.4], [[235.0, -25.0, -20.0, -12.0], [200.0, -8.0, -30.0, 0.0]]);
    let (r, weights) = if inverse { banks } else { actuators };
    let ratios = if inverse { Ratios::PAPER_INVERSE } else { Ratios::PAPER };
    CompiledModel::new(
        &ModifiedPrandtlIshlinskii::from_ratios(&weights[which], &r, ratios, Offsets::default()).unwrap(),
    )
}

/// Which feed-forward, and of which actuator.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    None,
    Given,
    Exact(usize),
    Parametric(usize),
    Creeping,
}

impl Source {
    pub(crate) fn make(self, limits: (f64, f64)) -> FeedForward {
        match self {
            Self::None => FeedForward::None,
            Self::Given => FeedForward::Given,
            Self::Exact(which) => Inverse::new(&compiled(which, false), Some(limits)).unwrap().into(),
            Self::Parametric(which) => Forward::new(&compiled(which, true)).into(),
            Self::Creeping => {
                let creep = CreepTerms::new(&[0.02, 0.05], &[0.9, 0.99]).unwrap();
                let shift = LoopShiftTerms::new(0.0, 500.0, [-0.2, 0.1], 0.5, 0.9).unwrap();
                let stage = QuasiStatic::new(&compiled(0, false)).with_creep(creep).with_loop_shift(shift);
                stage.inverse(Some(limits)).unwrap().into()
            }
        }
    }
}

pub(crate) fn source() -> impl Strategy<Value = Source> {
    prop_oneof![
        1 => Just(Source::None),
        1 => Just(Source::Given),
        3 => (0..2_usize).prop_map(Source::Exact),
        2 => (0..2_usize).prop_map(Source::Parametric),
        1 => Just(Source::Creeping),
    ]
}

#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) source: Source,
    /// Coefficients, how many samples references come early, and whether they are smoothed besides.
    pub(crate) window: Option<(Vec<f64>, usize, bool)>,
    pub(crate) options: ControllerOptions,
}

impl Setup {
    pub(crate) fn make(&self) -> HybridController {
        let preview = self.window.as_ref().map(|(c, ahead, is_smoothed)| {
            let plain = Preview::new(c, *ahead).unwrap();
            if *is_smoothed { plain.smoothed(&[0.25, 0.5, 0.25]).unwrap() } else { plain }
        });
        HybridController::new(self.source.make(self.options.limits), preview, &self.options).unwrap()
    }
}

pub(crate) fn gain() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 4 => 0.0..100.0, 1 => Just(1e90)]
}

fn law() -> impl Strategy<Value = (Law, AntiWindup)> {
    let tracking = prop_oneof![Just(None), (1e-5..1.0).prop_map(Some)];
    prop_oneof![
        2 => Just((Law::Positional, AntiWindup::Conditional)),
        2 => tracking.prop_map(|tracking_time| (Law::Positional, AntiWindup::BackCalculation { tracking_time })),
        1 => Just((Law::Incremental, AntiWindup::Conditional)),
    ]
}

fn window() -> impl Strategy<Value = Option<(Vec<f64>, usize, bool)>> {
    let ahead =
        |c: Vec<f64>| (0..c.len(), any::<bool>()).prop_map(move |(ahead, smooth)| Some((c.clone(), ahead, smooth)));
    prop_oneof![1 => Just(None), 1 => vec(-3.0..3.0, 1..6).prop_flat_map(ahead)]
}

/// What a sensor can show: nothing is known, or positions of a few um that move by less than that in a sample.
fn gate() -> impl Strategy<Value = (Option<(f64, f64)>, Option<f64>)> {
    (maybe_pair(), prop_oneof![Just(None), (0.1..5.0).prop_map(Some)])
}

fn maybe_pair() -> impl Strategy<Value = Option<(f64, f64)>> {
    prop_oneof![Just(None), (-5.0..-2.0, 2.0..5.0).prop_map(Some)]
}

/// None to three sections: poles at radius r and angle t, which may ring for hundreds of samples, or two real ones.
pub(crate) fn filters() -> impl Strategy<Value = Sections> {
    let section = (prop::array::uniform3(-2.0..2.0_f64), 0.0..0.999_f64, 0.0..3.1_f64)
        .prop_map(|(b, r, t)| Biquad::new(b, [-2.0 * r * t.cos(), r * r]).unwrap());
    prop_oneof![Just(Sections::default()), vec(section, 1..=3).prop_map(|sections| Sections::new(&sections).unwrap()),]
}

/// A proportional gain that these filters allow: behind some it may be negative.
fn allowed(kp: f64, is_negative: bool, filters: &Sections) -> f64 {
    if is_negative && !filters.as_slice().is_empty() { -kp } else { kp }
}

pub(crate) fn setup() -> impl Strategy<Value = Setup> {
    let slew = prop_oneof![1 => Just(None), 2 => (1e3..1e6).prop_map(Some)];
    let limits = prop_oneof![Just((-500.0, 500.0)), Just((-20.0, 150.0)), Just((30.0, 100.0)), Just((-1e100, 1e100))];
    let dt = prop_oneof![Just(DT), 1e-5..1e-3];
    let bumpless_time = prop_oneof![1 => Just(0.0), 4 => 1e-4..0.1];
    let gains = (gain(), any::<bool>(), gain(), filters());
    (source(), window(), gains, (dt, limits, slew), law(), bumpless_time, 0..4_u32, gate()).prop_map(
        |(source, window, gains, (dt, limits, slew), (law, anti_windup), bumpless_time, max_missing, gate)| {
            let (kp, is_negative, ki, filters) = gains;
            let kp = allowed(kp, is_negative, &filters);
            let set = ControllerOptions { filters, ..ControllerOptions::new(kp, ki / DT, dt, limits) };
            let (measurement_range, max_measurement_step) = gate;
            let options = ControllerOptions { slew, law, anti_windup, bumpless_time, max_missing, ..set };
            Setup { source, window, options: ControllerOptions { measurement_range, max_measurement_step, ..options } }
        },
    )
}

/// Something that happens to a controller.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    Sample(Command, f64),
    /// A plan, and whether it is committed.
    Plan(Command, f64, bool),
    Mode(Mode),
    Stop(f64, f64),
    Release,
    /// Both, and whether the proportional one is negative where it may be.
    Gains(f64, f64, bool),
    Filters(Sections),
    Model(usize),
    Source(Source),
    Reset,
    ResetAt(f64),
    Follow(f64, f64),
    Save,
    Restore,
}

/// A number that anything may hand over.
fn wild() -> impl Strategy<Value = f64> {
    let bad = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(1e300), Just(-1e99)];
    prop_oneof![12 => -4.0..4.0, 2 => -1e3..1e3, 1 => -1e9..1e9, 2 => bad, 1 => Just(0.0)]
}

fn maybe<S: Strategy<Value = f64>>(number: S) -> impl Strategy<Value = Option<f64>> {
    prop_oneof![3 => Just(None), 1 => number.prop_map(Some)]
}

pub(crate) fn command() -> impl Strategy<Value = Command> {
    let correction = prop_oneof![3 => Just(0.0), 1 => -1.0..1.0, 1 => wild()];
    let volts = maybe(prop_oneof![wild(), -600.0..600.0]);
    (wild(), maybe(wild()), correction, maybe(wild()), volts).prop_map(
        |(reference, target, correction, estimate, feedforward)| Command {
            reference,
            target,
            correction,
            estimate,
            feedforward,
        },
    )
}

/// Samples, stops and changes of mode: what leaves the configuration as it is.
pub(crate) fn event() -> impl Strategy<Value = Event> {
    let mode = prop_oneof![Just(Mode::Run), Just(Mode::Feedforward), Just(Mode::Hold)];
    prop_oneof![
        20 => (command(), wild()).prop_map(|(command, y)| Event::Sample(command, y)),
        4 => (command(), wild(), any::<bool>()).prop_map(|(command, y, commit)| Event::Plan(command, y, commit)),
        1 => mode.prop_map(Event::Mode),
        1 => (1e2..1e6, -600.0..600.0).prop_map(|(rate, rest)| Event::Stop(rate, rest)),
        2 => Just(Event::Release),
    ]
}

/// Another configuration.
pub(crate) fn switch() -> impl Strategy<Value = Event> {
    prop_oneof![
        (gain(), gain(), any::<bool>()).prop_map(|(kp, ki, negative)| Event::Gains(kp, ki / DT, negative)),
        (0..2_usize).prop_map(Event::Model),
        source().prop_map(Event::Source),
    ]
}

/// Anything.
pub(crate) fn upheaval() -> impl Strategy<Value = Event> {
    prop_oneof![
        10 => event(),
        3 => switch(),
        1 => filters().prop_map(Event::Filters),
        1 => Just(Event::Reset),
        1 => (-600.0..600.0).prop_map(Event::ResetAt),
        1 => (-600.0..600.0, -600.0..600.0).prop_map(|(first, last)| Event::Follow(first, last)),
        1 => Just(Event::Save),
        1 => Just(Event::Restore),
    ]
}

/// Lets it happen. True if the amplifier is where the controller has just been told it is.
pub(crate) fn happen(controller: &mut HybridController, event: Event, saved: &mut Option<ControllerState>) -> bool {
    let limits = controller.options().limits;
    match event {
        Event::Sample(command, y) => _ = controller.step(command, y),
        Event::Plan(command, y, commit) => {
            controller.plan(command, y);
            assert!(!commit || controller.commit());
        }
        Event::Mode(mode) => controller.set_mode(mode).unwrap(),
        Event::Stop(rate, rest) => _ = controller.stop(rate, rest),
        Event::Release => controller.release(),
        Event::Gains(kp, ki, is_negative) => {
            let kp = allowed(kp, is_negative, &controller.options().filters);
            controller.set_gains(kp, ki).unwrap();
        }
        // Without any there is no negative gain.
        Event::Filters(filters) => {
            let refused = filters.as_slice().is_empty() && controller.options().kp < 0.0;
            assert_eq!(controller.set_filters(&filters).is_err(), refused);
        }
        Event::Model(which) => {
            let inverse = matches!(controller.feedforward(), FeedForward::Forward(_));
            _ = controller.set_model(&compiled(which, inverse));
        }
        Event::Source(source) => controller.set_feedforward(source.make(limits)).unwrap(),
        Event::Reset => controller.reset(),
        Event::Follow(first, last) => return controller.follow(&[first, last]).is_ok(),
        Event::ResetAt(drive) => return controller.reset_at(drive).is_ok(),
        Event::Save => *saved = Some(controller.state()),
        Event::Restore => return saved.as_ref().is_some_and(|state| controller.set_state(state).is_ok()),
    }
    false
}
