//! A simulated plant: the loop without a stage.

use hysteresis_simulate::plant::Plant;

use super::{Fault, Io};

/// The plant moves on by one interval at each sample, however much time went by.
impl Io for Plant {
    const WRITE_MAY_FAIL: bool = false;

    #[inline]
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        Ok(Some(self.measured()))
    }

    #[inline]
    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.step(drive);
        Ok(())
    }
}
