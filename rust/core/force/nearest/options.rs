//! Options of the forces that come nearest.

use crate::grasp::Grasp;
use crate::grasp::wrench_norm::Metric;

/// What [`ForceDistributor::nearest`](crate::ForceDistributor::nearest) measures the distance in, and whether forces keep
/// their upper bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestOptions<const D: usize> {
    /// The norm of the residual; `None` for that of the grasp's length scale.
    pub metric: Option<Metric<D>>,
    /// Whether normal forces keep their upper bounds.
    pub limits: bool,
}

impl<const D: usize> Default for NearestOptions<D> {
    fn default() -> Self {
        Self { metric: None, limits: true }
    }
}

impl<const D: usize> NearestOptions<D> {
    pub(crate) fn metric_of(&self, grasp: &Grasp<D>) -> Metric<D> {
        self.metric.unwrap_or_else(|| Metric::from_length_scale(grasp.options().length_scale))
    }
}
