//! The parameters of a Duhem operator: knots, and f+ and f- there.

use crate::duhem::chain::{Chain, Place};
use crate::error::{Bound, Error, MAX_MAGNITUDE, check_all_finite, check_length};
use crate::fingerprint::Fingerprint;

/// The least and the largest f, and the largest magnitude of a knot and of a gradient: no product overflows.
const SCALE: (f64, f64) = (1e-50, 1e50);

/// Where f of a Bouc-Wen model would reach zero it stays at this share of alpha.
const FLOOR: f64 = 1e-9;

/// A free Duhem operator: z' = f+(z) x' where x rises, z' = f-(z) x' where x falls.
///
/// Coleman and Hodgdon's model, with f+ and f- piecewise linear over z on up to N knots that both share. f+ and f- are
/// both positive, so z rises where x rises and falls where x falls. It does not depend on the rate: along a branch z
/// is a function of x, a chain of exponentials with one solution in closed form from knot to knot. Beyond the outer
/// knots a line that grows outwards goes on, and f stays as it is where the line falls: so f is positive everywhere,
/// and Bouc-Wen hysteresis of exponent 1 is the case of three knots. z has no memory of turning points, and loops need
/// not close.
///
/// Or f+ and f- are both negative: z falls where x rises. Such an operator stands beside a steeper slope, as in the
/// piezo form of Bouc-Wen's model, k x - h. Beyond its outer knots f stays as it is: the sum keeps its sign of slope.
///
/// x and z may have any unit; f has that of z over x.
///
/// After B. D. Coleman and M. L. Hodgdon, "A constitutive relation for rate-independent hysteresis in
/// ferromagnetically soft materials", Int. J. Eng. Sci. 24(6), 897-919, 1986.
///
/// ```
/// use hysteresis_core::{Duhem, DuhemForward, Process};
/// // f+ = 1 - z/2 and f- = 1 + z/2 between -1 and 1.
/// let duhem = Duhem::<3>::new(&[-1.0, 0.0, 1.0], &[1.5, 1.0, 0.5], &[0.5, 1.0, 1.5])?;
/// let mut forward = DuhemForward::new(duhem);
/// assert!((forward.step(1.0) - 2.0 * (1.0 - f64::exp(-0.5))).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Duhem<const N: usize> {
    /// 1 where z rises with x, -1 where it falls.
    pub(super) sign: f64,
    /// `sign` z over x, where x rises.
    pub(super) rising: Chain<N>,
    /// -`sign` z over -x: where x falls, a branch rises in these.
    pub(super) falling: Chain<N>,
}

impl<const N: usize> Duhem<N> {
    /// From the knots z, and f+ and f- there.
    ///
    /// # Errors
    /// [`Error::Whole`] for fewer than two knots or more than N, [`Error::Length`] unless there are as many values of
    /// f+ and f-, [`Error::Domain`] for knots that do not increase or are beyond 1e50, for f of magnitudes outside
    /// 1e-50 to 1e50 or of both signs, or where f changes by more than 1e50 per unit of z.
    pub fn new(knots: &[f64], rising: &[f64], falling: &[f64]) -> Result<Self, Error> {
        if !(2..=N).contains(&knots.len()) {
            let expected = Bound::FromTo { first: 2, last: N };
            return Err(Error::Whole { parameter: "knots", index: None, expected, got: knots.len() as u64 });
        }
        check_all_finite("knots", knots)?;
        for (index, z) in knots.iter().enumerate() {
            let before = index.checked_sub(1).and_then(|i| knots.get(i));
            if before.is_some_and(|before| z <= before) || z.abs() > SCALE.1 {
                let expected = "a number above the one before it, at most 1e50 in magnitude";
                return Err(Error::domain("knots", Some(index), expected, *z));
            }
        }
        let falls = rising.first().is_some_and(|f| *f < 0.0);
        check_slopes("rising", knots, rising, falls)?;
        check_slopes("falling", knots, falling, falls)?;
        let sign = if falls { -1.0 } else { 1.0 };
        let (upwards, downwards) = (|slopes| along(knots, slopes, sign), |slopes| against(knots, slopes, sign));
        Ok(if falls {
            Self { sign, rising: Chain::within(downwards(rising)), falling: Chain::within(upwards(falling)) }
        } else {
            Self { sign, rising: Chain::open(upwards(rising)), falling: Chain::open(downwards(falling)) }
        })
    }

