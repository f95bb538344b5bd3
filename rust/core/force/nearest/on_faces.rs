//! The least forces on the exposed faces: among all forces that reach furthest along the normal of the nearest wrench.
//!
//! The nearest wrench lies on the boundary of what contacts exert. Balancing it over all forces has multipliers without
//! bound along the normal. All forces that exert it belong to the exposed faces, and over these sets, with the balance
//! along the directions in which they differ, the multipliers are those of an ordinary program. They prove the objective.

use crate::force::certificate::{Certificate, ContactForces};
use crate::force::nearest::answer::{Found, Query};
use crate::force::nearest::exposed_face::ExposedSet;
use crate::force::nearest::face_newton::settle;
use crate::force::nearest::limited_sum::{is_linear_in_forces, lower_sum, weights_of_shares};
use crate::force::nearest::workspace::NearestWorkspace;
use crate::force::nearest::wrench_projection::WrenchProjection;
use crate::force::problem::Problem;
use crate::force::program::{Program, Solver};
use crate::force::squares::dual::Dual;
use crate::force::squares::newton::minimise;
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;
use crate::tolerances::{BALANCED_STEP, TOUCHING};

/// Contacts reach furthest within these tolerances, relative to their wrenches: the normal is exact, or it is not yet.
const TOLERANCES: [f64; 4] = [TOUCHING, 1e-8, 1e-7, 1e-6];

/// The sets of forces that reach furthest, and the wrench nearest to `b` that they exert.
struct Faces<const D: usize> {
    exposed: Vec<ExposedSet>,
    normal: Wrench<D>,
    exerted: Wrench<D>,
}

impl<const D: usize> Query<'_, D> {
    /// Leaves the least of the forces that reach furthest along `normal`, in the coordinates where the metric is Euclidean.
    /// `None` where nothing proves them the nearest and the least of those within the tolerance; the forces then stay.
    #[cold]
    pub(crate) fn least_on_faces(&mut self, normal: &Wrench<D>, tolerance: f64) -> Option<Found<D>> {
        let Self { problem, workspace, memory, b, .. } = self;
        let projection = &memory.projection;
        let size = projection.metric.norm(b);
        let kept = workspace.forces.clone();
        for touching in TOLERANCES {
            let faces = projection.faces(b, normal, touching, &mut workspace.forces);
            if let Some(faces) = faces
                && let Some(answer) = problem.least_of(&faces, memory, &mut workspace.forces)
            {
                let (distance, lower) = projection.distances(b, &workspace.forces, &faces.normal);
                let gap = answer.gap.max((distance - lower) / size);
                if gap <= tolerance {
                    let sigma = problem.value(&workspace.forces);
                    let answer = Certificate { sigma, gap, ..answer };
                    let steep = projection.metric.is_steep(&answer, size);
                    return Some(Found { answer, distance, steep });
                }
            }
            workspace.forces.clone_from(&kept);
        }
        None
    }
}

impl<const D: usize> Problem<D> {
    fn least_of(
        &self,
        faces: &Faces<D>,
        memory: &NearestWorkspace<D>,
        forces: &mut ContactForces,
    ) -> Option<Certificate<D>> {
        let sets = faces.exposed.iter().map(|exposed| exposed.set.clone()).collect();
        let free: Vec<_> = faces.exposed.iter().map(|exposed| exposed.free.clone()).collect();
        let over = |weights: &[f64], reference: &[ContactForce]| {
            Dual::over(&self.grasp, sets, &free, weights, reference, None)
        };
        let solver = memory.bounded.as_ref().map(|solver| match solver {
            Solver::Squares(program, _) => Some(program),
            Solver::Shares(_) => None,
        });
        match (&self.program, solver) {
            (_, Some(Some(program))) | (Program::Squares(_, program), None) => {
                let contacts = &program.dual.contacts;
                let weights: Vec<f64> = contacts.iter().map(|contact| contact.weight).collect();
                let reference: Vec<_> = contacts.iter().map(|contact| contact.reference).collect();
                let dual = over(&weights, &reference);
                let target = dual.whitening.wrench(&faces.exerted);
                let ContactForces { forces: f, shares, unique, .. } = forces;
                let start = dual.at(&Wrench::zeros(), &target, f, shares);
                let (point, pivots) = minimise(&dual, &target, start, f, shares);
                if point.gradient.norm().is_nan() || point.gradient.norm() > BALANCED_STEP * point.size {
                    return None;
                }
                *unique = true;
                let sigma = dual.objective(f);
                let gap = point.y.dot(&point.gradient).abs();
                let gap = if gap > 0.0 { gap / sigma } else { 0.0 };
                Some(Certificate { sigma, dual: dual.physical(&point.y), gap, pivots, fell_back: false })
            }
            (Program::Shares(..), _) if is_linear_in_forces(&self.grasp) => {
                let mut dual = over(&weights_of_shares(&self.grasp), &forces.forces);
                let (dual, gap, pivots) = lower_sum(&self.grasp, &mut dual, &faces.exerted, forces)?;
                Some(Certificate { sigma: 0.0, dual, gap, pivots, fell_back: false })
            }
            _ => None,
        }
    }
}

impl<const D: usize> WrenchProjection<D> {
    /// The faces that `normal` exposes, which Newton's method first makes exact.
    fn faces(
        &self,
        b: &Wrench<D>,
        normal: &Wrench<D>,
        touching: f64,
        forces: &mut ContactForces,
    ) -> Option<Faces<D>> {
        let t = self.metric.to_euclidean(b);
        let contacts = || self.dual.contacts.iter().zip(&self.maps);
        let exposed_by = |n: &Wrench<D>| -> Option<Vec<ExposedSet>> {
            contacts()
                .map(|(contact, map)| ExposedSet::along(contact, &map.tr_mul(n), touching * map.norm()))
                .collect()
        };
        let mut exposed = exposed_by(normal)?;
        let within = |exposed: &[ExposedSet], forces: &mut ContactForces| {
            let sets = self.dual.contacts.iter().zip(exposed);
            for ((contact, exposed), force) in sets.zip(&mut forces.forces) {
                *force = contact.with(&exposed.set).project(force).force;
            }
        };
        within(&exposed, forces);
        let mut n = *normal;
        let faces: Vec<_> = exposed.iter().map(|exposed| exposed.face).collect();
        if settle(&self.dual, &self.maps, &faces, &t, &mut n, &mut forces.forces) {
            exposed = exposed_by(&n)?;
        } else {
            n = *normal;
        }
        within(&exposed, forces);
        let along: f64 = contacts().zip(&forces.forces).map(|((_, map), force)| n.dot(&(map * force))).sum();
        let exerted = b - self.metric.to_physical(&(n * (n.dot(&t) - along)));
        Some(Faces { exposed, normal: n, exerted })
    }
}
