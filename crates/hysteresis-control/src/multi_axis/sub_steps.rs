//! Several sub-steps of a sample as one linear step.

use nalgebra::DMatrix;

use super::model::MultiAxisStage;
use crate::as_f64;

/// One sample with slopes of the operators taken to the linear part:
///
/// ```text
/// x(k+1) = A x(k) + B u(k) + sum over sub-steps j of Bw_j v_j          v_j = w_j - slopes q_j
/// q_j    = Cq_j x(k) + Dq_j u(k) + sum over earlier ones i of through_ji v_i
/// ```
pub(super) struct Sample {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DMatrix<f64>,
    /// Bw_j side by side, n x (sub-steps h).
    pub(super) bw: DMatrix<f64>,
    /// Cq_j, one below the other.
    pub(super) cq: DMatrix<f64>,
    /// Dq_j, one below the other.
    pub(super) dq: DMatrix<f64>,
    /// All through_ji.
    pub(super) through: DMatrix<f64>,
}

/// How the operators act over a sample if they do the same in every sub-step, and what they see in the mean.
pub(super) struct Held {
    pub(super) bw: DMatrix<f64>,
    pub(super) cq: DMatrix<f64>,
    pub(super) dq: DMatrix<f64>,
}

impl MultiAxisStage {
    /// A sample with these slopes of the operators.
    pub(super) fn sample(&self, slopes: &[f64]) -> Sample {
        let matrices = self.matrices();
        let (a, b) = matrices.with_slopes(slopes);
        let (n, m, h, steps) = (a.nrows(), b.ncols(), slopes.len(), self.sub_steps());
        let mut sample = Sample {
            a: DMatrix::identity(n, n),
            b: DMatrix::zeros(n, m),
            bw: DMatrix::zeros(n, steps * h),
            cq: DMatrix::zeros(steps * h, n),
            dq: DMatrix::zeros(steps * h, m),
            through: DMatrix::zeros(steps * h, steps * h),
        };
        for step in 0..steps {
            // What enters in the last sub-step is there at once.
            sample.bw.columns_mut((steps - 1 - step) * h, h).copy_from(&(&sample.a * &matrices.bw));
            sample.cq.rows_mut(step * h, h).copy_from(&(&matrices.cq * &sample.a));
            sample.dq.rows_mut(step * h, h).copy_from(&(&matrices.cq * &sample.b + &matrices.dq));
            let later = &matrices.cq * &sample.a * &matrices.bw;
            for i in 0..steps - 1 - step {
                sample.through.view_mut(((i + 1 + step) * h, i * h), (h, h)).copy_from(&later);
            }
            sample.b = &a * &sample.b + &b;
            sample.a = &a * &sample.a;
        }
        sample
    }
}

impl Sample {
    /// As if the operators did the same in every sub-step.
    pub(super) fn held(&self, operators: usize) -> Held {
        let (n, m) = self.b.shape();
        let mut held = Held {
            bw: DMatrix::zeros(n, operators),
            cq: DMatrix::zeros(operators, n),
            dq: DMatrix::zeros(operators, m),
        };
        let steps = self.bw.ncols() / operators.max(1);
        for step in 0..steps {
            held.bw += self.bw.columns(step * operators, operators);
            held.cq += self.cq.rows(step * operators, operators) / as_f64(steps);
            held.dq += self.dq.rows(step * operators, operators) / as_f64(steps);
        }
        held
    }
}
