//! What the drive passes before it reaches the operators.

use core::f64::consts::TAU;

use super::curve::Curve;

/// The amplifier, and the input map behind it.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct DrivePath {
    /// The bandwidth of the amplifier in Hz.
    pub(crate) bandwidth: Option<f64>,
    pub(crate) map: Option<Curve>,
}

/// The drives of one record on their way, sample by sample; the amplifier at rest at the first.
pub(crate) struct PathLane<'a> {
    map: Option<&'a Curve>,
    amplifier: Option<Lag>,
}

/// A lag of first order whose input is held for a sampling interval.
struct Lag {
    /// exp(-dt / tau).
    decay: f64,
    /// At the end of the interval, once there was one.
    voltage: Option<f64>,
}

impl DrivePath {
    /// Whether the operators may be shown reversals alone.
    pub(crate) fn keeps_turns(&self) -> bool {
        self.bandwidth.is_none()
    }

    pub(crate) fn lane(&self, dt: f64) -> PathLane<'_> {
        let lag = |bandwidth: f64| Lag { decay: (-TAU * bandwidth * dt).exp(), voltage: None };
        PathLane { map: self.map.as_ref(), amplifier: self.bandwidth.map(lag) }
    }
}

impl PathLane<'_> {
    /// What reaches the operators at the end of an interval in which a drive is held, or at its start without an amplifier.
    #[inline]
    pub(crate) fn next(&mut self, u: f64) -> f64 {
        let voltage = self.amplifier.as_mut().map_or(u, |lag| lag.next(u));
        self.map.map_or(voltage, |map| map.at(voltage).0)
    }

    /// What the input map is shown for a drive: the drive of a loop shift.
    pub(crate) fn voltage(&self, u: f64) -> f64 {
        self.amplifier.as_ref().and_then(|lag| lag.voltage).unwrap_or(u)
    }
}

impl Lag {
    fn next(&mut self, u: f64) -> f64 {
        let voltage = self.voltage.map_or(u, |voltage| u + self.decay * (voltage - u));
        self.voltage = Some(voltage);
        voltage
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_amplifier_settles_at_the_first_drive_and_then_follows() {
        let path = DrivePath { bandwidth: Some(400.0), map: None };
        let mut lane = path.lane(1e-4);
        assert_eq!([lane.next(2.0), lane.next(2.0)], [2.0, 2.0]);
        let decay = (-TAU * 0.04_f64).exp();
        assert!((lane.next(3.0) - (3.0 - decay)).abs() < 1e-15);
        assert_eq!(lane.voltage(3.0), 3.0 - decay);
        assert!(!path.keeps_turns());
    }

    #[test]
    fn without_an_amplifier_the_map_alone_is_passed() {
        let map = Curve::new((0.0, 10.0), [0.5, 0.0, 0.0]);
        let path = DrivePath { bandwidth: None, map: Some(map.clone()) };
        let mut lane = path.lane(1e-4);
        assert_eq!((lane.next(4.0), lane.voltage(4.0), path.keeps_turns()), (map.at(4.0).0, 4.0, true));
    }
}