    /// Bouc-Wen hysteresis of exponent 1: z' = alpha x' - beta (gamma |x'| z + delta x' |z|).
    ///
    /// With an alpha below 0 it is the h that the piezo form k x - h subtracts: -h has alpha and delta of the other
    /// sign.
    ///
    /// f+ = alpha - beta (gamma z + delta |z|) and f- = alpha + beta (gamma z - delta |z|): three knots. Where f
    /// would fall to zero, z comes to rest: f stays at 1e-9 alpha there.
    ///
    /// # Errors
    /// [`Error::Whole`] if N is below 3, [`Error::Domain`] unless beta is above 0, gamma at least 0 (loops do not give
    /// energy) and alpha not 0, for an alpha below 0 unless delta is below gamma (z comes to rest), or for numbers so
    /// large or small that [`new`](Self::new) does not take the knots.
    ///
    /// ```
    /// use hysteresis_core::{Duhem, DuhemForward, Process};
    /// // The public Bouc-Wen benchmark: N over m.
    /// let mut z = DuhemForward::new(Duhem::<3>::from_bouc_wen(5e4, 1e3, 0.8, -1.1)?);
    /// // Along a rising branch above 0, f = alpha + 300 z.
    /// assert!((z.step(1e-3) - 5e4 / 300.0 * f64::exp_m1(0.3)).abs() < 1e-12);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn from_bouc_wen(alpha: f64, beta: f64, gamma: f64, delta: f64) -> Result<Self, Error> {
        if !(SCALE.0..=SCALE.1).contains(&alpha.abs()) {
            return Err(Error::domain("alpha", None, "a number of magnitude 1e-50 to 1e50", alpha));
        }
        if !(SCALE.0..=SCALE.1).contains(&beta) {
            return Err(Error::domain("beta", None, "a number from 1e-50 to 1e50", beta));
        }
        if !(0.0..=SCALE.1).contains(&gamma) {
            return Err(Error::domain("gamma", None, "a number from 0 to 1e50", gamma));
        }
        if delta.is_nan() || delta.abs() > SCALE.1 {
            return Err(Error::domain("delta", None, "a number of magnitude at most 1e50", delta));
        }
        let (sign, alpha, given) = (alpha.signum(), alpha.abs(), delta);
        // In the equation of -z, delta has the other sign.
        let delta = sign * delta;
        if sign < 0.0 && gamma + delta <= 0.0 {
            return Err(Error::domain("delta", None, "a number below gamma where alpha is below 0", given));
        }
        // Per unit of |z|, by how much f falls where z grows, and where it comes back to 0.
        let (outwards, inwards) = (beta * (gamma + delta), beta * (delta - gamma));
        let steepest = beta * (gamma + delta.abs());
        let (reach, end) = if outwards > 0.0 {
            ((1.0 - FLOOR) * (alpha / outwards), FLOOR * alpha)
        } else {
            // Anywhere: the lines go on beyond.
            let reach = if steepest > 0.0 { alpha / steepest } else { alpha };
            (reach, alpha - outwards * reach)
        };
        let back = alpha - inwards * reach;
        let (loading, unloading) = ([back, alpha, end], [end, alpha, back]);
        let knots = [-reach, 0.0, reach];
        if sign < 0.0 {
            Self::new(&knots, &unloading.map(|f| -f), &loading.map(|f| -f))
        } else {
            Self::new(&knots, &loading, &unloading)
        }
    }

    /// f at the knots of a chain, of which one along z and one against it.
    fn along_knots<'a>(&'a self, chain: &'a Chain<N>, is_along: bool) -> impl Iterator<Item = (f64, f64)> + 'a {
        let (count, sign) = (chain.knots().count(), if is_along { 1.0 } else { -1.0 });
        let place = move |i| if is_along { i } else { count - 1 - i };
        let knots = (0..count).filter_map(move |i| chain.knots().nth(place(i)));
        knots.map(move |(z, f)| (sign * z, self.sign * f))
    }

    /// The knots z.
    pub fn knots(&self) -> impl Iterator<Item = f64> + '_ {
        self.along_knots(&self.rising, self.sign > 0.0).map(|(z, _)| z)
    }

    /// f+ at the knots.
    pub fn rising(&self) -> impl Iterator<Item = f64> + '_ {
        self.along_knots(&self.rising, self.sign > 0.0).map(|(_, f)| f)
    }

    /// f- at the knots, in the order of [`knots`](Self::knots).
    pub fn falling(&self) -> impl Iterator<Item = f64> + '_ {
        self.along_knots(&self.falling, self.sign < 0.0).map(|(_, f)| f)
    }

    /// dz/dx at z, taken as within 1e100: f+ or f-.
    #[must_use]
    pub fn slope(&self, z: f64, rising: bool) -> f64 {
        let z = self.sign * z.clamp(-MAX_MAGNITUDE, MAX_MAGNITUDE);
        let (chain, z) = if rising { (&self.rising, z) } else { (&self.falling, -z) };
        self.sign * chain.find(z, Place(0)).1.slope_at(z)
    }

    /// Tells operators of other knots, f+ or f- apart: a saved state names its operator by it.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let mut hash = Fingerprint::new();
        self.take_in(&mut hash);
        hash.finish()
    }

    /// Takes in knots, f+ and f-.
    pub(crate) fn take_in(&self, hash: &mut Fingerprint) {
        for number in self.knots().chain(self.rising()).chain(self.falling()) {
            hash.numbers(&[number]);
        }
    }

    /// The largest f between the outer knots, of both directions.
    #[must_use]
    pub fn max_slope(&self) -> f64 {
        self.rising().chain(self.falling()).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The smallest f of both directions: z grows at least by this per unit of x. Below 0 for an operator whose z
    /// falls.
    #[must_use]
    pub fn min_slope(&self) -> f64 {
        self.rising().chain(self.falling()).fold(f64::INFINITY, f64::min)
    }
}

