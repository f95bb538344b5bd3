//! Least forces of many grasps, each for some wrenches, with gradients: on all cores.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::force::balance::balances;
use crate::force::distributor::ForceDistributor;
use crate::force::gradient::ForceGradient;
use crate::force::nearest::options::NearestOptions;
use crate::force::pyramid_hull::PyramidHull;
use crate::force::solution::Distribution;
use crate::grasp::contact::{force_components, write_components};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::status::Status;

/// What a batch computes of each grasp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspForcesOptions<const D: usize> {
    /// How wrenches that nothing balances are answered: by the nearest forces, or (`None`) by [`Status::Infeasible`].
    pub nearest: Option<NearestOptions<D>>,
    /// Whether gradients are computed.
    pub gradient: bool,
    /// Components of the contact forces that are written: 2, 3 or 4, as [`Grasp::force_dim`] counts them.
    pub force_dim: usize,
}

/// Least forces of one grasp for K wrenches; NaN where there are none. Nearest forces with a gap above `rtol` and 1e-9 are
/// there, but [`Status::NotConverged`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GraspForces {
    /// (K,) the objective.
    pub sigma: Vec<f64>,
    /// (K, m, k) contact forces in the `k` components asked for.
    pub forces: Vec<f64>,
    /// (K, d) what the forces leave unbalanced.
    pub residual: Vec<f64>,
    /// (K,) the norm of the residual.
    pub distance: Vec<f64>,
    /// (K,) the relative gap between the objective, or the distance, and what is proven.
    pub gap: Vec<f64>,
    /// (K,) whether the forces balance their wrench.
    pub balanced: Vec<bool>,
    /// (K,) how each wrench ended.
    pub status: Vec<Status>,
    /// Of the objective.
    pub gradient: Option<GraspForceGradients>,
    /// Of the distance.
    pub distance_gradient: Option<GraspForceGradients>,
    /// Why there is no grasp.
    pub error: Option<Error>,
}

/// Gradients of one grasp for K wrenches, as [`ForceGradient`] explains them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GraspForceGradients {
    /// (K, m, dim) by positions.
    pub positions: Vec<f64>,
    /// (K, m, dim) by normals.
    pub normals: Vec<f64>,
    /// (K, m) by spins of the frames.
    pub spins: Vec<f64>,
    /// (K, d) by the external wrench.
    pub external_wrench: Vec<f64>,
    /// (K,) whether each is a derivative.
    pub unique: Vec<bool>,
}

/// Least forces of `grasp(row)` for `wrenches(row)`, in order, in parallel. Along the wrenches of a row each solve starts
/// from the one before.
///
/// `distributor` makes the distributor of a grasp, which has `contacts(row)` contacts. A row that fails reports its error
/// and does not stop the others. After an interrupt all that is left is empty.
pub fn forces_batch<'a, const D: usize>(
    rows: Range<usize>,
    contacts: impl Fn(usize) -> usize + Sync,
    grasp: impl Fn(usize) -> Result<Grasp<D>> + Sync,
    distributor: impl Fn(&Grasp<D>) -> Result<ForceDistributor<D>> + Sync,
    wrenches: impl Fn(usize) -> &'a [Wrench<D>] + Sync,
    options: &GraspForcesOptions<D>,
) -> Vec<GraspForces> {
    let interrupt = interrupt::current();
    let forces = |row| {
        if let Err(error) = interrupt::check() {
            return GraspForces { error: Some(error), ..GraspForces::default() };
        }
        let made = grasp(row).and_then(|grasp| distributor(&grasp));
        let (wrenches, contacts) = (wrenches(row), contacts(row));
        match made {
            Ok(distributor) => of_grasp(&distributor, wrenches, options),
            Err(error) => {
                let mut none = GraspForces::with_room(wrenches.len(), contacts, options);
                for _ in wrenches {
                    none.push_unsolved::<D>(contacts, options.force_dim, Status::Invalid);
                }
                GraspForces { error: Some(error), ..none }
            }
        }
    };
    rows.into_par_iter().map(|row| interrupt::inherit(interrupt.as_ref(), || forces(row))).collect()
}

