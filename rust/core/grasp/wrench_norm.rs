//! The norm in which quality is measured: `|w|_M^2 = w^T M w`.
//!
//! With `M = C^T C`, the map `w -> C w` turns it into the Euclidean norm, in which all geometry is done; a
//! direction `z` there measures physical wrenches as `C^T z`.

//!
//! **Hard metrics.** The factor is `C = D R P` with a permutation `P`, a diagonal `D` and a unit upper triangle `R` whose
//! entries are at most 1: Cholesky's with the largest pivot first. Rounding an entry of `C`, or of a product `C w`, is then
//! as harmless as rounding the wrench `w`, however far apart the entries of `D` lie. The factor itself loses
//! `condition(M)` times the unit of rounding, so it is computed in twice the precision.

use nalgebra::SMatrix;

use crate::error::{Error, Result};
use crate::grasp::exact_map::Wrench32;
use crate::grasp::{REPRESENTABLE, Wrench, unit};
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{INDEFINITE, ROUNDED_QUOTIENT};

/// A positive definite metric on wrenches, by its factor.
///
/// ```
/// use graspforce::{Metric, Wrench};
///
/// // Torques count half as much as forces of the same number.
/// let metric = Metric::<3>::from_length_scale(2.0);
/// assert_eq!(metric.norm(&Wrench::<3>::new(3.0, 0.0, 8.0)), 5.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metric<const D: usize> {
    factor: SMatrix<f64, D, D>,
    inverse: SMatrix<f64, D, D>,
    /// Whether both are diagonal.
    diagonal: bool,
}

impl<const D: usize> Metric<D> {
    /// `|w|^2 = |f|^2 + |tau|^2 / L^2`.
    pub fn from_length_scale(length_scale: f64) -> Self {
        let forces = if D == 3 { 2 } else { 3 };
        let diagonal = |torque: f64| {
            SMatrix::from_diagonal(&Wrench::from_fn(|row, _| if row < forces { 1.0 } else { torque }))
        };
        Self { factor: diagonal(length_scale.recip()), inverse: diagonal(length_scale), diagonal: true }
    }

    /// The metric of a symmetric positive definite matrix.
    pub fn from_matrix(matrix: &SMatrix<f64, D, D>) -> Result<Self> {
        let scale = matrix.amax();
        let mut entries = (0..D * D).map(|k| (k / D, k % D));
        if let Some((row, column)) = entries.find(|&at| !matrix[at].is_finite()) {
            let reason = format!("entry ({row}, {column}) is {}, not finite", matrix[(row, column)]);
            return Err(Error::input("metric", reason));
        }
        if (matrix - matrix.transpose()).amax() > 1e-9 * scale {
            return Err(Error::input("metric", "it is not symmetric"));
        }
        let symmetric = (matrix + matrix.transpose()) * 0.5;
        let not_definite = || Error::input("metric", "it is not positive definite");
        let (factor, inverse) = factors(&symmetric).ok_or_else(not_definite)?;
        if inverse.iter().chain(factor.iter()).any(|x| !x.is_finite()) {
            return Err(not_definite());
        }
        let sizes = [factor.amax(), inverse.amax()];
        if !sizes.iter().all(|size| REPRESENTABLE.contains(size)) {
            let reason = format!("its entries of {scale:e} lie outside 1e-140 to 1e140; check the units");
            return Err(Error::input("metric", reason));
        }
        Ok(Self { factor, inverse, diagonal: false })
    }

    /// `|w|_M`.
    pub fn norm(&self, wrench: &Wrench<D>) -> f64 {
        (self.factor * wrench).norm()
    }

    /// `C w`: where Euclidean geometry sees the physical wrench `w`, or each of several side by side.
    #[inline]
    pub(crate) fn to_euclidean<const N: usize>(self, wrenches: &SMatrix<f64, D, N>) -> SMatrix<f64, D, N> {
        if self.diagonal {
            return SMatrix::from_fn(|row, column| self.factor[(row, row)] * wrenches[(row, column)]);
        }
        self.factor * wrenches
    }

    /// `C^-1 w`: the inverse of [`Self::to_euclidean`].
    pub(crate) fn to_physical(self, wrench: &Wrench<D>) -> Wrench<D> {
        self.inverse * wrench
    }

    /// `C^-T A C^T`: the map of Euclidean directions that does what `A` does to functionals on physical wrenches.
    pub(crate) fn conjugate(&self, map: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        self.inverse.tr_mul(map) * self.factor.transpose()
    }

    /// `C^T z`: the functional on physical wrenches that is `z` on Euclidean ones.
    pub(crate) fn functional(&self, z: &Wrench<D>) -> Wrench<D> {
        self.factor.tr_mul(z)
    }

    /// `C^-T y` for functionals `y` on physical wrenches, side by side: what they are on Euclidean ones.
    pub(crate) fn functionals_to_euclidean<const N: usize>(
        &self,
        functionals: &SMatrix<f64, D, N>,
    ) -> SMatrix<f64, D, N> {
        self.inverse.tr_mul(functionals)
    }