/// Knots and magnitudes of f in the order of z.
fn along<'a>(knots: &'a [f64], slopes: &'a [f64], sign: f64) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    knots.iter().zip(slopes).map(move |(z, f)| (*z, sign * f))
}

/// The same in the order of -z.
fn against<'a>(knots: &'a [f64], slopes: &'a [f64], sign: f64) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    knots.iter().zip(slopes).rev().map(move |(z, f)| (-z, sign * f))
}

fn check_slopes(parameter: &'static str, knots: &[f64], slopes: &[f64], falls: bool) -> Result<(), Error> {
    check_length(parameter, knots.len(), slopes.len())?;
    let mut before = None;
    for (index, (z, f)) in knots.iter().zip(slopes).enumerate() {
        if !(SCALE.0..=SCALE.1).contains(&if falls { -f } else { *f }) {
            let expected = if falls {
                "a number below 0 (-1e50 to -1e-50), as rising[0] is"
            } else {
                "a number above 0 (1e-50 to 1e50), or all of rising and falling below 0"
            };
            return Err(Error::domain(parameter, Some(index), expected, *f));
        }
        if before.is_some_and(|(z0, f0): (f64, f64)| (f - f0).abs() > SCALE.1 * (z - z0)) {
            let expected = "a change by at most 1e50 per unit of z since the knot before";
            return Err(Error::domain(parameter, Some(index), expected, *f));
        }
        before = Some((*z, *f));
    }
    Ok(())
}
