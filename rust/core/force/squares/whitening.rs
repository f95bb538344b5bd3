//! Coordinates of wrenches in which the dual of the least squares is as round as it can be.
//!
//! With `T sum_i (G_i P_i G_i^T / weight_i) T^T = I` (with a price `S` of what stays unbalanced: `+ T S^-1 T^T`) the matrix
//! of Newton's method lies between zero and the identity, whatever the units, levers and weights are. `P_i` projects
//! onto the components that contact i has. A pivoted orthogonalisation goes first: it keeps the digits of
//! directions in which the contacts are weak.

use nalgebra::SMatrix;

use crate::grasp::{REPRESENTABLE, Wrench};
use crate::tolerances::RANK_TOLERANCE;

/// The map `T`.
#[derive(Debug, Clone)]
pub(crate) struct Whitening<const D: usize> {
    pub(crate) map: SMatrix<f64, D, D>,
    /// Rows beyond this are zero for every wrench that the contacts can exert.
    pub(crate) rank: usize,
}

impl<const D: usize> Whitening<D> {
    /// Makes the sum of `w w^T` over the wrenches the identity, in the directions that they span.
    pub(crate) fn new(wrenches: &[Wrench<D>]) -> Self {
        let split = if D == 3 { 2 } else { 3 };
        let longest = |rows: std::ops::Range<usize>| {
            let largest = wrenches.iter().map(|w| w.rows_range(rows.clone()).norm()).fold(0.0, f64::max);
            if REPRESENTABLE.contains(&largest) { largest } else { 1.0 }
        };
        let (force, torque) = (longest(0..split), longest(split..D));
        let units = Wrench::<D>::from_fn(|row, _| if row < split { 1.0 / force } else { 1.0 / torque });
        let mut rest: Vec<_> = wrenches.iter().map(|w| w.component_mul(&units)).collect();
        let mut axes = SMatrix::<f64, D, D>::zeros();
        let mut map = SMatrix::<f64, D, D>::zeros();
        let mut rank = 0;
        while rank < D {
            let lengths = rest.iter().map(Wrench::norm).enumerate();
            let Some((strongest, length)) = lengths.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if length <= RANK_TOLERANCE {
                break;
            }
            let mut axis = rest[strongest] / length;
            axis -= axes * axes.tr_mul(&axis);
            let axis = axis.normalize();
            axes.set_column(rank, &axis);
            map.set_row(rank, &(axis.component_mul(&units) / length).transpose());
            for wrench in &mut rest {
                *wrench -= axis * axis.dot(wrench);
            }
            rank += 1;
        }
        for k in rank..D {
            let axis = complement(&axes);
            axes.set_column(k, &axis);
            map.set_row(k, &axis.component_mul(&units).transpose());
        }
        let mut gram = SMatrix::<f64, D, D>::identity();
        for r in 0..rank {
            for c in 0..rank {
                let terms = wrenches.iter().map(|w| (map.row(r) * w)[0] * (map.row(c) * w)[0]);
                gram[(r, c)] = terms.sum();
            }
        }
        // The inverse of its Cholesky factor; the pivots have kept it from being nearly singular.
        if let Some(factor) = cholesky(&gram) {
            for column in 0..D {
                let solved = forward(&factor, &map.column(column).into_owned());
                map.set_column(column, &solved);
            }
        }
        Self { map, rank }
    }

    /// `T w` of a wrench that contacts exert.
    pub(crate) fn wrench(&self, wrench: &Wrench<D>) -> Wrench<D> {
        let mut mapped = self.map * wrench;
        mapped.rows_range_mut(self.rank..).fill(0.0);
        mapped
    }
}

/// The lower factor `L` with `L L^T = matrix`; `None` where a pivot is not positive.
fn cholesky<const D: usize>(matrix: &SMatrix<f64, D, D>) -> Option<SMatrix<f64, D, D>> {
    let mut factor = *matrix;
    for k in 0..D {
        for j in 0..k {
            let by = factor[(k, j)];
            for r in k..D {
                factor[(r, k)] -= factor[(r, j)] * by;
            }
        }
        let pivot = factor[(k, k)];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let inverse = pivot.sqrt().recip();
        for r in k..D {
            factor[(r, k)] *= inverse;
        }
    }
    Some(factor)
}

/// `L^-1 w`.
fn forward<const D: usize>(factor: &SMatrix<f64, D, D>, right: &Wrench<D>) -> Wrench<D> {
    let mut solved = *right;
    for k in 0..D {
        solved[k] /= factor[(k, k)];
        for r in k + 1..D {
            solved[r] -= factor[(r, k)] * solved[k];
        }
    }
    solved
}

/// A unit vector orthogonal to the columns set so far; the others are zero.
fn complement<const D: usize>(axes: &SMatrix<f64, D, D>) -> Wrench<D> {
    let mut best = Wrench::zeros();
    for k in 0..D {
        let mut axis = Wrench::<D>::zeros();
        axis[k] = 1.0;
        for _ in 0..2 {
            axis -= axes * axes.tr_mul(&axis);
        }
        if axis.norm_squared() > Wrench::norm_squared(&best) {
            best = axis;
        }
    }
    best.normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weak_directions_are_as_long_as_strong_ones() {
        let wrenches: Vec<_> = (0..9)
            .map(|k| {
                let x = f64::from(k);
                Wrench::<6>::new(
                    x.sin(),
                    1e-9 * x.cos(),
                    (2.0 * x).sin(),
                    1e3 * (3.0 * x).cos(),
                    1e-4 * x,
                    0.0,
                )
            })
            .collect();
        let whitening = Whitening::new(&wrenches);
        assert_eq!(whitening.rank, 5);
        let mut sum = SMatrix::<f64, 6, 6>::zeros();
        for wrench in &wrenches {
            let mapped = whitening.wrench(wrench);
            sum += mapped * mapped.transpose();
        }
        sum[(5, 5)] += 1.0;
        assert!((sum - SMatrix::identity()).amax() < 1e-6, "{sum}");
    }
}