    /// No less than the size of the terms of [`Self::functionals_to_euclidean`].
    pub(crate) fn size_of_functionals<const N: usize>(&self, functionals: &SMatrix<f64, D, N>) -> f64 {
        self.inverse.abs().tr_mul(&functionals.abs()).norm()
    }

    /// The rows of `A C`, without rounding.
    pub(crate) fn exact_rows(&self, matrix: &SMatrix<f64, D, D>) -> [Wrench32<D>; D] {
        let product = |row: usize, column: usize| {
            let terms = (0..D).map(|k| DoubleDouble::from(matrix[(row, k)]).times(self.factor[(k, column)]));
            terms.fold(DoubleDouble::ZERO, |sum, term| sum + term)
        };
        std::array::from_fn(|row| std::array::from_fn(|column| product(row, column)))
    }

    /// By what part of it rounding of the factor `C` may change a norm: `C' C^-1` is the identity up to this.
    pub(crate) fn rounding(&self) -> f64 {
        ROUNDED_QUOTIENT * (self.factor.abs() * self.inverse.abs()).norm()
    }

    /// The unit direction `z` whose functional is parallel to `functional`.
    pub(crate) fn unit_of_functional(&self, functional: &Wrench<D>) -> Wrench<D> {
        unit(&self.functionals_to_euclidean(functional))
    }

    /// `|C| w` for a wrench of magnitudes: what `C` makes of a bound on every component.
    pub(crate) fn magnitude(&self, wrench: &Wrench<D>) -> Wrench<D> {
        if self.diagonal {
            return Wrench::from_fn(|row, _| self.factor[(row, row)].abs() * wrench[row]);
        }
        self.factor.abs() * wrench
    }

    /// `|C A|_F` for the linear map whose columns are these wrenches.
    pub(crate) fn size_of_columns(&self, columns: impl Iterator<Item = Wrench<D>>) -> f64 {
        columns.map(|column| (self.factor * column).norm_squared()).sum::<f64>().sqrt()
    }

    /// The columns of `C^-1`.
    pub(crate) fn inverse_columns(&self) -> impl Iterator<Item = Wrench<D>> {
        self.inverse.column_iter().map(nalgebra::Matrix::into_owned)
    }
}

/// `C` with `C^T C = matrix`, rows in descending order of their size, and its inverse; `None` where the matrix is not
/// positive definite.
fn factors<const D: usize>(matrix: &SMatrix<f64, D, D>) -> Option<(SMatrix<f64, D, D>, SMatrix<f64, D, D>)> {
    let mut rest: [[DoubleDouble; D]; D] =
        std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)].into()));
    let mut order: [usize; D] = std::array::from_fn(|k| k);
    // In the order of the pivots: an upper triangle.
    let mut upper = [[DoubleDouble::ZERO; D]; D];
    for step in 0..D {
        let left = |k: &usize| rest[order[*k]][order[*k]].value();
        let pivot = (step..D).max_by(|a, b| left(a).total_cmp(&left(b)))?;
        for row in upper.iter_mut().take(step) {
            row.swap(step, pivot);
        }
        order.swap(step, pivot);
        let at = order[step];
        if matrix[(at, at)] <= 0.0 {
            return None;
        }
        let diagonal = rest[at][at];
        if diagonal.value() <= INDEFINITE * matrix[(at, at)] {
            return None;
        }
        let root = diagonal.sqrt();
        for k in step..D {
            upper[step][k] = rest[at][order[k]] / root;
        }
        for j in step + 1..D {
            for k in step + 1..D {
                rest[order[j]][order[k]] -= upper[step][j] * upper[step][k];
            }
        }
    }
    let mut factor = SMatrix::zeros();
    let mut inverse = SMatrix::zeros();
    for column in 0..D {
        // Column by column: back substitution of a unit vector.
        let mut solved = [DoubleDouble::ZERO; D];
        for row in (0..=column).rev() {
            let mut right = DoubleDouble::from(f64::from(u8::from(row == column)));
            for k in row + 1..=column {
                right -= upper[row][k] * solved[k];
            }
            solved[row] = right / upper[row][row];
        }
        for row in 0..D {
            factor[(row, order[column])] = upper[row][column].value();
            inverse[(order[row], column)] = solved[row].value();
        }
    }
    Some((factor, inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_exact_where_the_matrix_is_all_but_singular() {
        // The Hilbert matrix of order 6, whose condition is 1.5e7, squared by its own grading to 1e19.
        let grade = Wrench::<6>::from_fn(|row, _| 8.0_f64.powi(-(row as i32)));
        let hilbert = SMatrix::<f64, 6, 6>::from_fn(|r, c| grade[r] * grade[c] / (r + c + 1) as f64);
        let metric = Metric::from_matrix(&hilbert).unwrap();
        let product = metric.factor * metric.inverse;
        assert!((product - SMatrix::identity()).amax() < 1e-9, "{product}");
        let again = metric.factor.tr_mul(&metric.factor);
        for (a, b) in again.iter().zip(hilbert.iter()) {
            assert!((a / b - 1.0).abs() < 1e-14, "{again} {hilbert}");
        }
        assert!(Metric::from_matrix(&SMatrix::<f64, 3, 3>::repeat(1.0)).is_err());
    }
}
