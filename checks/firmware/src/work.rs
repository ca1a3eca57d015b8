//! What is measured: smooth signals and white noise through streams of 20 operators, and a controller over an inverse.

use core::fmt;
use core::hint::black_box;

use hysteresis_core::embedded::{Forward, Inverse, Model};
use hysteresis_core::{
    ControllerOptions, Duhem, DuhemForward, DuhemInverse, Error, HybridController, Offsets, Process, Ratios, Real,
};

/// As many samples are measured.
const SAMPLES: usize = 2000;

/// In um/V.
const WEIGHTS: [f64; 20] = [
    4.257e-3, 3.329e-4, 2.887e-4, 2.496e-4, 2.156e-4, 1.866e-4, 1.626e-4, 1.437e-4, 1.298e-4, 1.209e-4, 1.171e-4,
    1.183e-4, 1.246e-4, 1.359e-4, 1.523e-4, 1.737e-4, 2.001e-4, 2.315e-4, 2.681e-4, 3.096e-4,
];

/// In V.
const LIMITS: (f64, f64) = (-500.0, 500.0);

/// What came out of one case.
pub(crate) struct Case {
    name: [&'static str; 3],
    digest: u64,
    #[cfg_attr(not(target_os = "none"), expect(dead_code, reason = "the host only gives digests"))]
    ticks: u32,
}

impl Case {
    /// Whether the samples were only read and the outputs written.
    #[cfg(target_os = "none")]
    pub(crate) fn is_nothing(&self) -> bool {
        self.name[0] == "nothing"
    }

    /// Clock ticks of all samples, one of `per_tick` instructions each, as instructions per sample.
    #[cfg(target_os = "none")]
    pub(crate) fn per_sample(&self, per_tick: u32) -> u32 {
        (self.ticks * per_tick + SAMPLES as u32 / 2) / SAMPLES as u32
    }
}

/// The name, and the digest of all outputs.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [what, number, signal] = self.name;
        write!(f, "{what:<10} {number} {signal:<6} {:016x}", self.digest)
    }
}

/// From -1 to 1: two slow sines, each from the one before it by a rotation.
fn smooth() -> impl Iterator<Item = f64> {
    let turn = |(s, c): &mut (f64, f64), angle: f64| {
        let (sine, cosine) = (angle - angle * angle * angle / 6.0, 1.0 - angle * angle / 2.0);
        (*s, *c) = (*s * cosine + *c * sine, *c * cosine - *s * sine);
        *s
    };
    let (mut slow, mut fast) = ((0.0, 0.8), (0.0, 0.15));
    core::iter::from_fn(move || Some(turn(&mut slow, 0.01) + turn(&mut fast, 0.073)))
}

/// From -1 to 1, every number as likely as any other.
fn noise() -> impl Iterator<Item = f64> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    core::iter::from_fn(move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        Some((state >> 40) as f64 / 8_388_608.0 - 1.0)
    })
}

