//! One grasp and one objective: the program that distributes its forces, and the workspace that it solves in.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, ContactForces, exact_rest, residual};
use crate::force::nearest::options::NearestOptions;
use crate::force::nearest::workspace::NearestWorkspace;
use crate::force::program::{Program, Solver};
use crate::force::share_program::ShareProgram;
use crate::force::solution::{Distribution, DistributionOptions, check_options, check_wrench};
use crate::force::squares::options::SquaresOptions;
use crate::force::squares::program::SquaresProgram;
use crate::grasp::contact::{ContactForce, contact_force};
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::LARGE_FORCES;
use crate::wrench_set::Criterion;

/// What does not change while wrenches are balanced.
#[derive(Debug, Clone)]
pub(crate) struct Problem<const D: usize> {
    pub(crate) grasp: Arc<Grasp<D>>,
    pub(crate) options: DistributionOptions,
    pub(crate) program: Program<D>,
}

/// Buffers, with the bases and regions of earlier wrenches.
#[derive(Debug, Clone)]
pub(crate) struct ProblemWorkspace<const D: usize> {
    /// Belongs to one problem and its clones.
    grasp: Arc<Grasp<D>>,
    pub(crate) solver: Solver<D>,
    pub(crate) forces: ContactForces,
    /// What was computed for wrenches that nothing balances.
    pub(crate) nearest: Option<Box<NearestWorkspace<D>>>,
}

impl<const D: usize> Problem<D> {
    /// The least maximum or sum of shares.
    pub(crate) fn shares(
        grasp: &Grasp<D>,
        criterion: Criterion,
        options: DistributionOptions,
    ) -> Result<Self> {
        check_options(&options, criterion)?;
        let program = Program::Shares(criterion, ShareProgram::new(grasp, criterion, &options)?);
        Ok(Self { grasp: Arc::new(grasp.clone()), options, program })
    }

    /// The least sum of squares.
    pub(crate) fn squares(grasp: &Grasp<D>, squares: SquaresOptions<D>) -> Result<Self> {
        let grasp = Arc::new(grasp.clone());
        let (min_normal, rtol) = (squares.min_normal.clone(), squares.rtol);
        let options = DistributionOptions { rtol, min_normal, ..DistributionOptions::default() };
        let program = Arc::new(SquaresProgram::new(&grasp, &squares)?);
        Ok(Self { grasp, options, program: Program::Squares(Box::new(squares), program) })
    }

    /// The same objective for another grasp.
    pub(crate) fn with_grasp(&self, grasp: &Grasp<D>) -> Result<Self> {
        match &self.program {
            Program::Shares(criterion, _) => Self::shares(grasp, *criterion, self.options.clone()),
            Program::Squares(squares, _) => Self::squares(grasp, squares.as_ref().clone()),
        }
    }

    /// A workspace that remembers no wrench yet.
    pub(crate) fn workspace(&self) -> ProblemWorkspace<D> {
        ProblemWorkspace {
            grasp: Arc::clone(&self.grasp),
            solver: Solver::new(&self.program),
            forces: ContactForces::new(self.grasp.num_contacts()),
            nearest: None,
        }
    }

    /// Least contact forces that balance `external_wrench`: `sum_i G_i f_i = -w_ext` (Eq. 11).
    pub(crate) fn solve(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        if self.needs_no_forces(external_wrench) {
            return Ok(Distribution::without_forces(self.grasp.num_contacts(), self.options.rtol));
        }
        self.claim(workspace);
        let b = -external_wrench;
        let answer = workspace.solve(&b).map_err(|error| cause(error, external_wrench))?;
        Ok(self.distribution(&b, &workspace.forces, &answer, workspace.totals(&b), None))
    }

    /// The same without the last resorts of least squares, which tell why no forces balance a wrench.
    pub(crate) fn try_solve(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        if self.needs_no_forces(external_wrench) {
            return self.solve(workspace, external_wrench);
        }
        self.claim(workspace);
        let b = -external_wrench;
        let answer = workspace.solve_once(&b)?;
        Ok(self.distribution(&b, &workspace.forces, &answer, workspace.totals(&b), None))
    }

    /// The same, written as rows of [`Grasp::force_components`]; returns the objective.
    pub(crate) fn solve_into(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
        rows: &mut [f64],
    ) -> Result<f64> {
        if self.needs_no_forces(external_wrench) {
            rows.fill(0.0);
            return Ok(0.0);
        }
        self.claim(workspace);
        let ProblemWorkspace { grasp, solver, forces, .. } = workspace;
        let solved = solver.solve_into(&-external_wrench, grasp.force_components(), forces, rows);
        solved.map_err(|error| cause(error, external_wrench))
    }

