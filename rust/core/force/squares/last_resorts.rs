//! What follows where Newton's method of least squares ends without an answer: whether forces balance the wrench at all,
//! other starts, and a high price of the residual.

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::share_program::{ShareProgram, ShareSolver};
use crate::force::solution::DistributionOptions;
use crate::force::squares::dual::{Dual, ForceSet};
use crate::force::squares::interior_point_qp::multiplier;
use crate::force::squares::newton::minimise;
use crate::force::squares::program::{SquaresProgram, SquaresWorkspace, Unsolved};
use crate::grasp::{Wrench, unit};
use crate::tolerances::AT_LIMIT;
use crate::wrench_set::Criterion;

impl<const D: usize> SquaresProgram<D> {
    /// Tells an infeasible wrench, or starts from the interior-point solver's multiplier. `error` is what is known.
    #[cold]
    pub(super) fn solve_again(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
        error: Error,
    ) -> std::result::Result<Certificate<D>, Unsolved> {
        let target = &self.target(b);
        let mut beyond = None;
        if self.slack.is_none() {
            match self.feasible(b) {
                Err(found) if found.is_infeasible() => return Err(Unsolved { error: found, open: false }),
                Err(_) => return Err(Unsolved { error, open: false }),
                Ok(found) => beyond = found,
            }
        }
        let mut searching = self.dual.clone();
        for contact in &mut searching.contacts {
            if let ForceSet::Finite(polytope) = &mut contact.set {
                polytope.search_only();
            }
        }
        if let Some(answer) = self.solve_from(workspace, b, target, &searching, &Wrench::zeros(), forces) {
            return Ok(answer);
        }
        let answer = match self.solve_by_interior_point(workspace, b, target, &searching, forces) {
            None if beyond.is_some() => {
                // A wrench at the limits up to the tolerance.
                let mut relaxed = searching.clone();
                for i in 0..self.grasp.num_contacts() {
                    relaxed.bound(i, self.least.get(i).copied().unwrap_or(0.0), 1.0 + AT_LIMIT);
                }
                self.solve_from(workspace, b, target, &relaxed, &Wrench::zeros(), forces)
                    .or_else(|| self.solve_by_interior_point(workspace, b, target, &relaxed, forces))
            }
            answer => answer,
        };
        let error = beyond.map_or(error, |direction| Error::BeyondLimits { direction });
        answer.ok_or(Unsolved { error, open: true })
    }

    /// Newton's method from the interior-point solver's multiplier, over the contacts of `dual`.
    fn solve_by_interior_point(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        b: &Wrench<D>,
        target: &Wrench<D>,
        dual: &Dual<D>,
        forces: &mut ContactForces,
    ) -> Option<Certificate<D>> {
        let columns = self.slack.as_ref().map(|slack| &slack.columns);
        let ContactForces { forces: f, shares, .. } = &mut *forces;
        let size = dual.at(&Wrench::zeros(), target, f, shares).size;
        let y = multiplier(dual, target, size, columns)?;
        let answer = self.solve_from(workspace, b, target, dual, &y, forces)?;
        Some(Certificate { fell_back: true, ..answer })
    }

    /// Newton's method from `y`, over the contacts of `dual`.
    fn solve_from(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        b: &Wrench<D>,
        target: &Wrench<D>,
        dual: &Dual<D>,
        y: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Option<Certificate<D>> {
        let ContactForces { forces: f, shares, .. } = &mut *forces;
        let start = dual.at(y, target, f, shares);
        let (point, steps) = minimise(dual, target, start, f, shares);
        let (answer, y) = self.certify(b, &point, steps, forces).ok()?;
        workspace.y = y;
        Some(answer)
    }

    /// Whether forces in the cones, and within the limits, balance `b`; the direction in which limits are reached where
    /// they need the limits up to their tolerance.
    fn feasible(&self, b: &Wrench<D>) -> Result<Option<Vec<f64>>> {
        let program = if let Some(known) = self.feasibility.get() {
            known
        } else {
            let options =
                DistributionOptions { min_normal: self.least.clone(), ..DistributionOptions::default() };
            let made = ShareProgram::new(&self.grasp, Criterion::Max, &options)?;
            self.feasibility.get_or_init(|| made)
        };
        if b.amax() == 0.0 && !program.has_lower_bounds() {
            return Ok(None);
        }
        let mut solver = ShareSolver::new(program);
        let mut forces = ContactForces::new(self.grasp.num_contacts());
        let answer = solver.solve(b, self.grasp.force_components(), &mut forces)?;
        let largest = solver.totals(b, &forces).0;
        if !self.limits || largest <= 1.0 - AT_LIMIT {
            return Ok(None);
        }
        let direction = unit(&answer.dual).as_slice().to_vec();
        if largest > 1.0 + AT_LIMIT { Err(Error::BeyondLimits { direction }) } else { Ok(Some(direction)) }
    }
}
