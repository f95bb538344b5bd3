//! Coordinates of wrenches in which the dual of the least squares is as round as it can be.
//!
//! The map `T` has `T (sum_i G_i P_i G_i^T / weight_i) T^T = I`, where `P_i` projects onto the components that contact i
//! has. A price `S` of the residual adds `S^-1` to the sum. The matrix of Newton's method then lies between zero and the
//! identity, whatever the units, levers and weights are. A pivoted orthogonal basis comes first: it keeps the digits of
//! directions in which the contacts are weak.

use nalgebra::SMatrix;

use crate::grasp::wrench_norm::Metric;
use crate::grasp::{REPRESENTABLE, Wrench};
use crate::linalg::pivoted_basis::PivotedBasis;
use crate::tolerances::{RANK_TOLERANCE, ROUNDED_TORQUE};

/// The map `T`.
#[derive(Debug, Clone)]
pub(crate) struct Whitening<const D: usize> {
    pub(crate) map: SMatrix<f64, D, D>,
    /// Rows beyond this are zero for every wrench that the contacts can exert.
    pub(crate) rank: usize,
}

impl<const D: usize> Whitening<D> {
    /// Makes the sum of `w w^T` over the wrenches the identity, in the directions that they span. `arm` is the longest arm
    /// of any force: torques of forces through the origin are its rounding.
    pub(crate) fn new(wrenches: &[Wrench<D>], arm: f64) -> Self {
        let split = if D == 3 { 2 } else { 3 };
        let longest = |rows: std::ops::Range<usize>| {
            let largest = wrenches.iter().map(|w| w.rows_range(rows.clone()).norm()).fold(0.0, f64::max);
            if REPRESENTABLE.contains(&largest) { largest } else { 1.0 }
        };
        let (force, mut torque) = (longest(0..split), longest(split..D));
        if torque <= ROUNDED_TORQUE * force * arm {
            torque = force * arm;
        }
        let units = Wrench::<D>::from_fn(|row, _| if row < split { 1.0 / force } else { 1.0 / torque });
        let basis =
            PivotedBasis::new(wrenches.iter().map(|w| w.component_mul(&units)).collect(), RANK_TOLERANCE);
        let (map, rank) = (basis.map(&units), basis.rank);
        let mut gram = SMatrix::<f64, D, D>::identity();
        for r in 0..rank {
            for c in 0..rank {
                let terms = wrenches.iter().map(|w| (map.row(r) * w)[0] * (map.row(c) * w)[0]);
                gram[(r, c)] = terms.sum();
            }
        }
        // The pivots have kept it from being nearly singular.
        let whitened = gram.cholesky().and_then(|factor| factor.l_dirty().solve_lower_triangular(&map));
        Self { map: whitened.unwrap_or(map), rank }
    }

    /// Units in which a price of the residual is near one: powers of two, which round nothing.
    pub(crate) fn of_price(price: &Metric<D>) -> Self {
        let mut spread = Wrench::<D>::zeros();
        price.inverse_columns().for_each(|column| spread += column.component_mul(&column));
        let map = SMatrix::from_diagonal(&spread.map(|square| (-0.5 * square.log2()).round().exp2()));
        Self { map, rank: D }
    }

    /// `T w` of a wrench that contacts exert.
    pub(crate) fn wrench(&self, wrench: &Wrench<D>) -> Wrench<D> {
        let mut mapped = self.map * wrench;
        mapped.rows_range_mut(self.rank..).fill(0.0);
        mapped
    }
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
        let whitening = Whitening::new(&wrenches, 1.0);
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