    /// Forces for `b = -w_ext` with their certificate, their largest share and the sum of shares, and the distance where a metric
    /// of its own measured it.
    pub(crate) fn distribution(
        &self,
        b: &Wrench<D>,
        forces: &ContactForces,
        answer: &Certificate<D>,
        (sigma_max, sigma_sum): (f64, f64),
        distance: Option<f64>,
    ) -> Distribution<D> {
        let residual = self.residual(b, &forces.forces);
        let metric = || Metric::from_length_scale(self.grasp.options().length_scale);
        Distribution {
            forces: forces.forces.clone(),
            shares: forces.shares.clone(),
            sigma: answer.sigma,
            sigma_max,
            sigma_sum,
            dual: answer.dual,
            gap: answer.gap,
            pivots: answer.pivots,
            unique: forces.unique,
            fell_back: answer.fell_back,
            residual,
            distance: distance.unwrap_or_else(|| metric().norm(&residual)),
            tolerance: self.options.rtol,
        }
    }

    /// Lower and upper bounds of the share of each contact.
    pub(crate) fn bounds(&self) -> Vec<(f64, f64)> {
        let least = |i: usize| match self.options.min_normal[..] {
            [] => 0.0,
            [all] => all,
            ref each => each[i],
        };
        (0..self.grasp.num_contacts()).map(|i| (least(i), 1.0)).collect()
    }

    /// What forces leave of `b`, with the sign of the external wrench: free of rounding where they are large.
    pub(crate) fn residual(&self, b: &Wrench<D>, forces: &[ContactForce]) -> Wrench<D> {
        let largest = forces.iter().fold(0.0_f64, |largest, force| largest.max(force.amax()));
        let contacts = self.grasp.maps().iter().zip(forces.iter().copied());
        if largest > LARGE_FORCES * b.amax() { -exact_rest(b, contacts) } else { residual(b, contacts) }
    }

    /// The same of rows of [`Grasp::force_components`].
    pub(crate) fn residual_of_rows(&self, b: &Wrench<D>, rows: &[f64]) -> Wrench<D> {
        let (maps, components) = (self.grasp.maps(), self.grasp.force_components());
        let contacts = maps.iter().zip(rows.chunks_exact(components.len()));
        let largest = rows.iter().fold(0.0, |largest, x| if x.abs() > largest { x.abs() } else { largest });
        if largest > LARGE_FORCES * b.amax() {
            return -exact_rest(b, contacts.map(|(map, row)| (map, contact_force(row, components))));
        }
        let columns = contacts.flat_map(|(map, row)| components.iter().map(|&k| map.column(k)).zip(row));
        columns.fold(-b, |rest, (column, x)| rest + column * *x)
    }

    /// Whether the wrench is zero and no contact has a lower bound.
    pub(crate) fn needs_no_forces(&self, external_wrench: &Wrench<D>) -> bool {
        external_wrench.iter().all(|x| *x == 0.0) && !self.program.presses_at_zero()
    }

    /// Replaces the workspace of another problem.
    pub(crate) fn claim(&self, workspace: &mut ProblemWorkspace<D>) {
        if !workspace.belongs_to(self) {
            *workspace = self.workspace();
        }
    }
}

impl<const D: usize> ProblemWorkspace<D> {
    /// Whether it was created by this problem or a clone of it.
    pub(crate) fn belongs_to(&self, problem: &Problem<D>) -> bool {
        Arc::ptr_eq(&self.grasp, &problem.grasp)
    }

    /// The options of nearest forces for which it has memory.
    pub(crate) fn nearest_options(&self) -> Option<NearestOptions<D>> {
        self.nearest.as_ref().map(|nearest| nearest.options())
    }

    /// Forgets earlier wrenches, so that the next solve starts cold.
    pub(crate) fn forget(&mut self) {
        if let Some(nearest) = &mut self.nearest {
            nearest.forget();
        }
        self.solver.forget();
    }

    /// Leaves least forces for `b = -w_ext` in the workspace.
    pub(crate) fn solve(&mut self, b: &Wrench<D>) -> Result<Certificate<D>> {
        self.solver.solve(b, self.grasp.force_components(), &mut self.forces)
    }

    /// The same without the last resorts of least squares, which tell why no forces balance a wrench.
    pub(crate) fn solve_once(&mut self, b: &Wrench<D>) -> Result<Certificate<D>> {
        self.solver.solve_once(b, self.grasp.force_components(), &mut self.forces)
    }

    /// The largest share of the last solve and the sum of its shares.
    pub(crate) fn totals(&self, b: &Wrench<D>) -> (f64, f64) {
        self.solver.totals(b, &self.forces)
    }

    /// Starts from what another workspace has learnt, as far as it fits.
    pub(crate) fn adopt(&mut self, other: &Self) {
        self.solver.adopt(&other.solver);
    }
}

/// A wrench that is not finite, or an interrupt, leads to one error or another; this is the one to report.
fn cause<const D: usize>(error: Error, external_wrench: &Wrench<D>) -> Error {
    check_wrench(external_wrench).and_then(|()| interrupt::check()).err().unwrap_or(error)
}
