//! The least forces among those whose wrench comes nearest to balance.

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::nearest::limited_sum::{is_linear_in_forces, lower_sum, weights_of_shares};
use crate::force::nearest::options::NearestOptions;
use crate::force::nearest::sum_by_weights::least_sum_by_weights;
use crate::force::nearest::workspace::NearestWorkspace;
use crate::force::nearest::wrench_projection::Nearest;
use crate::force::problem::{Problem, ProblemWorkspace};
use crate::force::program::Program;
use crate::force::share_program::{ShareProgram, ShareSolver};
use crate::force::solution::{Distribution, DistributionOptions, check_wrench};
use crate::force::squares::dual::Dual;
use crate::grasp::contact::write_components;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{REPRESENTABLE, Wrench};
use crate::interrupt;
use crate::tolerances::{AT_LIMIT, ILL_CONDITIONED, LOOSEST_GAP, ROUNDED_BALANCE};
use crate::wrench_set::Criterion;

/// Wrenches that are apart from what forces balance by less than this, relative to their norm, may be balanced within
/// the feasibility tolerance, which counts in other units.
const NEARLY_BALANCED: f64 = 1e-6;

/// The gap that decides whether forces keep their limits: a tenth of the tolerance of limits.
const TIGHT_GAP: f64 = 0.1 * AT_LIMIT;

/// The certificate of forces that come nearest, with the distance and the gap of both.
pub(crate) struct Found<const D: usize> {
    pub(crate) answer: Certificate<D>,
    pub(crate) distance: f64,
    /// Whether the objective changes by more than its tolerance where rounding moves the nearest wrench.
    pub(crate) steep: bool,
}

impl<const D: usize> Problem<D> {
    /// The forces whose wrench comes nearest to balance, the least among those.
    pub(crate) fn nearest(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
    ) -> Result<Distribution<D>> {
        let Found { answer, distance, .. } = self.find(workspace, external_wrench, options)?;
        let forces = &workspace.forces;
        Ok(self.distribution(&-external_wrench, forces, &answer, forces.totals(), Some(distance)))
    }

    /// The same, written as rows of [`Grasp::force_components`](crate::Grasp::force_components); returns the distance and the
    /// gap.
    pub(crate) fn nearest_into(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
        rows: &mut [f64],
    ) -> Result<(f64, f64)> {
        let Found { distance, answer, .. } = self.find(workspace, external_wrench, options)?;
        write_components(&workspace.forces.forces, self.grasp.force_components(), rows);
        Ok((distance, answer.gap))
    }

    /// Takes the memory of these options before the first wrench comes.
    pub(crate) fn prepare_nearest(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        options: &NearestOptions<D>,
    ) -> Result<()> {
        workspace.nearest = Some(self.nearest_memory(workspace, options)?);
        Ok(())
    }

    fn nearest_memory(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        options: &NearestOptions<D>,
    ) -> Result<Box<NearestWorkspace<D>>> {
        self.claim(workspace);
        match workspace.nearest.take() {
            Some(memory) if memory.serves(&self.grasp, options) => Ok(memory),
            _ => {
                let memory = NearestWorkspace::new(&self.grasp, &self.program, &self.bounds(), options)?;
                Ok(Box::new(memory))
            }
        }
    }

    fn find(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
    ) -> Result<Found<D>> {
        check_wrench(external_wrench)?;
        let size = external_wrench.amax();
        if !(size == 0.0 || REPRESENTABLE.contains(&size)) {
            let reason =
                format!("its largest component, {size:e}, lies outside 1e-140 to 1e140; check the units");
            return Err(Error::input("external_wrench", reason));
        }
        let mut memory = self.nearest_memory(workspace, options)?;
        let b = -external_wrench;
        let query = Query { problem: self, workspace, memory: &mut memory, b: &b, limits: options.limits };
        let found = query.find();
        workspace.nearest = Some(memory);
        interrupt::check()?;
        Ok(found)
    }

    /// The gap that counts as solved.
    pub(crate) fn proven_gap(&self) -> f64 {
        self.options.rtol.max(AT_LIMIT)
    }

    /// The objective of these forces.
    pub(crate) fn value(&self, forces: &ContactForces) -> f64 {
        self.program.value(&forces.forces, forces.totals(), self.options.weight)
    }
}

/// One wrench with all that its answer needs.
pub(crate) struct Query<'a, const D: usize> {
    pub(crate) problem: &'a Problem<D>,
    pub(crate) workspace: &'a mut ProblemWorkspace<D>,
    pub(crate) memory: &'a mut NearestWorkspace<D>,
    pub(crate) b: &'a Wrench<D>,
    limits: bool,
}

