//! What is computed once for all wrenches that no forces balance.

use std::sync::Arc;

use crate::error::Result;
use crate::force::certificate::ContactForces;
use crate::force::nearest::options::NearestOptions;
use crate::force::nearest::wrench_projection::{Nearest, WrenchProjection};
use crate::force::program::{Program, Solver};
use crate::force::squares::options::SquaresOptions;
use crate::force::squares::program::SquaresProgram;
use crate::grasp::Grasp;

/// The projection, and the solver of the objective where that is another one than `solve` uses.
#[derive(Debug, Clone)]
pub(crate) struct NearestWorkspace<const D: usize> {
    pub(crate) projection: WrenchProjection<D>,
    /// What was found of the last wrench, if it is apart from what forces balance.
    pub(crate) apart: Option<Nearest<D>>,
    /// The first forces found, while others are looked for.
    pub(crate) kept: ContactForces,
    /// Least squares with limits that the objective does not have, or without its price of the residual.
    pub(crate) bounded: Option<Solver<D>>,
}

impl<const D: usize> NearestWorkspace<D> {
    /// `bounds` are the lower and the upper bounds of each contact's share.
    pub(crate) fn new(
        grasp: &Arc<Grasp<D>>,
        program: &Program<D>,
        bounds: &[(f64, f64)],
        options: &NearestOptions<D>,
    ) -> Result<Self> {
        let limits = options.limits;
        let projection = WrenchProjection::new(grasp, options.metric_of(grasp), limits, bounds);
        let bounded = match program.squares() {
            Some(squares) if squares.limits != limits || squares.slack.is_some() => {
                let squares = SquaresOptions { limits, slack: None, ..squares.clone() };
                Some(Solver::squares(Arc::new(SquaresProgram::new(grasp, &squares)?)))
            }
            _ => None,
        };
        let kept = ContactForces::new(grasp.num_contacts());
        Ok(Self { projection, apart: None, kept, bounded })
    }

    /// Forgets earlier wrenches.
    pub(crate) fn forget(&mut self) {
        self.projection.forget();
        self.apart = None;
        if let Some(solver) = &mut self.bounded {
            solver.forget();
        }
    }

    /// The options that it serves.
    pub(crate) fn options(&self) -> NearestOptions<D> {
        NearestOptions { metric: Some(self.projection.metric), limits: self.projection.limits }
    }

    pub(crate) fn serves(&self, grasp: &Grasp<D>, options: &NearestOptions<D>) -> bool {
        self.projection.metric == options.metric_of(grasp) && self.projection.limits == options.limits
    }
}
