//! What is computed once for all wrenches that no forces balance.

use std::sync::Arc;

use crate::error::Result;
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
        Ok(Self { projection, apart: None, bounded })
    }

    pub(crate) fn serves(&self, grasp: &Grasp<D>, options: &NearestOptions<D>) -> bool {
        self.projection.metric == options.metric_of(grasp) && self.projection.limits == options.limits
    }
}