impl<const D: usize> Query<'_, D> {
    /// Leaves the forces. The gap is at most 1: no objective is negative.
    fn find(mut self) -> Found<D> {
        let found = self.find_in_doubles();
        let proven = self.problem.proven_gap();
        if found.answer.gap <= proven && !found.steep {
            return found;
        }
        self.memory.kept.clone_from(&self.workspace.forces);
        let Self { problem, workspace, memory, b, .. } = self;
        match problem.nearest_by_price(&memory.projection, b, &mut workspace.forces) {
            Some(better) if better.answer.gap < found.answer.gap.max(proven) => better,
            _ => {
                workspace.forces.clone_from(&memory.kept);
                found
            }
        }
    }

    fn find_in_doubles(&mut self) -> Found<D> {
        let (b, tight) = (self.b, self.problem.proven_gap());
        self.memory.apart = self.memory.projection.project_if_beyond(b, &mut self.workspace.forces);
        let metric = self.memory.projection.metric;
        let size = metric.norm(b);
        // What `solve` balances within its tolerance is balanced, whatever the last wrench was.
        let nearly_balanced = |nearest: &Nearest<D>| nearest.distance <= NEARLY_BALANCED * size;
        if self.memory.apart.as_ref().is_some_and(nearly_balanced) {
            self.memory.apart = None;
        }
        let mut loose_answer = None;
        if self.memory.apart.is_none()
            && let Ok(answer) = self.least(b)
        {
            let distance = metric.norm(&self.residual());
            let mut found = Found { answer, distance, steep: false };
            if found.answer.gap <= tight {
                // The tolerance of the balance is none of the distance.
                if size > 0.0 {
                    found.answer.gap = found.answer.gap.max((distance / size).min(1.0));
                }
                return found;
            }
            // On the boundary of what the contacts exert multipliers grow without end; the faces there say more.
            self.memory.kept.clone_from(&self.workspace.forces);
            loose_answer = Some(found);
        }
        let nearest = match self.memory.apart {
            Some(nearest) => nearest,
            None => self.memory.projection.project(b, &mut self.workspace.forces),
        };
        let loose = if size > 0.0 { (nearest.distance - nearest.lower) / size } else { 0.0 };
        if nearest.unique {
            return self.as_projected(&nearest, loose);
        }
        let normal = self.memory.projection.normal_of(&nearest, size);
        if let Some(found) = loose_answer {
            if let Some(found) = normal.and_then(|normal| self.least_on_faces(&normal, tight)) {
                return found;
            }
            if found.answer.gap <= LOOSEST_GAP || loose > tight {
                self.workspace.forces.clone_from(&self.memory.kept);
                return found.unproven();
            }
            return self.as_projected(&nearest, loose).unproven();
        }
        let exerted = b + nearest.residual;
        self.memory.kept.clone_from(&self.workspace.forces);
        let mut least = self.least(&exerted);
        if let Err(Error::NotConverged { .. }) = least {
            least = self.least_at_last(&exerted);
        }
        let rest = self.residual();
        let distance = metric.norm(&rest);
        if let Ok(answer) = least
            // Its own tolerance of the balance must not move it away.
            && metric.norm(&(rest - nearest.residual)) <= AT_LIMIT * size
            && answer.gap.max(loose) <= tight
        {
            let (gap, pivots) = (answer.gap.max(loose), answer.pivots + nearest.steps);
            let steep = metric.is_steep(&answer, size);
            return Found { answer: Certificate { gap, pivots, ..answer }, distance, steep };
        }
        self.workspace.forces.clone_from(&self.memory.kept);
        if let Some(found) = normal.and_then(|normal| self.least_on_faces(&normal, tight)) {
            return found;
        }
        self.as_projected(&nearest, loose).unproven()
    }

    fn residual(&self) -> Wrench<D> {
        self.problem.residual(self.b, &self.workspace.forces.forces)
    }

    /// The forces of the projection itself.
    fn as_projected(&self, nearest: &Nearest<D>, loose: f64) -> Found<D> {
        let metric = &self.memory.projection.metric;
        let dual = -metric.functional(&metric.to_euclidean(&self.residual()));
        let sigma = self.problem.value(&self.workspace.forces);
        let answer = Certificate { sigma, dual, gap: loose, pivots: nearest.steps, fell_back: false };
        Found { answer, distance: nearest.distance, steep: false }
    }

    /// The same with the last resorts of least squares.
    #[cold]
    fn least_at_last(&mut self, b: &Wrench<D>) -> Result<Certificate<D>> {
        let components = self.problem.grasp.force_components();
        let ProblemWorkspace { solver, forces, .. } = &mut *self.workspace;
        self.memory.bounded.as_mut().unwrap_or(solver).solve_in_doubles(b, components, forces)
    }

    /// The least forces that balance `b`, within the limits if they count.
    fn least(&mut self, b: &Wrench<D>) -> Result<Certificate<D>> {
        let (problem, workspace) = (self.problem, &mut *self.workspace);
        if let Some(solver) = &mut self.memory.bounded {
            return solver.solve_once(b, problem.grasp.force_components(), &mut workspace.forces);
        }
        if problem.needs_no_forces(b) {
            workspace.forces.clear();
            workspace.forces.unique = true;
            let (sigma, dual) = (0.0, Wrench::zeros());
            return Ok(Certificate { sigma, dual, gap: 0.0, pivots: 0, fell_back: false });
        }
        let mut answer = workspace.solve_once(b)?;
        let Program::Shares(criterion, _) = &problem.program else { return Ok(answer) };
        if !self.limits || self.is_within_limits() {
            return Ok(answer);
        }
        let DistributionOptions { rtol, weight, .. } = problem.options;
        if *criterion == Criterion::Max && self.workspace.forces.totals().0 <= 1.0 + 2.0 * rtol {
            // The tolerance of the gap is none of the limits.
            answer = self.least_by_tight_gap(weight, b)?;
            if self.is_within_limits() {
                return Ok(answer);
            }
        }
        let beyond =
            || Error::BeyondLimits { direction: crate::grasp::unit(&answer.dual).as_slice().to_vec() };
        if *criterion == Criterion::Max && weight == 0.0 {
            return Err(beyond());
        }
        self.lower_sum_within_limits(b, beyond)
    }

    fn is_within_limits(&self) -> bool {
        self.workspace.forces.totals().0 <= 1.0 + AT_LIMIT
    }

    /// The least maximum up to the tolerance of limits.
    #[cold]
    fn least_by_tight_gap(&mut self, weight: f64, b: &Wrench<D>) -> Result<Certificate<D>> {
        let options = DistributionOptions { rtol: TIGHT_GAP, weight, ..self.problem.options.clone() };
        let program = ShareProgram::new(&self.problem.grasp, Criterion::Max, &options)?;
        let components = self.problem.grasp.force_components();
        ShareSolver::new(&program).solve(b, components, &mut self.workspace.forces)
    }

    /// Where the least sum breaks the limits: forces within them, if there are any, and the least sum of those.
    #[cold]
    fn lower_sum_within_limits(
        &mut self,
        b: &Wrench<D>,
        beyond: impl Fn() -> Error,
    ) -> Result<Certificate<D>> {
        let projection = &mut self.memory.projection;
        let nearest = projection.project(b, &mut self.workspace.forces);
        let mut exerted = b + nearest.residual;
        let apart = nearest.distance / projection.metric.norm(b);
        if apart > ROUNDED_BALANCE {
            let projected = self.workspace.forces.clone();
            // Steps towards a wrench within the limits may end before it; the least maximum decides.
            let far = apart > AT_LIMIT;
            if !(far && nearest.exact) && self.least_by_tight_gap(0.0, b).is_ok() && self.is_within_limits() {
                exerted = *b;
            } else {
                self.workspace.forces = projected;
                if far {
                    self.memory.apart = Some(nearest);
                    return Err(beyond());
                }
            }
        }
        let (problem, found) = (self.problem, &mut self.workspace.forces);
        let mut lowered = None;
        if is_linear_in_forces(&problem.grasp) {
            let weights = weights_of_shares(&problem.grasp);
            let mut dual = Dual::new(&problem.grasp, &weights, &found.forces, None);
            for (i, (low, high)) in problem.bounds().into_iter().enumerate() {
                dual.bound(i, low, high);
            }
            lowered = lower_sum(&problem.grasp, &mut dual, &exerted, found);
        }
        let known = lowered.map_or(f64::INFINITY, |(_, gap, _)| gap);
        if known > self.problem.proven_gap() {
            let mut forces = self.workspace.forces.clone();
            let found = least_sum_by_weights(&problem.grasp, &problem.options, &exerted, &mut forces);
            if found.is_some_and(|(_, gap, _)| gap < known) {
                (lowered, self.workspace.forces) = (found, forces);
            }
        }
        let (dual, gap, pivots) = lowered.ok_or_else(&beyond)?;
        let sigma = problem.value(&self.workspace.forces);
        Ok(Certificate { sigma, dual, gap, pivots: pivots + nearest.steps, fell_back: false })
    }
}

impl<const D: usize> Metric<D> {
    /// Whether multipliers are so large beside the objective that rounding of a wrench of this norm changes it.
    pub(crate) fn is_steep(&self, answer: &Certificate<D>, size: f64) -> bool {
        let squares = self.inverse_columns().map(|column| column.dot(&answer.dual).powi(2));
        squares.sum::<f64>().sqrt() * size > ILL_CONDITIONED * answer.sigma
    }
}

impl<const D: usize> Found<D> {
    /// These forces come nearest, but nothing proves them the least of those: only that no objective is negative.
    fn unproven(self) -> Self {
        Self { answer: Certificate { gap: 1.0, fell_back: true, ..self.answer }, ..self }
    }
}
