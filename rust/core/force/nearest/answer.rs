//! The least forces among those whose wrench comes nearest to balance.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::force::certificate::Certificate;
use crate::force::distributor::ForceDistributor;
use crate::force::nearest::limited_sum::lower_sum;
use crate::force::nearest::wrench_projection::{Nearest, WrenchProjection};
use crate::force::solution::{Distribution, check_wrench};
use crate::force::workspace::ForceWorkspace;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{REPRESENTABLE, Wrench};
use crate::interrupt;
use crate::tolerances::AT_LIMIT;
use crate::wrench_set::Criterion;

/// What [`ForceDistributor::nearest`] measures the distance in, and whether forces keep their upper bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestOptions<const D: usize> {
    /// The norm of the residual; `None` for that of the grasp's length scale.
    pub metric: Option<Metric<D>>,
    /// Whether normal forces keep their upper bounds.
    pub limits: bool,
}

impl<const D: usize> Default for NearestOptions<D> {
    fn default() -> Self {
        Self { metric: None, limits: true }
    }
}

/// What a workspace keeps of `nearest`.
#[derive(Debug, Clone)]
pub(crate) struct NearestMemory<const D: usize> {
    projection: WrenchProjection<D>,
    /// What was found of the wrench in question, if it is apart from what forces balance.
    apart: Option<Nearest<D>>,
    /// The workspace of [`ForceDistributor::bounded`], where that is another distributor.
    bounded: Option<ForceWorkspace<D>>,
}

/// The certificate of forces that come nearest, with the distance and the gap of both.
struct Found<const D: usize> {
    answer: Certificate<D>,
    distance: f64,
}

