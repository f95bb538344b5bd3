//! The norm in which quality is measured: `|w|_M^2 = w^T M w`.
//!
//! With `M = C^T C`, the map `w -> C w` turns it into the Euclidean norm, in which all geometry is done; a
//! direction `z` there measures physical wrenches as `C^T z`.

use nalgebra::{Cholesky, SMatrix};

use crate::error::{Error, Result};
use crate::grasp::{REPRESENTABLE, Wrench, unit};

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
}

impl<const D: usize> Metric<D> {
    /// `|w|^2 = |f|^2 + |tau|^2 / L^2`.
    pub fn from_length_scale(length_scale: f64) -> Self {
        let forces = if D == 3 { 2 } else { 3 };
        let diagonal = |torque: f64| {
            SMatrix::from_diagonal(&Wrench::from_fn(|row, _| if row < forces { 1.0 } else { torque }))
        };
        Self { factor: diagonal(length_scale.recip()), inverse: diagonal(length_scale) }
    }

    /// The metric of a symmetric positive definite matrix.
    pub fn from_matrix(matrix: &SMatrix<f64, D, D>) -> Result<Self> {
        let scale = matrix.amax();
        if matrix.iter().any(|x| !x.is_finite()) {
            return Err(Error::input("metric", "it has an entry that is not finite"));
        }
        if (matrix - matrix.transpose()).amax() > 1e-9 * scale {
            return Err(Error::input("metric", "it is not symmetric"));
        }
        let symmetric = (matrix + matrix.transpose()) * 0.5;
        let not_definite = || Error::input("metric", "it is not positive definite");
        let lower = Cholesky::new(symmetric).ok_or_else(not_definite)?.l();
        let inverse = lower.solve_lower_triangular(&SMatrix::identity()).ok_or_else(not_definite)?;
        if inverse.iter().chain(lower.iter()).any(|x| !x.is_finite()) {
            return Err(not_definite());
        }
        let sizes = [lower.amax(), inverse.amax()];
        if !sizes.iter().all(|size| REPRESENTABLE.contains(size)) {
            let reason = format!("its entries of {scale:e} are beyond what can be computed with");
            return Err(Error::input("metric", reason));
        }
        Ok(Self { factor: lower.transpose(), inverse: inverse.transpose() })
    }

    /// `|w|_M`.
    pub fn norm(&self, wrench: &Wrench<D>) -> f64 {
        (self.factor * wrench).norm()
    }

    /// `C w`: where Euclidean geometry sees the physical wrench `w`, or each of several side by side.
    pub(crate) fn to_euclidean<const N: usize>(self, wrenches: &SMatrix<f64, D, N>) -> SMatrix<f64, D, N> {
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

    /// The unit direction `z` whose functional is parallel to `functional`.
    pub(crate) fn unit_of_functional(&self, functional: &Wrench<D>) -> Wrench<D> {
        unit(&self.inverse.tr_mul(functional))
    }
}
