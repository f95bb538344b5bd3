//! How quality is asked for, what comes back with its certificate, and the memory that is reused in between.

use std::ops::RangeInclusive;

use crate::convex::expanding_polytope::Polytope;
use crate::error::{Error, Result, digits};
use crate::grasp::Wrench;
use crate::grasp::wrench_norm::Metric;
use crate::quality::closure::Closure;
use crate::wrench_set::Criterion;

/// Bounds on the work that can be asked for: the largest polytope takes some 20 GB.
const MAX_FACETS: RangeInclusive<usize> = 100..=100_000_000;

/// How quality is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QualityOptions<const D: usize> {
    /// Which measure of the overall contact force is limited.
    pub criterion: Criterion,
    /// Relative width of the bracket; `None` for 1e-9, or 1e-6 where a contact has its true cone.
    pub rtol: Option<f64>,
    /// An external wrench that acts all the time, such as the weight: `epsilon` is then the largest disturbance
    /// that can be resisted on top of it. The set includes the origin.
    pub external_wrench: Option<Wrench<D>>,
    /// The norm of wrenches; `None` for the grasp's length scale.
    pub metric: Option<Metric<D>>,
    /// Facets of the polytope at most; `None` for [`DEFAULT_MAX_FACETS`](crate::DEFAULT_MAX_FACETS).
    /// Only grasps that are nearly as weak along a continuum of directions need more. `python benches/facets.py` prints
    /// what they cost.
    pub max_facets: Option<usize>,
}

impl<const D: usize> QualityOptions<D> {
    /// The default questions about a criterion.
    pub fn new(criterion: Criterion) -> Self {
        Self { criterion, rtol: None, external_wrench: None, metric: None, max_facets: None }
    }

    /// Refuses a tolerance outside (0, 1), an `external_wrench` that is not finite, and a `max_facets` outside its
    /// range.
    pub fn check(&self) -> Result<()> {
        if let Some(rtol) = self.rtol
            && !(rtol > 0.0 && rtol < 1.0)
        {
            return Err(Error::input("rtol", format!("{} must lie between 0 and 1", digits(rtol))));
        }
        if let Some(external_wrench) = &self.external_wrench
            && external_wrench.iter().any(|x| !x.is_finite())
        {
            return Err(Error::input(
                "external_wrench",
                format!("{:?} is not finite", external_wrench.as_slice()),
            ));
        }
        if let Some(facets) = self.max_facets
            && !MAX_FACETS.contains(&facets)
        {
            let (least, most) = (MAX_FACETS.start(), MAX_FACETS.end());
            return Err(Error::input("max_facets", format!("{facets} must lie between {least} and {most}")));
        }
        Ok(())
    }
}

/// The quality of a grasp, with its certificate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality<const D: usize> {
    /// `-epsilon`, as far as it is proven: `upper`, but zero for partial closure. Negative for force closure, positive
    /// outside.
    pub rho: f64,
    /// `lower <= rho`.
    pub lower: f64,
    /// `rho <= upper`.
    pub upper: f64,
    /// Whether the bracket is as narrow as asked for, or as rounding allows; if not, the search made `max_facets`
    /// facets, or rounding stopped it.
    pub converged: bool,
    /// The class of the grasp itself, whatever the `external_wrench`.
    pub closure: Closure,
    /// The worst direction, a physical wrench of unit norm: a disturbance is hardest to resist along its
    /// opposite. Where `rho >= 0` the grasp exerts no wrench that points along it, but for rounding.
    pub direction: Wrench<D>,
    /// The nearest boundary wrench, `-rho * direction`.
    pub wrench: Wrench<D>,
    /// Calls of the support oracle.
    pub supports: usize,
    /// Facets made on the way; zero where the answer did not need a polytope.
    pub facets: usize,
    /// The norm in which all this is measured.
    pub metric: Metric<D>,
}

/// The memory of quality computations, to be reused: after a few grasps it no longer allocates.
#[derive(Debug, Clone)]
pub struct QualityWorkspace<const D: usize> {
    /// Of the set itself.
    pub(crate) polytope: Polytope<D>,
    /// Of the scaled grasp by which closure is decided, so that the set's is still there afterwards.
    pub(crate) scaled: Polytope<D>,
    /// Whether the last answer came from the symmetries of the set, and so from another polytope.
    pub(crate) symmetric: bool,
}

impl<const D: usize> Quality<D> {
    /// The exact `epsilon` is at least this.
    pub fn epsilon_lower(&self) -> f64 {
        0.0 - self.upper
    }

    /// The exact `epsilon` is at most this.
    pub fn epsilon_upper(&self) -> f64 {
        0.0 - self.lower
    }
}

impl<const D: usize> Default for QualityWorkspace<D> {
    fn default() -> Self {
        Self { polytope: Polytope::new(), scaled: Polytope::new(), symmetric: false }
    }
}
