//! Singular values of the grasp matrix, from which the classical algebraic measures follow.

use nalgebra::{DMatrix, SVD};

use crate::grasp::Grasp;
use crate::grasp::wrench_norm::Metric;

/// Sweeps after which the decomposition would give up; a handful are needed.
const MAX_SWEEPS: usize = 10_000;

impl<const D: usize> Grasp<D> {
    /// The singular values of the grasp matrix `G` in the norm of the grasp's length scale, largest first.
    ///
    /// Empty where the decomposition does not converge, which no finite matrix is known to cause.
    pub fn singular_values(&self) -> Vec<f64> {
        let metric = Metric::<D>::from_length_scale(self.options().length_scale);
        let columns: Vec<_> = self
            .maps()
            .iter()
            .flat_map(|map| {
                self.force_components().iter().map(|&k| metric.to_euclidean(&map.column(k).into()))
            })
            .collect();
        let matrix = DMatrix::from_fn(D, columns.len(), |row, column| columns[column][row]);
        SVD::try_new(matrix, false, false, f64::EPSILON, MAX_SWEEPS)
            .map_or_else(Vec::new, |svd| svd.singular_values.as_slice().to_vec())
    }
}
