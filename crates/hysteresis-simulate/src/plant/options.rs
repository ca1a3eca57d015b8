/// What a plant has besides its stage: converters, the seed of its noise, and the sampling interval.
///
/// ```
/// use hysteresis_simulate::plant::PlantOptions;
/// let options = PlantOptions { dac_bits: Some(16), ..PlantOptions::new(1e-4) };
/// assert_eq!((options.dt, options.seed, options.adc), (1e-4, 0, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantOptions {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// Seed of the noise of the sensor: the same seed gives the same numbers.
    pub seed: u64,
    /// Bits of the D/A converter, whose levels span the limits.
    pub dac_bits: Option<u32>,
    /// Bits of the A/D converter, and the lowest and highest measurement.
    pub adc: Option<(u32, (f64, f64))>,
}

impl PlantOptions {
    /// Without converters.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self { dt, seed: 0, dac_bits: None, adc: None }
    }
}
