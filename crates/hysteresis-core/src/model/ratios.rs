use crate::error::{Bound, Error, check_non_negative, check_within};
use crate::operator::CoupledPlay;

/// The three thresholds of every operator as fractions of its r: ra = `ra` r, rb = `rb` r, rc = `rc` r.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ratios {
    /// ra / r, at least `rb`.
    pub ra: f64,
    /// rb / r, between 0 and `ra`.
    pub rb: f64,
    /// rc / r, between 0 and 1.
    pub rc: f64,
}

impl Ratios {
    /// The ratios of the paper's actuator (Table I): 0.95, 0.30, 0.35.
    pub const PAPER: Self = Self { ra: 0.95, rb: 0.30, rc: 0.35 };

    /// The ratios of the paper's inverse (Table II): 0.90, 0.35, 0.35.
    pub const PAPER_INVERSE: Self = Self { ra: 0.90, rb: 0.35, rc: 0.35 };

    /// Equal thresholds: every coupled play is a play.
    pub const PLAY: Self = Self { ra: 1.0, rb: 1.0, rc: 1.0 };

    /// The coupled play of threshold `r` in these proportions; `index` names the operator in errors.
    pub(crate) fn operator(self, index: usize, r: f64) -> Result<CoupledPlay, Error> {
        CoupledPlay::indexed(Some(index), r, self.ra * r, self.rb * r, self.rc * r)
    }

    pub(crate) fn check(self) -> Result<Self, Error> {
        check_non_negative("ra", None, self.ra)?;
        check_within("rb", None, self.rb, "ra", self.ra)?;
        if (0.0..=1.0).contains(&self.rc) {
            Ok(self)
        } else {
            let expected = Bound::Between { low: 0.0, high: 1.0 };
            Err(Error::Domain { parameter: "rc", index: None, expected, got: self.rc })
        }
    }
}
