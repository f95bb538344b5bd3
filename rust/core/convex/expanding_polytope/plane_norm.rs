//! The norm of planes that ranks the facets of the expanding polytope.
//!
//! The distance of a plane `y . x = 1` from the origin is `1 / |y|`. Where the coordinates are not those in which
//! distances are measured but `x = T w`, the plane measures `w` as `T^T y`, so the distance is `1 / |T^T y|`.
//! The largest of several such norms is the norm of the smallest set that holds all of their balls.

use nalgebra::SMatrix;

use crate::grasp::Wrench;
use crate::tolerances::ROUNDED_QUOTIENT;
use crate::wrench_set::Support;

/// `|y|`, or the largest `|N y|` of regular matrices `N`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PlaneNorm<const D: usize> {
    /// The coordinates are those in which distances are measured.
    Euclidean,
    /// All `N`, and the size of the terms that the entries of one were computed from.
    Through(Vec<SMatrix<f64, D, D>>, f64),
}

impl<const D: usize> PlaneNorm<D> {
    /// The norm of a plane whose Euclidean length is known.
    #[inline]
    pub(crate) fn of(&self, plane: &Wrench<D>, length: f64) -> f64 {
        match self {
            Self::Euclidean => length,
            Self::Through(matrices, _) => {
                matrices.iter().map(|matrix| (matrix * plane).norm_squared()).fold(0.0, f64::max).sqrt()
            }
        }
    }

    /// The next direction of the norm 1 on the way downhill from `z` as if the least support value were `target`.
    pub(crate) fn downhill(&self, support: &Support<D>, z: &Wrench<D>, target: f64) -> Option<Wrench<D>> {
        let Self::Through(matrices, _) = self else { return support.downhill(z, target) };
        let images = matrices.iter().map(|matrix| (matrix, matrix * z));
        let (matrix, image) =
            images.max_by(|(_, a), (_, b)| a.norm_squared().total_cmp(&b.norm_squared()))?;
        let next = support.step_downhill(z, &matrix.tr_mul(&image), target)?;
        let next = next / self.of(&next, next.norm());
        next.iter().all(|x| x.is_finite()).then_some(next)
    }

    /// What rounding may have taken from [`Self::of`], beside a few roundings of itself.
    #[inline]
    pub(crate) fn lost(&self, length: f64) -> f64 {
        match self {
            Self::Euclidean => 0.0,
            Self::Through(_, size) => ROUNDED_QUOTIENT * size * length,
        }
    }
}