/// Takes all samples; `clock` counts upwards.
fn measure<T: Real>(
    name: [&'static str; 3],
    samples: &[T; SAMPLES],
    clock: &impl Fn() -> u32,
    mut step: impl FnMut(T) -> f64,
) -> Case {
    let mut outputs = [0.0_f64; SAMPLES];
    let start = clock();
    for (x, y) in black_box(samples).iter().zip(&mut outputs) {
        *y = step(*x);
    }
    let ticks = clock().wrapping_sub(start);
    // FNV-1a over the bits.
    let bytes = outputs.iter().flat_map(|y| y.to_bits().to_le_bytes());
    let digest = bytes
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    Case { name, digest, ticks }
}

fn samples<T: Real>(signal: impl Iterator<Item = f64>, scale: f64) -> [T; SAMPLES] {
    let mut samples = [T::ZERO; SAMPLES];
    samples.iter_mut().zip(signal).for_each(|(place, x)| *place = T::narrow(scale * x));
    samples
}

fn streams<T: Real>(number: &'static str, clock: &impl Fn() -> u32, mut report: impl FnMut(Case)) -> Result<(), Error> {
    let r = core::array::from_fn::<f64, 20, _>(|i| 25.0 * i as f64);
    let model = Model::<T, 20>::from_ratios(&WEIGHTS, &r, Ratios::PAPER, Offsets::default())?;
    let limits = (T::narrow(LIMITS.0), T::narrow(LIMITS.1));
    for (signal, drives, targets) in [
        ("smooth", samples::<T>(smooth(), 450.0), samples::<T>(smooth(), 2.5)),
        ("noise", samples(noise(), 450.0), samples(noise(), 2.5)),
    ] {
        // What reading the samples and writing the outputs takes is measured too, and taken off.
        report(measure(["nothing", number, signal], &drives, clock, |x| black_box(x).wide()));
        let mut forward = Forward::new(&model);
        report(measure(["forward", number, signal], &drives, clock, |x| forward.step(x).wide()));
        let mut inverse = Inverse::new(&model, Some(limits))?;
        report(measure(["inverse", number, signal], &targets, clock, |y| inverse.step(y).wide()));
        let options = ControllerOptions { slew: Some(1e6), ..ControllerOptions::new(5.0, 6e3, 1e-4, LIMITS) };
        let inverse = Inverse::new(&model, Some(limits))?;
        let mut controller = HybridController::with_source(inverse, None, &options)?;
        report(measure(["controller", number, signal], &targets, clock, |y| {
            controller.step(y.wide().into(), 0.99 * y.wide())
        }));
    }
    Ok(())
}

/// A Duhem operator beside a slope, its inverse, and a controller over that.
fn duhem(clock: &impl Fn() -> u32, mut report: impl FnMut(Case)) -> Result<(), Error> {
    const SLOPE: f64 = 0.5;
    let (duhem, limits) = (Duhem::<9>::from_bouc_wen(1.0, 1.0, 0.5, 0.25)?, (-5.0, 5.0));
    for (signal, drives) in [("smooth", samples::<f64>(smooth(), 3.0)), ("noise", samples(noise(), 3.0))] {
        report(measure(["nothing", "f64", signal], &drives, clock, black_box));
        let mut forward = DuhemForward::new(duhem);
        report(measure(["duhem", "f64", signal], &drives, clock, |x| SLOPE * x + forward.step(x)));
        let mut inverse = DuhemInverse::new(duhem, SLOPE)?.within(limits)?;
        report(measure(["duhem-inv", "f64", signal], &drives, clock, |y| inverse.step(y)));
        let options = ControllerOptions { slew: Some(1e4), ..ControllerOptions::new(0.1, 50.0, 1e-4, limits) };
        let inverse = DuhemInverse::new(duhem, SLOPE)?.within(limits)?;
        let mut controller = HybridController::with_source(inverse, None, &options)?;
        report(measure(["duhem-ctrl", "f64", signal], &drives, clock, |y| controller.step(y.into(), 0.99 * y)));
    }
    Ok(())
}

/// Measures every case by a clock that counts upwards.
///
/// # Errors
/// None, unless the model is none.
pub(crate) fn all(clock: impl Fn() -> u32, mut report: impl FnMut(Case)) -> Result<(), Error> {
    streams::<f32>("f32", &clock, &mut report)?;
    streams::<f64>("f64", &clock, &mut report)?;
    duhem(&clock, &mut report)
}

/// The bytes of a model of 20 operators and of streams that borrow it.
#[cfg(target_os = "none")]
pub(crate) fn sizes(mut report: impl FnMut(&'static str, &'static str, usize)) {
    report("model", "f32", size_of::<Model<f32, 20>>());
    report("model", "f64", size_of::<Model<f64, 20>>());
    report("forward", "f32", size_of::<Forward<f32, 20, &Model<f32, 20>>>());
    report("forward", "f64", size_of::<Forward<f64, 20, &Model<f64, 20>>>());
    report("inverse", "f32", size_of::<Inverse<f32, 20, &Model<f32, 20>>>());
    report("inverse", "f64", size_of::<Inverse<f64, 20, &Model<f64, 20>>>());
    report("controller without its inverse", "f64", size_of::<HybridController>());
}

/// The bytes that docs/firmware.md tells of.
#[cfg(target_os = "none")]
const _: () = {
    assert!(size_of::<Model<f32, 40>>() == 128 * 40 + 240 && size_of::<Model<f64, 40>>() == 144 * 40 + 344);
    assert!(size_of::<Forward<f32, 40, &Model<f32, 40>>>() == 96 * 40 + 352);
    assert!(size_of::<Forward<f64, 40, &Model<f64, 40>>>() == 112 * 40 + 424);
    assert!(size_of::<Inverse<f32, 40, &Model<f32, 40>>>() == 96 * 40 + 368);
    assert!(size_of::<Inverse<f64, 40, &Model<f64, 40>>>() == 112 * 40 + 464);
};
