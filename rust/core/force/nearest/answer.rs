//! The least forces among those whose wrench comes nearest to balance.

use crate::error::{Error, Result, Unmet};
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
use crate::grasp::{REPRESENTABLE, Wrench};
use crate::interrupt;
use crate::tolerances::{AT_LIMIT, LOOSEST_GAP};
use crate::wrench_set::Criterion;

/// The gap that decides whether forces keep their limits: a tenth of the tolerance of limits.
const TIGHT_GAP: f64 = 0.1 * AT_LIMIT;

/// The certificate of forces that come nearest, with the distance and the gap of both.
pub(crate) struct Found<const D: usize> {
    pub(crate) answer: Certificate<D>,
    pub(crate) distance: f64,
}

impl<const D: usize> Problem<D> {
    /// The forces whose wrench comes nearest to balance, the least among those.
    pub(crate) fn nearest(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
    ) -> Result<Distribution<D>> {
        let Found { answer, distance } = self.find(workspace, external_wrench, options)?;
        let forces = &workspace.forces;
        Ok(self.distribution(&-external_wrench, forces, &answer, forces.totals(), Some(distance)))
    }

    /// The same, written as rows of [`Grasp::force_components`](crate::Grasp::force_components); returns the distance.
    pub(crate) fn nearest_into(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
        rows: &mut [f64],
    ) -> Result<f64> {
        let Found { distance, .. } = self.find(workspace, external_wrench, options)?;
        write_components(&workspace.forces.forces, self.grasp.force_components(), rows);
        Ok(distance)
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
        let found = self.find_in(workspace, &mut memory, &-external_wrench, options.limits);
        workspace.nearest = Some(memory);
        interrupt::check()?;
        found
    }

    fn find_in(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        memory: &mut NearestWorkspace<D>,
        b: &Wrench<D>,
        limits: bool,
    ) -> Result<Found<D>> {
        memory.apart = memory.projection.project_if_beyond(b, &mut workspace.forces);
        let tight = self.options.rtol.max(AT_LIMIT);
        let mut loose_answer = None;
        if memory.apart.is_none()
            && let Ok(answer) = self.least(workspace, memory, b, limits)
        {
            let distance = memory.projection.metric.norm(&self.residual(b, &workspace.forces.forces));
            let found = Found { answer, distance };
            if found.answer.gap <= tight {
                return Ok(found);
            }
            // On the boundary of what the contacts exert multipliers grow without end; the faces there say more.
            memory.kept.clone_from(&workspace.forces);
            loose_answer = Some(found);
        }
        let nearest = match memory.apart {
            Some(nearest) => nearest,
            None => memory.projection.project(b, &mut workspace.forces),
        };
        let size = memory.projection.metric.norm(b);
        let loose = if size > 0.0 { (nearest.distance - nearest.lower) / size } else { 0.0 };
        if nearest.unique {
            return proven(self.as_projected(workspace, memory, b, &nearest, loose), tight);
        }
        let unproven = |found: Found<D>| {
            // These forces come nearest, but nothing proves them the least of those.
            let gap = if loose > tight { loose } else { f64::INFINITY };
            Found { answer: Certificate { gap, fell_back: true, ..found.answer }, ..found }
        };
        let normal = memory.projection.normal_of(&nearest, size);
        if let Some(found) = loose_answer {
            if let Some(normal) = normal
                && let Some(found) = self.least_on_faces(workspace, memory, b, &normal, tight)
            {
                return Ok(found);
            }
            if found.answer.gap <= LOOSEST_GAP || loose > tight {
                workspace.forces.clone_from(&memory.kept);
                let answer = Certificate { gap: f64::INFINITY, fell_back: true, ..found.answer };
                return Ok(Found { answer, ..found });
            }
            return proven(unproven(self.as_projected(workspace, memory, b, &nearest, loose)), tight);
        }
        let exerted = b + nearest.residual;
        memory.kept.clone_from(&workspace.forces);
        let mut least = self.least(workspace, memory, &exerted, limits);
        if let Err(Error::NotConverged { .. }) = least {
            least = self.least_at_last(workspace, memory, &exerted);
        }
        let rest = self.residual(b, &workspace.forces.forces);
        let metric = memory.projection.metric;
        let distance = metric.norm(&rest);
        if let Ok(answer) = least
            // Its own tolerance of the balance must not move it away.
            && metric.norm(&(rest - nearest.residual)) <= AT_LIMIT * size
            && answer.gap.max(loose) <= tight
        {
            let (gap, pivots) = (answer.gap.max(loose), answer.pivots + nearest.steps);
            return Ok(Found { answer: Certificate { gap, pivots, ..answer }, distance });
        }
        workspace.forces.clone_from(&memory.kept);
        if let Some(normal) = normal
            && let Some(found) = self.least_on_faces(workspace, memory, b, &normal, tight)
        {
            return Ok(found);
        }
        proven(unproven(self.as_projected(workspace, memory, b, &nearest, loose)), tight)
    }

    /// The forces of the projection itself.
    fn as_projected(
        &self,
        workspace: &ProblemWorkspace<D>,
        memory: &NearestWorkspace<D>,
        b: &Wrench<D>,
        nearest: &Nearest<D>,
        loose: f64,
    ) -> Found<D> {
        let residual = self.residual(b, &workspace.forces.forces);
        let metric = &memory.projection.metric;
        let dual = -metric.functional(&metric.to_euclidean(&residual));
        let sigma = self.value(&workspace.forces);
        let answer = Certificate { sigma, dual, gap: loose, pivots: nearest.steps, fell_back: false };
        Found { answer, distance: nearest.distance }
    }

