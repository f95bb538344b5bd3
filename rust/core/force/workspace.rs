//! The buffers in which a distributor solves, with the bases and critical regions of earlier wrenches.

use std::sync::Arc;

use crate::error::Result;
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::limits::LimitedWorkspace;
use crate::force::linear_cones::program::{LinearProgram, LinearWorkspace};
use crate::force::nearest::answer::NearestMemory;
use crate::force::preload::program::{PreloadProgram, PreloadWorkspace};
use crate::force::squares::program::{SquaresProgram, SquaresWorkspace};
use crate::force::true_cones::program::{ConeProgram, ConeWorkspace};
use crate::grasp::{Grasp, Wrench};

/// The memory of a [`ForceDistributor`](crate::ForceDistributor): buffers, and the bases and regions of earlier
/// wrenches, from which the next solve starts.
///
/// [`ForceDistributor::workspace`](crate::ForceDistributor::workspace) creates it. A distributor that is given the
/// workspace of another one replaces it by a new one of its own. The answers do not depend on what it remembers.
#[derive(Debug, Clone)]
pub struct ForceWorkspace<const D: usize> {
    /// Belongs to one distributor and its clones.
    grasp: Arc<Grasp<D>>,
    pub(crate) solver: Solver<D>,
    pub(crate) forces: ContactForces,
    /// What was computed for wrenches that nothing balances.
    pub(crate) nearest: Option<Box<NearestMemory<D>>>,
    /// The workspace of the contacts that are on, where limits were set.
    pub(crate) limited: Option<Box<LimitedWorkspace<D>>>,
}

/// The program of a grasp with finitely many extreme forces, with true cones, or with lower bounds; or its least squares.
#[derive(Debug, Clone)]
pub(crate) enum Program<const D: usize> {
    Linear(Arc<LinearProgram<D>>),
    Cone(Arc<ConeProgram<D>>),
    Preload(Arc<PreloadProgram<D>>),
    Squares(Arc<SquaresProgram<D>>),
}

/// A program with the memory that belongs to it.
#[derive(Debug, Clone)]
pub(crate) enum Solver<const D: usize> {
    Linear(Arc<LinearProgram<D>>, Box<LinearWorkspace<D>>),
    Cone(Arc<ConeProgram<D>>, Box<ConeWorkspace<D>>),
    Preload(Arc<PreloadProgram<D>>, Box<PreloadWorkspace>),
    Squares(Arc<SquaresProgram<D>>, SquaresWorkspace<D>),
}

impl<const D: usize> ForceWorkspace<D> {
    pub(crate) fn new(grasp: &Arc<Grasp<D>>, program: &Program<D>) -> Self {
        let solver = match program {
            Program::Linear(program) => Solver::Linear(Arc::clone(program), Box::new(program.workspace())),
            Program::Cone(program) => Solver::Cone(Arc::clone(program), Box::new(program.workspace())),
            Program::Preload(program) => Solver::Preload(Arc::clone(program), Box::new(program.workspace())),
            Program::Squares(program) => Solver::Squares(Arc::clone(program), SquaresWorkspace::new()),
        };
        Self {
            grasp: Arc::clone(grasp),
            solver,
            forces: ContactForces::new(grasp.num_contacts()),
            nearest: None,
            limited: None,
        }
    }

    /// Whether it was created for this grasp by the distributor that holds it.
    pub(crate) fn belongs_to(&self, grasp: &Arc<Grasp<D>>) -> bool {
        Arc::ptr_eq(&self.grasp, grasp)
    }

    /// Forgets earlier wrenches, so that the next solve starts cold. The answers do not change.
    pub fn forget(&mut self) {
        self.nearest = None;
        self.limited = None;
        match &mut self.solver {
            Solver::Linear(_, workspace) => workspace.forget(),
            Solver::Cone(_, workspace) => workspace.forget(),
            Solver::Preload(_, workspace) => workspace.forget(),
            Solver::Squares(_, workspace) => workspace.forget(),
        }
    }

    /// Leaves least forces for `b = -w_ext` in the workspace.
    pub(crate) fn solve(&mut self, b: &Wrench<D>) -> Result<Certificate<D>> {
        let Self { grasp, solver, forces, .. } = self;
        match solver {
            Solver::Linear(program, workspace) => {
                program.solve(workspace, b, grasp.force_components(), forces)
            }
            Solver::Cone(program, workspace) => program.solve(workspace, b, forces),
            Solver::Preload(program, workspace) => program.solve(workspace, b, forces),
            Solver::Squares(program, workspace) => program.solve(workspace, b, forces),
        }
    }

    /// The same without the last resorts of least squares, which tell why no forces balance a wrench.
    pub(crate) fn solve_once(&mut self, b: &Wrench<D>) -> Result<Certificate<D>> {
        match &mut self.solver {
            Solver::Squares(program, workspace) => program.solve_once(workspace, b, &mut self.forces),
            _ => self.solve(b),
        }
    }

    /// Writes rows of the components that exist, and returns the objective.
    pub(crate) fn solve_into(&mut self, b: &Wrench<D>, rows: &mut [f64]) -> Result<f64> {
        let Self { solver, forces, .. } = self;
        let certificate = match solver {
            Solver::Linear(program, workspace) => {
                let (region, _) = program.locate(workspace, b, forces)?;
                region.write(b, rows);
                return Ok(region.dual.dot(b));
            }
            Solver::Cone(program, workspace) => program.solve(workspace, b, forces)?,
            Solver::Preload(program, workspace) => program.solve(workspace, b, forces)?,
            Solver::Squares(program, workspace) => program.solve(workspace, b, forces)?,
        };
        self.write(rows);
        Ok(certificate.sigma)
    }

    /// Writes the last forces as rows of the components that exist.
    pub(crate) fn write(&self, rows: &mut [f64]) {
        let components = self.grasp.force_components();
        for (row, force) in rows.chunks_mut(components.len()).zip(&self.forces.forces) {
            for (x, &component) in row.iter_mut().zip(components) {
                *x = force[component];
            }
        }
    }

    /// The largest share of the last solve and the sum of its shares.
    pub(crate) fn totals(&self, b: &Wrench<D>) -> (f64, f64) {
        if let Some(limited) = &self.limited {
            return limited.totals(b);
        }
        match &self.solver {
            Solver::Linear(_, workspace) => workspace.latest().totals(b),
            Solver::Cone(..) | Solver::Preload(..) | Solver::Squares(..) => self.forces.totals(),
        }
    }

    /// The same of the last forces that came nearest.
    pub(crate) fn nearest_totals(&self) -> (f64, f64) {
        self.limited.as_ref().map_or_else(|| self.forces.totals(), |limited| limited.nearest_totals())
    }

    /// Starts from the last basis of another workspace, if both programs number the same edges in the same way; or from
    /// its last multiplier.
    pub(crate) fn adopt(&mut self, other: &Self) {
        match (&mut self.solver, &other.solver) {
            (Solver::Linear(program, workspace), Solver::Linear(before, last)) if program.matches(before) => {
                program.adopt(workspace, last);
            }
            (Solver::Squares(program, workspace), Solver::Squares(before, last)) => {
                program.adopt(workspace, before, last);
            }
            _ => {}
        }
    }
}