fn of_grasp<const D: usize>(
    distributor: &ForceDistributor<D>,
    wrenches: &[Wrench<D>],
    options: &GraspForcesOptions<D>,
) -> GraspForces {
    let grasp = distributor.grasp();
    let contacts = grasp.num_contacts();
    let mut found = GraspForces::with_room(wrenches.len(), contacts, options);
    let workspace = &mut distributor.workspace();
    let mut hull = PyramidHull::default();
    for wrench in wrenches {
        let solved = interrupt::check().and_then(|()| match &options.nearest {
            Some(nearest) => distributor.nearest(workspace, wrench, nearest),
            None => hull.solve(distributor, workspace, wrench),
        });
        match solved {
            Ok(answer) => {
                let balanced = balances(grasp, &-wrench, distributor.held(), answer.forces.iter().copied());
                let loose = options.nearest.is_some() && answer.gap > distributor.proven_gap();
                let status = if loose { Status::NotConverged } else { Status::Solved };
                found.push(&answer, balanced, options.force_dim, status);
                if let Some(gradients) = &mut found.gradient {
                    gradients.push(&distributor.gradient(&answer, options.nearest.as_ref()));
                }
                if let (Some(gradients), Some(nearest)) = (&mut found.distance_gradient, &options.nearest) {
                    gradients.push(&distributor.distance_gradient(&answer, nearest));
                }
            }
            Err(error) => found.push_unsolved::<D>(contacts, options.force_dim, Status::of(&error)),
        }
    }
    found
}

impl GraspForces {
    fn with_room<const D: usize>(wrenches: usize, contacts: usize, options: &GraspForcesOptions<D>) -> Self {
        let gradients = || options.gradient.then(GraspForceGradients::default);
        Self {
            forces: Vec::with_capacity(wrenches * contacts * options.force_dim),
            gradient: gradients(),
            distance_gradient: if options.nearest.is_some() { gradients() } else { None },
            ..Self::default()
        }
    }

    fn push<const D: usize>(
        &mut self,
        answer: &Distribution<D>,
        balanced: bool,
        force_dim: usize,
        status: Status,
    ) {
        let start = self.forces.len();
        self.forces.resize(start + answer.forces.len() * force_dim, 0.0);
        write_components(&answer.forces, force_components(force_dim), &mut self.forces[start..]);
        self.sigma.push(answer.sigma);
        self.residual.extend_from_slice(answer.residual.as_slice());
        self.distance.push(answer.distance);
        self.gap.push(answer.gap);
        self.balanced.push(balanced);
        self.status.push(status);
    }

    fn push_unsolved<const D: usize>(&mut self, contacts: usize, force_dim: usize, status: Status) {
        let nothing = |values: &mut Vec<f64>, count: usize| values.resize(values.len() + count, f64::NAN);
        nothing(&mut self.forces, contacts * force_dim);
        nothing(&mut self.residual, D);
        for values in [&mut self.sigma, &mut self.distance, &mut self.gap] {
            values.push(f64::NAN);
        }
        self.balanced.push(false);
        self.status.push(status);
        for gradients in [&mut self.gradient, &mut self.distance_gradient].into_iter().flatten() {
            let dim = if D == 3 { 2 } else { 3 };
            nothing(&mut gradients.positions, contacts * dim);
            nothing(&mut gradients.normals, contacts * dim);
            nothing(&mut gradients.spins, contacts);
            nothing(&mut gradients.external_wrench, D);
            gradients.unique.push(false);
        }
    }
}

impl GraspForceGradients {
    fn push<const D: usize>(&mut self, gradient: &ForceGradient<D>) {
        let dim = if D == 3 { 2 } else { 3 };
        let rows = |vectors: &mut Vec<f64>, rows: &[Vector3<f64>]| {
            vectors.extend(rows.iter().flat_map(|row| row.iter().copied().take(dim)));
        };
        rows(&mut self.positions, &gradient.positions);
        rows(&mut self.normals, &gradient.normals);
        self.spins.extend_from_slice(&gradient.spins);
        self.external_wrench.extend_from_slice(gradient.external_wrench.as_slice());
        self.unique.push(gradient.unique);
    }
}