    /// The same with the last resorts of least squares.
    #[cold]
    fn least_at_last(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        memory: &mut NearestWorkspace<D>,
        b: &Wrench<D>,
    ) -> Result<Certificate<D>> {
        match &mut memory.bounded {
            Some(solver) => solver.solve(b, self.grasp.force_components(), &mut workspace.forces),
            None => workspace.solve(b),
        }
    }

    /// The least forces that balance `b`, within the limits if they count.
    fn least(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        memory: &mut NearestWorkspace<D>,
        b: &Wrench<D>,
        limits: bool,
    ) -> Result<Certificate<D>> {
        if let Some(solver) = &mut memory.bounded {
            return solver.solve_once(b, self.grasp.force_components(), &mut workspace.forces);
        }
        if self.needs_no_forces(b) {
            workspace.forces.clear();
            workspace.forces.unique = true;
            let (sigma, dual) = (0.0, Wrench::zeros());
            return Ok(Certificate { sigma, dual, gap: 0.0, pivots: 0, fell_back: false });
        }
        let mut answer = workspace.solve_once(b)?;
        let within = |workspace: &ProblemWorkspace<D>| workspace.forces.totals().0 <= 1.0 + AT_LIMIT;
        let Program::Shares(criterion, _) = &self.program else { return Ok(answer) };
        if !limits || within(workspace) {
            return Ok(answer);
        }
        if *criterion == Criterion::Max && workspace.forces.totals().0 <= 1.0 + 2.0 * self.options.rtol {
            // The tolerance of the gap is none of the limits.
            answer = self.least_by_tight_gap(workspace, self.options.weight, b)?;
            if within(workspace) {
                return Ok(answer);
            }
        }
        let beyond =
            || Error::BeyondLimits { direction: crate::grasp::unit(&answer.dual).as_slice().to_vec() };
        if *criterion == Criterion::Max && self.options.weight == 0.0 {
            return Err(beyond());
        }
        self.lower_sum_within_limits(workspace, memory, b, beyond)
    }

    /// The least maximum up to the tolerance of limits.
    #[cold]
    fn least_by_tight_gap(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        weight: f64,
        b: &Wrench<D>,
    ) -> Result<Certificate<D>> {
        let options = DistributionOptions { rtol: TIGHT_GAP, weight, ..self.options.clone() };
        let program = ShareProgram::new(&self.grasp, Criterion::Max, &options)?;
        let components = self.grasp.force_components();
        ShareSolver::new(&program).solve(b, components, &mut workspace.forces)
    }

    /// Where the least sum breaks the limits: forces within them, if there are any, and the least sum of those.
    #[cold]
    fn lower_sum_within_limits(
        &self,
        workspace: &mut ProblemWorkspace<D>,
        memory: &mut NearestWorkspace<D>,
        b: &Wrench<D>,
        beyond: impl Fn() -> Error,
    ) -> Result<Certificate<D>> {
        let nearest = memory.projection.project(b, &mut workspace.forces);
        let mut exerted = b + nearest.residual;
        if nearest.distance > AT_LIMIT * memory.projection.metric.norm(b) {
            let projected = workspace.forces.clone();
            // Steps towards a wrench within the limits may end before it; the least maximum decides.
            if nearest.exact
                || self.least_by_tight_gap(workspace, 0.0, b).is_err()
                || workspace.forces.totals().0 > 1.0 + AT_LIMIT
            {
                workspace.forces = projected;
                memory.apart = Some(nearest);
                return Err(beyond());
            }
            exerted = *b;
        }
        let mut lowered = None;
        if is_linear_in_forces(&self.grasp) {
            let weights = weights_of_shares(&self.grasp);
            let mut dual = Dual::new(&self.grasp, &weights, &workspace.forces.forces, None);
            for (i, (low, high)) in self.bounds().into_iter().enumerate() {
                dual.bound(i, low, high);
            }
            lowered = lower_sum(&self.grasp, &mut dual, &exerted, &mut workspace.forces);
        }
        let known = lowered.map_or(f64::INFINITY, |(_, gap, _)| gap);
        if known > self.options.rtol.max(AT_LIMIT) {
            let mut forces = workspace.forces.clone();
            let found = least_sum_by_weights(&self.grasp, &self.options, &exerted, &mut forces);
            if found.is_some_and(|(_, gap, _)| gap < known) {
                (lowered, workspace.forces) = (found, forces);
            }
        }
        let (dual, gap, pivots) = lowered.ok_or_else(&beyond)?;
        let sigma = self.value(&workspace.forces);
        Ok(Certificate { sigma, dual, gap, pivots: pivots + nearest.steps, fell_back: false })
    }

    /// The objective of these forces.
    pub(crate) fn value(&self, forces: &ContactForces) -> f64 {
        self.program.value(&forces.forces, forces.totals(), self.options.weight)
    }
}

/// Refuses forces of which nothing proves that they come nearest. Where only their objective is unproven the gap is infinite.
fn proven<const D: usize>(found: Found<D>, allowed: f64) -> Result<Found<D>> {
    let gap = found.answer.gap;
    if gap <= allowed || gap == f64::INFINITY {
        return Ok(found);
    }
    let unmet = Unmet::Gap { found: gap, allowed };
    Err(Error::NotConverged { solver: "nearest forces", iterations: found.answer.pivots, unmet })
}
