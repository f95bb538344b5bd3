//! An orthonormal basis of what vectors span, the longest rest first: it keeps the digits of weak directions.

use nalgebra::{SMatrix, SVector};

/// Orthonormal axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PivotedBasis<const D: usize> {
    axes: SMatrix<f64, D, D>,
    /// How far the vectors reach along each axis when it is chosen; 1 along those that they do not span.
    pub(crate) lengths: SVector<f64, D>,
    /// The first `rank` axes span the vectors.
    pub(crate) rank: usize,
}

impl<const D: usize> PivotedBasis<D> {
    /// Rests of a length up to `smallest` count as zero.
    pub(crate) fn new(mut rest: Vec<SVector<f64, D>>, smallest: f64) -> Self {
        let mut axes = SMatrix::<f64, D, D>::zeros();
        let mut lengths = SVector::repeat(1.0);
        let mut rank = 0;
        while rank < D {
            let (strongest, length) = longest(&rest);
            if length <= smallest {
                break;
            }
            // The second projection removes what the first left when almost all of the vector was cancelled.
            let mut axis = rest[strongest] / length;
            axis -= axes * axes.tr_mul(&axis);
            let axis = axis.normalize();
            axes.set_column(rank, &axis);
            lengths[rank] = length;
            for vector in &mut rest {
                *vector -= axis * axis.dot(vector);
            }
            rank += 1;
        }
        for k in rank..D {
            let axis = complement(&axes);
            axes.set_column(k, &axis);
        }
        Self { axes, lengths, rank }
    }

    /// The map to coordinates along the axes, divided by their lengths, of vectors that `units` are multiplied to first.
    pub(crate) fn map(&self, units: &SVector<f64, D>) -> SMatrix<f64, D, D> {
        SMatrix::from_fn(|row, column| self.axes[(column, row)] * units[column] / self.lengths[row])
    }
}

fn longest<const D: usize>(vectors: &[SVector<f64, D>]) -> (usize, f64) {
    let lengths = vectors.iter().map(SVector::norm).enumerate();
    lengths.fold((0, 0.0), |best, (i, length)| if length > best.1 { (i, length) } else { best })
}

/// A unit vector orthogonal to the columns set so far; the others are zero.
fn complement<const D: usize>(axes: &SMatrix<f64, D, D>) -> SVector<f64, D> {
    let mut best = SVector::zeros();
    for k in 0..D {
        let mut axis = SVector::<f64, D>::zeros();
        axis[k] = 1.0;
        axis -= axes * axes.tr_mul(&axis);
        axis -= axes * axes.tr_mul(&axis);
        if axis.norm_squared() > SVector::norm_squared(&best) {
            best = axis;
        }
    }
    best.normalize()
}
