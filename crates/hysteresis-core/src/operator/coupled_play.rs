use super::play::Play;
use super::tracked::Operator;
use crate::error::{Error, check_non_negative, check_within};

/// The coupled-play (CP) operator, equation (5) with errata 1-6: z(k) = max(lo, min(hi, z(k-1))) with
/// lo(x) = max(x - r, min(0, x - rc)) and hi(x) = min(x + ra, max(0, x + rb)).
///
/// Rising, z follows x - rc below zero, sticks at zero from x = rc to x = r, then follows x - r. Falling, it
/// follows x + rb above zero, sticks at zero from x = -rb to x = -ra, then follows x + ra. All thresholds in the
/// unit of the input, r >= rc >= 0 and ra >= rb >= 0. With four equal thresholds it is the [`Play`](super::Play).
///
/// ```
/// use hysteresis_core::{CoupledPlay, Operator};
/// let cp = CoupledPlay::new(10.0, 8.0, 3.0, 4.0)?;
/// assert_eq!(cp.next(0.0, 20.0), 10.0);
/// assert_eq!(cp.next(10.0, 2.0), 5.0); // falling above zero: x + rb
/// assert_eq!(cp.next(5.0, -5.0), 0.0); // sticks at zero
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledPlay {
    r: f64,
    ra: f64,
    rb: f64,
    rc: f64,
}

impl CoupledPlay {
    /// A coupled play with the rising thresholds `r >= rc` and the falling thresholds `ra >= rb`.
    ///
    /// # Errors
    /// [`Error::Domain`] unless r >= rc >= 0 and ra >= rb >= 0, all finite.
    pub fn new(r: f64, ra: f64, rb: f64, rc: f64) -> Result<Self, Error> {
        Self::indexed(None, r, ra, rb, rc)
    }

    /// [`new`](Self::new) for operator `index` of a model, so that an error names it.
    pub(crate) fn indexed(index: Option<usize>, r: f64, ra: f64, rb: f64, rc: f64) -> Result<Self, Error> {
        let r = check_non_negative("r", index, r)?;
        let ra = check_non_negative("ra", index, ra)?;
        let rb = check_within("rb", index, rb, "ra", ra)?;
        let rc = check_within("rc", index, rc, "r", r)?;
        Ok(Self { r, ra, rb, rc })
    }

    /// Rising above zero: z = x - r.
    #[must_use]
    pub fn r(&self) -> f64 {
        self.r
    }

    /// Falling below zero: z = x + ra.
    #[must_use]
    pub fn ra(&self) -> f64 {
        self.ra
    }

    /// Falling above zero: z = x + rb.
    #[must_use]
    pub fn rb(&self) -> f64 {
        self.rb
    }

    /// Rising below zero: z = x - rc.
    #[must_use]
    pub fn rc(&self) -> f64 {
        self.rc
    }

    /// True if all thresholds are zero: z = x without memory.
    #[must_use]
    pub fn is_identity(&self) -> bool {
        self.r == 0.0 && self.ra == 0.0
    }
}

/// Four equal thresholds: max(x - r, min(x + r, z)) on both sides of zero.
impl From<Play> for CoupledPlay {
    fn from(play: Play) -> Self {
        let r = play.r();
        Self { r, ra: r, rb: r, rc: r }
    }
}

impl Operator for CoupledPlay {
    #[inline]
    fn next(&self, last_output: f64, input: f64) -> f64 {
        let lo = (input - self.r).max((input - self.rc).min(0.0));
        let hi = (input + self.ra).min((input + self.rb).max(0.0));
        lo.max(hi.min(last_output))
    }
}