impl<const D: usize> ForceDistributor<D> {
    /// The forces whose wrench comes nearest to balance, the least among those: [`Self::solve`]'s where that succeeds
    /// within the limits.
    ///
    /// `residual` is what stays unbalanced and `distance` its norm. `gap` is the larger of two: the objective's at the
    /// wrench that the forces balance, and that of the distance, relative to the norm of the wrench.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, NearestOptions, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5).max_normal_force(4.0)
    /// });
    /// let distributor = ForceDistributor::new(&Grasp::<3>::new(&fingers)?, Criterion::Max)?;
    /// // Two fingers of 4 N and friction 0.5 lift 4 N of a weight of 5 N.
    /// let weight = Wrench::<3>::new(0.0, -5.0, 0.0);
    /// let nearest = distributor.nearest(&mut distributor.workspace(), &weight, &NearestOptions::default())?;
    /// assert!((nearest.distance - 1.0).abs() < 1e-9);
    /// assert!((nearest.forces[0][0] - 4.0).abs() < 1e-6);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn nearest(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
    ) -> Result<Distribution<D>> {
        if let Some(limited) = &self.limited {
            self.claim(workspace);
            return limited.nearest(workspace, external_wrench, options, self.default_metric());
        }
        let Found { answer, distance } = self.find(workspace, external_wrench, options)?;
        let forces = &workspace.forces;
        let (sigma_max, sigma_sum) = forces.totals();
        Ok(Distribution {
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
            residual: self.residual(&-external_wrench, &forces.forces),
            distance,
            tolerance: self.options().rtol,
        })
    }

    /// The same, written as [`Self::solve_into`] does; returns the distance.
    pub fn nearest_into(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
        forces: &mut [f64],
    ) -> Result<f64> {
        self.check_rows(forces)?;
        if let Some(limited) = &self.limited {
            self.claim(workspace);
            let nearest = Some((options, self.default_metric()));
            return limited.write(self.grasp(), workspace, external_wrench, nearest, forces);
        }
        let Found { distance, .. } = self.find(workspace, external_wrench, options)?;
        workspace.write(forces);
        Ok(distance)
    }

    fn default_metric(&self) -> Metric<D> {
        Metric::from_length_scale(self.grasp().options().length_scale)
    }

    fn find(
        &self,
        workspace: &mut ForceWorkspace<D>,
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
        self.claim(workspace);
        let metric = options.metric.unwrap_or_else(|| self.default_metric());
        let mut memory = match workspace.nearest.take() {
            Some(memory)
                if memory.projection.metric == metric && memory.projection.limits == options.limits =>
            {
                memory
            }
            _ => {
                let bounds = self.bounds();
                let projection = WrenchProjection::new(self.shared_grasp(), metric, options.limits, &bounds);
                let bounded = self.bounded(options.limits)?.map(|bounded| bounded.workspace());
                Box::new(NearestMemory { projection, apart: None, bounded })
            }
        };
        let found = self.find_in(workspace, &mut memory, &-external_wrench, options.limits);
        workspace.nearest = Some(memory);
        interrupt::check()?;
        Ok(found)
    }

    fn find_in(
        &self,
        workspace: &mut ForceWorkspace<D>,
        memory: &mut NearestMemory<D>,
        b: &Wrench<D>,
        limits: bool,
    ) -> Found<D> {
        memory.apart = None;
        if memory.projection.is_beyond(b) {
            let nearest = memory.projection.project(b, &mut workspace.forces);
            memory.apart = Some(nearest).filter(|nearest| nearest.exact);
        }
        if memory.apart.is_none()
            && let Ok(answer) = self.least(workspace, memory, b, limits)
        {
            let distance = memory.projection.metric.norm(&self.residual(b, &workspace.forces.forces));
            return Found { answer, distance };
        }
        let nearest = match memory.apart {
            Some(nearest) => nearest,
            None => memory.projection.project(b, &mut workspace.forces),
        };
        let size = memory.projection.metric.norm(b);
        let loose = if size > 0.0 { (nearest.distance - nearest.lower) / size } else { 0.0 };
        if nearest.unique {
            let Found { answer, distance } = self.as_projected(workspace, memory, b, &nearest, loose);
            return Found { answer: Certificate { fell_back: false, ..answer }, distance };
        }
        let exerted = b + nearest.residual;
        let projected = workspace.forces.clone();
        let least = self.least(workspace, memory, &exerted, limits);
        let rest = self.residual(b, &workspace.forces.forces);
        let distance = memory.projection.metric.norm(&rest);
        match least {
            // Its own tolerance of the balance must not move it away.
            Ok(answer) if distance <= nearest.distance + AT_LIMIT * size => {
                let answer = Certificate {
                    gap: answer.gap.max(loose),
                    pivots: answer.pivots + nearest.steps,
                    ..answer
                };
                Found { answer, distance }
            }
            _ => {
                workspace.forces = projected;
                self.as_projected(workspace, memory, b, &nearest, loose)
            }
        }
    }

    /// The forces of the projection itself: nearest, and nearly the least.
    fn as_projected(
        &self,
        workspace: &ForceWorkspace<D>,
        memory: &NearestMemory<D>,
        b: &Wrench<D>,
        nearest: &Nearest<D>,
        loose: f64,
    ) -> Found<D> {
        let (largest, sum) = workspace.forces.totals();
        let residual = self.residual(b, &workspace.forces.forces);
        let metric = &memory.projection.metric;
        let dual = -metric.functional(&metric.to_euclidean(&residual));
        let sigma = self.value(largest, sum, &workspace.forces.forces);
        let answer = Certificate { sigma, dual, gap: loose, pivots: nearest.steps, fell_back: true };
        Found { answer, distance: nearest.distance }
    }

    /// The least forces that balance `b`, within the limits if they count.
    fn least(
        &self,
        workspace: &mut ForceWorkspace<D>,
        memory: &mut NearestMemory<D>,
        b: &Wrench<D>,
        limits: bool,
    ) -> Result<Certificate<D>> {
        if let Some(inner) = &mut memory.bounded {
            let answer = inner.solve_once(b)?;
            workspace.forces.clone_from(&inner.forces);
            return Ok(answer);
        }
        if self.needs_no_forces(b) {
            workspace.forces.clear();
            workspace.forces.unique = true;
            let (sigma, dual) = (0.0, Wrench::zeros());
            return Ok(Certificate { sigma, dual, gap: 0.0, pivots: 0, fell_back: false });
        }
        let answer = workspace.solve_once(b)?;
        let (largest, _) = workspace.forces.totals();
        let most = 1.0 + self.options().rtol.max(AT_LIMIT);
        if !limits || largest <= most || self.objective().is_none() {
            return Ok(answer);
        }
        let beyond =
            || Error::BeyondLimits { direction: crate::grasp::unit(&answer.dual).as_slice().to_vec() };
        if self.objective() == Some(Criterion::Max) && self.options().weight == 0.0 {
            return Err(beyond());
        }
        self.lower_sum_within_limits(workspace, memory, b, beyond)
    }

    /// Where the least sum breaks the limits: forces within them, if there are any, and the least sum of those.
    #[cold]
    fn lower_sum_within_limits(
        &self,
        workspace: &mut ForceWorkspace<D>,
        memory: &mut NearestMemory<D>,
        b: &Wrench<D>,
        beyond: impl Fn() -> Error,
    ) -> Result<Certificate<D>> {
        let nearest = memory.projection.project(b, &mut workspace.forces);
        if nearest.distance > AT_LIMIT * memory.projection.metric.norm(b) {
            memory.apart = Some(nearest);
            return Err(beyond());
        }
        let bounds = self.bounds();
        let exerted = b + nearest.residual;
        let lowered = lower_sum(self.grasp(), &bounds, &exerted, &mut workspace.forces);
        let (dual, gap, pivots) = lowered.ok_or_else(&beyond)?;
        let (largest, sum) = workspace.forces.totals();
        let sigma = self.value(largest, sum, &workspace.forces.forces);
        Ok(Certificate { sigma, dual, gap, pivots: pivots + nearest.steps, fell_back: false })
    }

    /// The objective of these forces.
    fn value(&self, largest: f64, sum: f64, forces: &[crate::ContactForce]) -> f64 {
        match self.objective() {
            Some(Criterion::Sum) => sum,
            Some(Criterion::Max) => largest + self.options().weight * sum,
            None => self.squared(forces),
        }
    }
}

impl<const D: usize> ForceDistributor<D> {
    /// Least squares with other limits than this distributor's, or without its price of the residual; `None` where
    /// this distributor answers itself.
    fn bounded(&self, limits: bool) -> Result<Option<Arc<Self>>> {
        let Some(squares) = self.squares_options() else { return Ok(None) };
        if squares.limits == limits && squares.slack.is_none() {
            return Ok(None);
        }
        let options = crate::SquaresOptions { limits, slack: None, ..squares.clone() };
        Self::squares(self.grasp(), options).map(|bounded| Some(Arc::new(bounded)))
    }
}
