use hysteresis_control::linear::{Creep, Delay, Dynamics, FirstOrder};

/// Everything about a plant but its hysteresis. The default is a plant of hysteresis alone, sampled at 10 kHz.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantOptions {
    /// The lag of the amplifier, before the hysteresis.
    pub amplifier: Option<FirstOrder>,
    /// The linear dynamics behind the hysteresis.
    pub dynamics: Option<Dynamics>,
    /// Creep of the position.
    pub creep: Option<Creep>,
    /// By how much the position lags besides. Fractions of a sample interpolate it.
    pub delay: Delay,
    /// Rms of the measurement noise, in the unit of the position.
    pub noise: f64,
    /// Of the noise: the same seed gives the same numbers.
    pub seed: u64,
    /// Of the drive (low, high): what comes is clamped to them.
    pub limits: Option<(f64, f64)>,
    /// Bits of the D/A converter, whose levels span the limits.
    pub dac_bits: Option<u32>,
    /// Bits of the A/D converter, and the lowest and highest measurement.
    pub adc: Option<(u32, (f64, f64))>,
    /// The sampling interval in seconds.
    pub dt: f64,
}

impl Default for PlantOptions {
    fn default() -> Self {
        Self {
            amplifier: None,
            dynamics: None,
            creep: None,
            delay: Delay::none(),
            noise: 0.0,
            seed: 0,
            limits: None,
            dac_bits: None,
            adc: None,
            dt: 1e-4,
        }
    }
}
