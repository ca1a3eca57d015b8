//! Targets of many kinds, one kind after the other at random, the same on every machine.

use core::f64::consts::TAU;

/// Marsaglia's xorshift: plenty for test signals.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Numbers that depend on the seed alone.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// Uniform in 0..1.
    #[expect(clippy::cast_precision_loss, reason = "53 bits are kept")]
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in -1..1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Uniform in low..high.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..count.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below count")]
    #[expect(clippy::cast_precision_loss, reason = "a small number")]
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// True once in `mean` times.
    pub fn once_in(&mut self, mean: f64) -> bool {
        self.unit() * mean < 1.0
    }
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Sine,
    NoisySine,
    DecayingTriangle,
    White,
    Walk,
    Plateaus,
    Jumps,
}

const KINDS: [(Kind, f64); 7] = [
    (Kind::Sine, 0.25),
    (Kind::NoisySine, 0.2),
    (Kind::DecayingTriangle, 0.2),
    (Kind::White, 0.05),
    (Kind::Walk, 0.15),
    (Kind::Plateaus, 0.1),
    (Kind::Jumps, 0.05),
];

/// Samples that every stream refuses.
const BAD: [f64; 4] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300];

/// Once in so many samples comes one that every stream refuses.
const BAD_ONCE_IN: f64 = 20_000.0;

/// How far beyond what is asked for the largest swings go.
const BEYOND: f64 = 1.3;

/// Sines with and without noise, decaying triangles, white noise, walks, plateaus and jumps between -1 and 1, of any
/// size and place, a quarter of them beyond that, with a few samples that are no admissible numbers.
#[derive(Clone, Debug)]
pub struct Mixed {
    random: Random,
    kind: Kind,
    centre: f64,
    amplitude: f64,
    /// Cycles per sample, of what has cycles.
    rate: f64,
    /// The last value of what goes on from there, in amplitudes.
    value: f64,
    taken: u32,
    length: u32,
}

impl Mixed {
    /// A signal that depends on the seed alone.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let random = Random::new(seed);
        let kind = Kind::Sine;
        Self { random, kind, centre: 0.0, amplitude: 0.0, rate: 0.0, value: 0.0, taken: 0, length: 0 }
    }

    /// The next sample.
    pub fn sample(&mut self) -> f64 {
        if self.taken == self.length {
            self.change();
        }
        self.taken += 1;
        if self.random.once_in(BAD_ONCE_IN) {
            return BAD[self.taken as usize % BAD.len()];
        }
        self.centre + self.amplitude * self.shape()
    }

    /// Another kind of signal, of another size, place, speed and length.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e5.5")]
    fn change(&mut self) {
        let random = &mut self.random;
        let mut share = random.unit();
        let chosen = KINDS.iter().find(|(_, part)| {
            share -= part;
            share < 0.0
        });
        self.kind = chosen.map_or(Kind::Sine, |(kind, _)| *kind);
        self.amplitude = match random.unit() {
            size if size < 0.25 => BEYOND,
            size if size < 0.4 => 1.0,
            _ => 10_f64.powf(-6.0 * random.unit()),
        };
        self.centre = (1.0 - self.amplitude).max(0.0) * random.signed();
        self.rate = 10_f64.powf(-1.0 - 4.0 * random.unit());
        self.value = random.signed();
        self.taken = 0;
        self.length = 10_f64.powf(2.0 + 3.5 * random.unit()) as u32;
    }

    /// The present sample in amplitudes, between -1 and 1 but for noise.
    fn shape(&mut self) -> f64 {
        let (taken, random) = (f64::from(self.taken), &mut self.random);
        let cycles = self.rate * taken;
        match self.kind {
            Kind::Sine => return (TAU * cycles).sin(),
            Kind::NoisySine => return (TAU * cycles).sin() + 1e-3 * random.signed(),
            Kind::DecayingTriangle => {
                let decay = 1.0 - taken / f64::from(self.length);
                return decay * (4.0 * ((cycles + 0.25).fract() - 0.5).abs() - 1.0);
            }
            Kind::White => self.value = random.signed(),
            Kind::Walk => self.value = (self.value + 0.04 * random.signed()).clamp(-1.0, 1.0),
            Kind::Plateaus if random.once_in(64.0) => self.value = random.signed(),
            Kind::Jumps if random.once_in(8.0) => self.value = random.signed().signum(),
            Kind::Jumps => self.value += 1e-3 * random.signed(),
            Kind::Plateaus => (),
        }
        self.value
    }
}
