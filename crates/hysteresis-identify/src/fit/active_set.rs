//! Least squares with bounds on the unknowns: the active-set method of Lawson and Hanson (Solving Least Squares Problems, 1974,
//! chapter 23), with two bounds as in Stark and Parker (1995).

/// |A x - b|^2, as the method asks for it.
pub(crate) trait SumOfSquares {
    /// A gradient below this share of |a_j| |b| is rounding.
    const GRADIENT_TOLERANCE: f64;

    /// |a_j|.
    fn column_norm(&self, j: usize) -> f64;

    /// |b|.
    fn size(&self) -> f64;

    /// The gradient a_j'(b - A x) of any unknown j: the sum falls where the unknown goes this way.
    fn downhill(&self, x: &[f64]) -> impl Fn(usize) -> f64;

    /// The values of the unknowns `free` at the minimum, the others being `held`, where the free ones are zero. Or the place of the
    /// first free one whose column depends on those before it.
    fn minimum_over(&self, free: &[usize], held: &[f64]) -> Result<Vec<f64>, usize>;
}

/// The x of the least sum over lower_j <= x_j <= upper_j. Unknowns that are not `free` at first are where `x` has them: at a bound, or
/// anywhere if they have none.
///
/// `free` names the unknowns that are expected between their bounds: a good guess (the answer of a neighbouring problem) saves most
/// of the work, a bad one changes nothing but the time. The answer satisfies the conditions of Karush, Kuhn and Tucker up to
/// rounding; where columns depend on each other it is one of several.
pub(crate) fn minimise(sum: &impl SumOfSquares, bounds: &[(f64, f64)], x: Vec<f64>, free: &[usize]) -> Vec<f64> {
    let mut search = Search { sum, bounds, x, free: free.to_vec() };
    search.start();
    // Every round lowers the sum, so no set of free unknowns comes back; the limit only guards against rounding.
    for _ in 0..10 * (bounds.len() + 1) {
        if !search.improve() {
            break;
        }
    }
    search.x
}

struct Search<'a, S> {
    sum: &'a S,
    bounds: &'a [(f64, f64)],
    x: Vec<f64>,
    /// The unknowns between their bounds, in the order of their release.
    free: Vec<usize>,
}

impl<S: SumOfSquares> Search<'_, S> {
    /// Goes to the minimum over the free unknowns, and binds those that depend on others or would leave their bounds.
    fn start(&mut self) {
        loop {
            match self.minimum_over_free() {
                Err(place) => {
                    self.free.remove(place);
                }
                Ok(target) => {
                    let before = self.free.len();
                    for (j, x) in std::mem::take(&mut self.free).into_iter().zip(target) {
                        let (lower, upper) = self.bounds[j];
                        self.x[j] = x.clamp(lower, upper);
                        if self.x[j] == x {
                            self.free.push(j);
                        }
                    }
                    if self.free.len() == before {
                        return;
                    }
                }
            }
        }
    }

    /// Releases the bound unknown that promises most and moves to the new minimum; false if none can be released.
    fn improve(&mut self) -> bool {
        for (downhill, j) in self.promising() {
            self.free.push(j);
            // Rounding alone made the gradient if the column depends on free ones, or if the unknown would at once
            // move out of its domain: Lawson and Hanson's guard against cycling.
            match self.minimum_over_free() {
                Ok(target) if (target[target.len() - 1] - self.x[j]) * downhill > 0.0 => {
                    self.descend(target);
                    return true;
                }
                _ => self.free.pop(),
            };
        }
        false
    }

    /// The gradients of the bound unknowns that may go downhill, and the unknowns, the most promising one first.
    fn promising(&self) -> Vec<(f64, usize)> {
        let (gradient, size) = (self.sum.downhill(&self.x), self.sum.size());
        let mut promising = Vec::new();
        for j in (0..self.x.len()).filter(|j| !self.free.contains(j)) {
            let (downhill, norm, (lower, upper)) = (gradient(j), self.sum.column_norm(j), self.bounds[j]);
            let admissible = if downhill > 0.0 { self.x[j] < upper } else { self.x[j] > lower };
            if admissible && downhill.abs() > S::GRADIENT_TOLERANCE * norm * size {
                promising.push((downhill.abs() / norm, downhill, j));
            }
        }
        promising.sort_by(|(p, ..), (q, ..)| q.total_cmp(p));
        promising.into_iter().map(|(_, downhill, j)| (downhill, j)).collect()
    }

    /// Moves towards the minimum over the free unknowns, binding what meets its bound on the way.
    fn descend(&mut self, mut target: Vec<f64>) {
        while let Some((step, place, bound)) = self.first_bound_met(&target) {
            for (j, target) in self.free.iter().zip(&target) {
                let (lower, upper) = self.bounds[*j];
                self.x[*j] = (self.x[*j] + step * (target - self.x[*j])).clamp(lower, upper);
            }
            self.x[self.free.remove(place)] = bound;
            // Fewer columns of an independent set are independent.
            let Ok(next) = self.minimum_over_free() else { return };
            target = next;
        }
        for (j, target) in self.free.iter().zip(target) {
            self.x[*j] = target;
        }
    }

    /// The share of the way to the target at which the first free unknown meets a bound, its place, and the bound.
    fn first_bound_met(&self, target: &[f64]) -> Option<(f64, usize, f64)> {
        let met = self.free.iter().zip(target).enumerate().filter_map(|(place, (j, target))| {
            let (lower, upper) = self.bounds[*j];
            let bound = target.clamp(lower, upper);
            (bound != *target).then(|| ((bound - self.x[*j]) / (target - self.x[*j]), place, bound))
        });
        met.min_by(|p, q| p.0.total_cmp(&q.0))
    }

    fn minimum_over_free(&self) -> Result<Vec<f64>, usize> {
        let mut held = self.x.clone();
        for j in &self.free {
            held[*j] = 0.0;
        }
        self.sum.minimum_over(&self.free, &held)
    }
}
