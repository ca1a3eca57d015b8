//! Plants that move each other's axes.

use hysteresis_core::{AxisMatrix, Bound, Error as CoreError, check_length};
use serde::{Deserialize, Serialize};

use super::{Error, Plant, PlantState};

/// Several actuators that move the same axes: an XY stage with crosstalk, or a mirror on three actuators.
///
/// ```text
/// y = K p                          true positions of the axes, p those of the single plants
/// measured_i = y_i + noise_i       noise_i: what sensor i adds, measured minus position of plant i
/// ```
///
/// Drive i goes to plant i. Plants with the same seed have the same noise.
///
/// ```
/// use hysteresis_simulate::paper::Benchmark;
/// use hysteresis_simulate::plant::MultiAxisPlant;
/// let plants = vec![Benchmark::A1.plant(0), Benchmark::A1.plant(1)];
/// let mut stage = MultiAxisPlant::new(plants, &[1.0, 0.03, -0.03, 1.0])?;
/// (0..100).try_for_each(|_| stage.step(&[300.0, 0.0]))?;
/// let [x, y] = stage.position() else { unreachable!() };
/// assert!((y + 0.03 * x).abs() < 1e-9, "what x moves on the way");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct MultiAxisPlant {
    plants: Box<[Plant]>,
    coupling: AxisMatrix,
    /// p, for the product.
    single: Box<[f64]>,
    position: Box<[f64]>,
    measured: Box<[f64]>,
}

/// Everything that a [`MultiAxisPlant`] remembers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiAxisPlantState {
    /// The coupling, row by row.
    pub coupling: Vec<f64>,
    /// The single plants.
    pub plants: Vec<PlantState>,
}

impl MultiAxisPlant {
    /// Plants, and the coupling K row by row.
    ///
    /// # Errors
    /// [`CoreError::Empty`] without a plant, [`CoreError::Domain`] for plants of other sampling intervals than the
    /// first one; as [`AxisMatrix::new`] for the coupling.
    pub fn new(plants: Vec<Plant>, coupling: &[f64]) -> Result<Self, CoreError> {
        let parameter = "plants";
        let Some(dt) = plants.first().map(Plant::dt) else { return Err(CoreError::Empty { parameter }) };
        for (index, got) in plants.iter().map(Plant::dt).enumerate() {
            if (got / dt - 1.0).abs() > 1e-9 {
                let expected = Bound::EqualTo { value: dt, what: "the sampling interval of the first one in seconds" };
                return Err(CoreError::Domain { parameter, index: Some(index), expected, got });
            }
        }
        let coupling = AxisMatrix::new("coupling", plants.len(), coupling)?;
        let zeros = || vec![0.0; plants.len()].into();
        let (single, position, measured) = (zeros(), zeros(), zeros());
        let mut all = Self { plants: plants.into(), coupling, single, position, measured };
        all.look();
        Ok(all)
    }

    /// Positions and measurements of now.
    fn look(&mut self) {
        for (p, plant) in self.single.iter_mut().zip(&self.plants) {
            *p = plant.position();
        }
        let Self { plants, coupling, single, position, measured } = self;
        combine(coupling, single, position, measured, |i| plants[i].measured());
    }

    /// Holds the drives for one sampling interval; see [`Plant::step`].
    ///
    /// # Errors
    /// [`CoreError::Length`] unless there is a drive for each plant; nothing moves then.
    pub fn step(&mut self, drives: &[f64]) -> Result<(), CoreError> {
        check_length("drives", self.plants.len(), drives.len())?;
        for (plant, drive) in self.plants.iter_mut().zip(drives) {
            plant.step(*drive);
        }
        self.look();
        Ok(())
    }

    /// Takes rows of drives and writes the rows of a record; see [`Plant::run`].
    ///
    /// # Errors
    /// [`CoreError::Rows`] unless the drives are whole rows, [`CoreError::Length`] unless all three slices have the
    /// same length; nothing is taken then.
    pub fn run(&mut self, drives: &[f64], measured: &mut [f64], position: &mut [f64]) -> Result<(), CoreError> {
        let width = self.plants.len();
        if !drives.len().is_multiple_of(width) {
            return Err(CoreError::Rows { parameter: "drives", width, got: drives.len() });
        }
        check_length("measured", drives.len(), measured.len())?;
        check_length("position", drives.len(), position.len())?;
        let outputs = measured.chunks_exact_mut(width).zip(position.chunks_exact_mut(width));
        let mut seen = vec![0.0; width];
        for (drives, (measured, position)) in drives.chunks_exact(width).zip(outputs) {
            let single = self.single.iter_mut().zip(&mut seen);
            for ((plant, drive), (p, y)) in self.plants.iter_mut().zip(drives).zip(single) {
                plant.run(&[*drive], core::slice::from_mut(y), core::slice::from_mut(p))?;
            }
            combine(&self.coupling, &self.single, position, measured, |i| seen[i]);
        }
        self.look();
        Ok(())
    }

    /// The single plants.
    #[must_use]
    pub fn plants(&self) -> &[Plant] {
        &self.plants
    }

    /// The coupling K.
    #[must_use]
    pub fn coupling(&self) -> &AxisMatrix {
        &self.coupling
    }

    /// The measurements of now, of all axes.
    #[must_use]
    pub fn measured(&self) -> &[f64] {
        &self.measured
    }

    /// The true positions of now, of all axes.
    #[must_use]
    pub fn position(&self) -> &[f64] {
        &self.position
    }

    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.plants.first().map_or(0.0, Plant::dt)
    }

    /// Back to the start, at rest; see [`Plant::reset`].
    pub fn reset(&mut self) {
        self.plants.iter_mut().for_each(Plant::reset);
        self.look();
    }

    /// Everything that the plants remember. Allocates.
    #[must_use]
    pub fn state(&self) -> MultiAxisPlantState {
        let plants = self.plants.iter().map(Plant::state).collect();
        MultiAxisPlantState { coupling: self.coupling.entries().to_vec(), plants }
    }

    /// Continues from a state, bit for bit. Allocates.
    ///
    /// # Errors
    /// [`CoreError::State`] for another coupling or number of plants, and those of [`Plant::set_state`]; nothing
    /// changes then.
    pub fn set_state(&mut self, state: &MultiAxisPlantState) -> Result<(), Error> {
        if state.coupling != self.coupling.entries() || state.plants.len() != self.plants.len() {
            return Err(CoreError::State { expected: "the coupling and the number of plants that there are" }.into());
        }
        let mut restored = self.plants.clone();
        for (plant, state) in restored.iter_mut().zip(&state.plants) {
            plant.set_state(state)?;
        }
        self.plants = restored;
        self.look();
        Ok(())
    }
}

/// The positions y = K p, and what the sensors show there: with the identity, to the bit what the single ones show.
fn combine(
    coupling: &AxisMatrix,
    single: &[f64],
    position: &mut [f64],
    measured: &mut [f64],
    shown: impl Fn(usize) -> f64,
) {
    coupling.apply(single, position).expect("as many positions as axes");
    for (i, ((measured, y), p)) in measured.iter_mut().zip(position).zip(single).enumerate() {
        *measured = shown(i) + (*y - p);
    }
}
