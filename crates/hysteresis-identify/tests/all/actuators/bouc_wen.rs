//! Hysteresis that is not of the model's kind.

/// Bouc-Wen hysteresis of about 100 um for 150 V: x = u - 0.8 z, dz = (0.35 - (0.008 + 0.022 sign(z du)) |z|) du.
#[derive(Default)]
pub(crate) struct BoucWen {
    u: f64,
    z: f64,
}

impl BoucWen {
    pub(crate) fn step(&mut self, u: f64) -> f64 {
        let du = u - self.u;
        self.z += 0.35 * du - 0.022 * du.abs() * self.z - 0.008 * du * self.z.abs();
        self.u = u;
        0.75 * (u - 0.8 * self.z)
    }
}
