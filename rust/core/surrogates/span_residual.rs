//! The least wrench of forces whose edges all take part (`GraspQP`): `min |sum_j x_j w_j|` over `1 <= x_j <= limit`.
//!
//! The wrenches are a zonotope, `sum_j w_j` plus up to `limit - 1` times each `w_j`. Its support is a sum over edges, so its
//! point of least norm follows from the oracle alone. At that point the norm changes as the wrench of the same forces does.

use crate::convex::min_norm_point::nearest_point;
use crate::error::Result;
use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::surrogates::{SurrogateValue, determine_forces, norm_of_forces, with_gradient};
use crate::tolerances::SUPPORTED;
use crate::tolerances::{DISTANCE_RTOL, ROUNDED_RESIDUAL};
use crate::wrench_set::Support;

pub(crate) fn span_residual<const D: usize>(grasp: &Grasp<D>, limit: f64) -> Result<SurrogateValue> {
    let metric = Metric::from_length_scale(grasp.options().length_scale);
    let wrenches = grasp.primitive_wrenches()?;
    let extreme = grasp.extreme_forces()?;
    let wrenches: Vec<Wrench<D>> = wrenches.iter().map(|wrench| metric.to_euclidean(wrench)).collect();
    let least: Wrench<D> = wrenches.iter().sum();
    let size: f64 = wrenches.iter().map(Wrench::norm).sum();
    let mut calls: Vec<Wrench<D>> = Vec::new();
    let negligible = ROUNDED_RESIDUAL * size * limit;
    let nearest = nearest_point(DISTANCE_RTOL, negligible, usize::MAX, &Wrench::zeros(), |z| {
        calls.push(*z);
        let pulling = wrenches.iter().filter(|wrench| wrench.dot(z) > 0.0);
        let wrench = least + pulling.sum::<Wrench<D>>() * (limit - 1.0);
        Support { value: wrench.dot(z), wrench }
    });
    interrupt::check()?;
    let mut coefficients = vec![1.0; wrenches.len()];
    for (call, weight) in nearest.combination.into_iter().filter(|(_, weight)| *weight > 0.0) {
        let pulled =
            coefficients.iter_mut().zip(&wrenches).filter(|(_, wrench)| wrench.dot(&calls[call]) > 0.0);
        pulled.for_each(|(x, _)| *x += weight * (limit - 1.0));
    }
    let mut forces = vec![ContactForce::zeros(); grasp.num_contacts()];
    for (i, force) in forces.iter_mut().enumerate() {
        *force = grasp.edges(i).into_iter().flatten().map(|edge| extreme[edge] * coefficients[edge]).sum();
    }
    if nearest.upper <= negligible {
        // Around it the residual mostly is zero, too.
        return Ok(with_gradient(grasp, 0.0, (&Wrench::zeros(), &forces), false));
    }
    // The residual leaves the coefficients of wrenches across it open.
    let direction = nearest.point / nearest.point.norm();
    let across = |edge: usize| wrenches[edge].dot(&direction).abs() <= SUPPORTED * wrenches[edge].norm();
    Ok(norm_of_forces(grasp, &forces, determine_forces(grasp, across)))
}
