//! What is left of a history of inputs after Madelung's deletions.

/// The dominant extrema of an input that started at rest, the present input last.
///
/// Three deletions are enough, and each is exact, to the bit, for every operator z = max(lo(x), min(hi(x), z)) whose
/// lo <= hi never fall. Such an operator ends a rise to x at max(lo(x), z) and a fall to x at min(hi(x), z).
///
/// 1. Of a <= b <= c the middle one: max(lo(c), max(lo(b), z)) = max(lo(c), z).
/// 2. Of a <= c <= b <= d, the loop from b to c that closes inside the rise from a to d. From z <= hi(a) <= hi(c), the
///    loop makes min(hi(c), max(lo(b), z)), which is z, or lies between z and lo(b) <= lo(d): d is at max(lo(d), z)
///    with and without it.
/// 3. Of rest <= a, b, c with a <= c, the first extremum a. The operators rest at z = 0, so they reach a at 0 or, if
///    that is more, at lo(a). Where it is 0, a changed nothing. Where it is lo(a), z is at most lo(c) at b with a and
///    without it, so that c takes it to lo(c).
///
/// The same holds with all signs turned. What remains alternates, every swing shorter than the one before it.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// Where the input rested, then the extrema.
    inputs: Vec<f64>,
    longest: usize,
}

impl Reduced {
    /// The history of an input that has rested at `rest` for ever.
    #[must_use]
    pub fn from_rest(rest: f64) -> Self {
        Self { inputs: vec![rest], longest: 0 }
    }

    /// Takes the next input.
    pub fn push(&mut self, input: f64) {
        self.inputs.push(input);
        while self.delete() {}
        self.longest = self.longest.max(self.inputs.len() - 1);
    }

    /// The inputs that a stream at rest must see to remember what it would after the whole history.
    #[must_use]
    pub fn inputs(&self) -> &[f64] {
        &self.inputs[1..]
    }

    /// How many inputs were ever kept at a time.
    #[must_use]
    pub fn longest(&self) -> usize {
        self.longest
    }

    /// One deletion, if any is due.
    fn delete(&mut self) -> bool {
        let last = self.inputs.len() - 1;
        let gone = match self.inputs[..] {
            [.., a, b, c] if is_between(a, b, c) => last - 1..last,
            [.., a, b, c, d] if is_between(a, b, d) && is_between(a, c, d) => last - 2..last,
            [rest, a, _, c] if is_between(rest, a, c) => 1..2,
            _ => return false,
        };
        self.inputs.drain(gone);
        true
    }
}

/// Whether b lies between a and c, or is one of them.
fn is_between(a: f64, b: f64, c: f64) -> bool {
    a <= b && b <= c || a >= b && b >= c
}
