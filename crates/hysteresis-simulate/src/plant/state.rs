//! What a plant remembers, as a plain value.

use hysteresis_control::stage::StageState;
use hysteresis_core::Error as CoreError;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::error::Error;
use super::simulation::{Events, Plant};

/// Everything that a [`Plant`] remembers: restored, it continues bit for bit, noise included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantState {
    /// The stage between the converters.
    pub stage: StageState,
    /// The drive that was put out last.
    pub drive: f64,
    /// The position of now.
    pub position: f64,
    /// The measurement of now.
    pub measured: f64,
    /// What the sensor adds to the position of now.
    pub reading_noise: f64,
    /// What had to be put right.
    pub events: Events,
    noise: Xoshiro256PlusPlus,
}

impl Plant {
    /// Everything that the plant remembers. Allocates.
    ///
    /// ```
    /// use hysteresis_simulate::paper::Benchmark;
    /// let mut plant = Benchmark::A1.plant(7);
    /// plant.step(300.0);
    /// let saved = plant.state();
    /// let next = plant.step(300.0);
    /// let mut other = Benchmark::A1.plant(0); // the noise is that of the state
    /// other.set_state(&saved)?;
    /// assert_eq!(other.step(300.0), next);
    /// # Ok::<(), hysteresis_simulate::plant::Error>(())
    /// ```
    #[must_use]
    pub fn state(&self) -> PlantState {
        PlantState {
            stage: self.forward.state(),
            drive: self.drive,
            position: self.position,
            measured: self.measured,
            reading_noise: self.reading_noise,
            events: self.events,
            noise: self.noise.generator().clone(),
        }
    }

    /// Continues from the state of a plant of the same stage, bit for bit; [`reset`](Self::reset) goes back to the start of
    /// this one.
    ///
    /// # Errors
    /// [`Error`] for a state of another stage or sampling interval, or numbers that are not finite; nothing changes then.
    pub fn set_state(&mut self, state: &PlantState) -> Result<(), Error> {
        let numbers = [state.drive, state.position, state.measured, state.reading_noise];
        if !numbers.into_iter().all(f64::is_finite) {
            return Err(CoreError::State { expected: "finite drives and positions" }.into());
        }
        self.forward.set_state(&state.stage)?;
        [self.drive, self.position, self.measured, self.reading_noise] = numbers;
        self.events = state.events;
        self.noise.resume(state.noise.clone());
        Ok(())
    }
}
