//! What is minimised, with its program, and the solver of that program.

use std::sync::Arc;

use crate::error::Result;
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::share_program::{ShareProgram, ShareSolver};
use crate::force::squares::options::SquaresOptions;
use crate::force::squares::program::{SquaresProgram, SquaresWorkspace};
use crate::grasp::Wrench;
use crate::grasp::contact::{ContactForce, write_components};
use crate::wrench_set::Criterion;

/// An objective and its program.
#[derive(Debug, Clone)]
pub(crate) enum Program<const D: usize> {
    /// The maximum or the sum of the shares.
    Shares(Criterion, ShareProgram<D>),
    /// The weighted sum of squares.
    Squares(Box<SquaresOptions<D>>, Arc<SquaresProgram<D>>),
}

/// A program with the memory that belongs to it.
#[derive(Debug, Clone)]
pub(crate) enum Solver<const D: usize> {
    Shares(ShareSolver<D>),
    Squares(Arc<SquaresProgram<D>>, SquaresWorkspace<D>),
}

impl<const D: usize> Program<D> {
    /// The criterion; `None` for least squares.
    pub(crate) fn criterion(&self) -> Option<Criterion> {
        if let Self::Shares(criterion, _) = self { Some(*criterion) } else { None }
    }

    /// The options of least squares; `None` for other objectives.
    pub(crate) fn squares(&self) -> Option<&SquaresOptions<D>> {
        if let Self::Squares(options, _) = self { Some(options) } else { None }
    }

    /// Whether forces may be wanted even if no wrench has to be balanced.
    pub(crate) fn presses_at_zero(&self) -> bool {
        match self {
            Self::Shares(_, program) => program.has_lower_bounds(),
            Self::Squares(..) => true,
        }
    }

    /// The objective of these forces, whose largest share and sum of shares these are.
    pub(crate) fn value(&self, forces: &[ContactForce], (largest, sum): (f64, f64), weight: f64) -> f64 {
        match self {
            Self::Shares(Criterion::Sum, _) => sum,
            Self::Shares(Criterion::Max, _) => largest + weight * sum,
            Self::Squares(_, program) => program.dual.objective(forces),
        }
    }
}

impl<const D: usize> Solver<D> {
    pub(crate) fn new(program: &Program<D>) -> Self {
        match program {
            Program::Shares(_, program) => Self::Shares(ShareSolver::new(program)),
            Program::Squares(_, program) => Self::squares(Arc::clone(program)),
        }
    }

    pub(crate) fn squares(program: Arc<SquaresProgram<D>>) -> Self {
        Self::Squares(program, SquaresWorkspace::new())
    }

    pub(crate) fn forget(&mut self) {
        match self {
            Self::Shares(solver) => solver.forget(),
            Self::Squares(_, workspace) => workspace.forget(),
        }
    }

    /// Leaves least forces for `b = -w_ext` in `forces`, whose components these are.
    pub(crate) fn solve(
        &mut self,
        b: &Wrench<D>,
        components: &[usize],
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        match self {
            Self::Shares(solver) => solver.solve(b, components, forces),
            Self::Squares(program, workspace) => program.solve(workspace, b, forces),
        }
    }

    /// The same without the last resorts of least squares, which tell why no forces balance a wrench.
    pub(crate) fn solve_once(
        &mut self,
        b: &Wrench<D>,
        components: &[usize],
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        match self {
            Self::Squares(program, workspace) => program.solve_once(workspace, b, forces),
            Self::Shares(_) => self.solve(b, components, forces),
        }
    }

    /// The same with the last resorts of least squares, but for those that leave some of the wrench.
    pub(crate) fn solve_in_doubles(
        &mut self,
        b: &Wrench<D>,
        components: &[usize],
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        match self {
            Self::Squares(program, workspace) => {
                program.solve_in_doubles(workspace, b, forces).map_err(|unsolved| unsolved.error)
            }
            Self::Shares(_) => self.solve(b, components, forces),
        }
    }

    /// Writes the components as rows, and returns the objective. Over listed extreme forces `forces` stays behind.
    pub(crate) fn solve_into(
        &mut self,
        b: &Wrench<D>,
        components: &[usize],
        forces: &mut ContactForces,
        rows: &mut [f64],
    ) -> Result<f64> {
        if let Self::Shares(ShareSolver::Linear(program, workspace)) = self {
            let (region, _) = program.locate(workspace, b, forces)?;
            region.write(b, rows);
            return Ok(region.dual.dot(b));
        }
        let certificate = self.solve(b, components, forces)?;
        forces.gap = certificate.gap;
        write_components(&forces.forces, components, rows);
        Ok(certificate.sigma)
    }

    /// The largest share of the last solve and the sum of its shares.
    pub(crate) fn totals(&self, b: &Wrench<D>, forces: &ContactForces) -> (f64, f64) {
        if let Self::Shares(solver) = self { solver.totals(b, forces) } else { forces.totals() }
    }

    /// The relative gap of the last [`Self::solve_into`].
    pub(crate) fn gap(&self, b: &Wrench<D>, forces: &ContactForces) -> f64 {
        match self {
            Self::Shares(ShareSolver::Linear(_, workspace)) => workspace.latest().proof(b).1,
            _ => forces.gap,
        }
    }

    /// Starts from the last basis of another solver, if both number the same extreme forces in the same way, or from its last
    /// multiplier.
    pub(crate) fn adopt(&mut self, other: &Self) {
        match (self, other) {
            (
                Self::Shares(ShareSolver::Linear(program, workspace)),
                Self::Shares(ShareSolver::Linear(before, last)),
            ) if program.matches(before) => program.adopt(workspace, last),
            (Self::Squares(program, workspace), Self::Squares(before, last)) => {
                program.adopt(workspace, before, last);
            }
            _ => {}
        }
    }
}
