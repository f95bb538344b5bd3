//! The least maximum or sum of shares: over listed extreme forces, over true cones, or with lower bounds.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::linear_cones::program::LinearProgram;
use crate::force::linear_cones::workspace::LinearWorkspace;
use crate::force::preload::program::{PreloadProgram, PreloadWorkspace, checked_bounds};
use crate::force::simplex::pricing::Objective;
use crate::force::solution::{DistributionOptions, Method};
use crate::force::true_cones::program::{ConeProgram, ConeWorkspace};
use crate::grasp::{Grasp, Wrench};
use crate::wrench_set::Criterion;

/// The program for the contacts and bounds of a grasp; it does not change while solving.
#[derive(Debug, Clone)]
pub(crate) enum ShareProgram<const D: usize> {
    Linear(Arc<LinearProgram<D>>),
    Cone(Arc<ConeProgram<D>>),
    Preload(Arc<PreloadProgram<D>>),
}

/// A program with the memory that belongs to it.
#[derive(Debug, Clone)]
pub(crate) enum ShareSolver<const D: usize> {
    Linear(Arc<LinearProgram<D>>, Box<LinearWorkspace<D>>),
    Cone(Arc<ConeProgram<D>>, Box<ConeWorkspace<D>>),
    Preload(Arc<PreloadProgram<D>>, Box<PreloadWorkspace>),
}

impl<const D: usize> ShareProgram<D> {
    pub(crate) fn new(grasp: &Grasp<D>, criterion: Criterion, options: &DistributionOptions) -> Result<Self> {
        let objective = Objective::new(criterion, options.weight);
        if let Some(bounds) = checked_bounds(grasp, options)? {
            Ok(Self::Preload(Arc::new(PreloadProgram::new(grasp, objective, &bounds, options.rtol))))
        } else if grasp.is_finite() {
            Ok(Self::Linear(Arc::new(LinearProgram::new(grasp, objective, options)?)))
        } else if options.method == Method::Implicit {
            Ok(Self::Cone(Arc::new(ConeProgram::new(grasp, objective, options.rtol))))
        } else {
            grasp.require_finite("points of the wrench set to list")?;
            Err(Error::grasp("edges", "true cones have no points to list"))
        }
    }

    /// Whether some contacts press even if no wrench has to be balanced.
    pub(crate) fn has_lower_bounds(&self) -> bool {
        matches!(self, Self::Preload(_))
    }

    /// The points that [`Method::Reduced`] keeps.
    pub(crate) fn reduced_points(&self) -> Option<&[u32]> {
        if let Self::Linear(program) = self { program.reduced.as_deref() } else { None }
    }
}

impl<const D: usize> ShareSolver<D> {
    pub(crate) fn new(program: &ShareProgram<D>) -> Self {
        match program {
            ShareProgram::Linear(program) => Self::Linear(Arc::clone(program), Box::new(program.workspace())),
            ShareProgram::Cone(program) => Self::Cone(Arc::clone(program), Box::new(program.workspace())),
            ShareProgram::Preload(program) => {
                Self::Preload(Arc::clone(program), Box::new(program.workspace()))
            }
        }
    }

    pub(crate) fn forget(&mut self) {
        match self {
            Self::Linear(_, workspace) => workspace.forget(),
            Self::Cone(_, workspace) => workspace.forget(),
            Self::Preload(_, workspace) => workspace.forget(),
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
            Self::Linear(program, workspace) => program.solve(workspace, b, components, forces),
            Self::Cone(program, workspace) => program.solve(workspace, b, forces),
            Self::Preload(program, workspace) => program.solve(workspace, b, forces),
        }
    }

    /// The largest share of the last solve and the sum of its shares.
    pub(crate) fn totals(&self, b: &Wrench<D>, forces: &ContactForces) -> (f64, f64) {
        if let Self::Linear(_, workspace) = self { workspace.latest().totals(b) } else { forces.totals() }
    }
}
