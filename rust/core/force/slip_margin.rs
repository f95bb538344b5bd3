//! The share of a contact's friction that a force leaves unused: `1 - 1 / s`, where friction force and torsion may grow by
//! the factor `s` beside the same normal force before the contact slips.

use crate::force::squares::polytope::Polytope;
use crate::grasp::contact::ContactForce;

/// Cuts of the ray along which a force grows; a few are usual.
const MAX_CUTS: usize = 64;

/// What rounding leaves of the distance between a force and the cone, relative to the force.
const ROUNDED: f64 = 1e-13;

/// Of friction cones with these coefficients.
pub(crate) fn unused_friction(force: &ContactForce, mu: f64, gamma: f64) -> f64 {
    if mu == 0.0 && gamma == 0.0 {
        return 0.0;
    }
    if force[0] <= 0.0 {
        return 1.0;
    }
    let share = |load: f64, coefficient: f64| if load == 0.0 { 0.0 } else { load / coefficient };
    let used = share(force[1].hypot(force[2]), mu).hypot(share(force[3], gamma));
    1.0 - used / force[0]
}

/// Of the cone that extreme forces span.
pub(crate) fn unused_cone(force: &ContactForce, extreme: &[ContactForce]) -> f64 {
    // Torsions may be orders smaller than forces.
    let largest = extreme.iter().fold(ContactForce::zeros(), |most, force| most.sup(&force.abs()));
    let unit = largest.map(|most| if most > 0.0 { most } else { 1.0 });
    if largest.rows_range(1..).amax() == 0.0 {
        return 0.0;
    }
    let edges = extreme.iter().filter(|edge| edge.amax() > 0.0);
    let edges = edges.map(|edge| edge.component_div(&unit).normalize()).collect();
    1.0 - growth(&Polytope::new(edges, true), &force.component_div(&unit)).recip()
}

/// The factor by which the tangential part of a force reaches the boundary of a cone; infinite where it never does. Planes
/// between the cone and points beyond it cut the ray ever shorter.
fn growth(cone: &Polytope, force: &ContactForce) -> f64 {
    let normal = ContactForce::new(force[0], 0.0, 0.0, 0.0);
    let tangential = force - normal;
    if tangential.norm() <= ROUNDED * force.norm() {
        return f64::INFINITY;
    }
    let beyond = tangential - cone.project(&tangential).force;
    if beyond.norm() <= ROUNDED * tangential.norm() {
        return f64::INFINITY;
    }
    let mut grown = -beyond.dot(&normal) / beyond.dot(&tangential);
    for _ in 0..MAX_CUTS {
        let point = normal + tangential * grown;
        let beyond = point - cone.project(&point).force;
        let slope = beyond.dot(&tangential);
        if beyond.norm() <= ROUNDED * point.norm() || slope <= 0.0 {
            break;
        }
        // The plane goes through the nearest point: what is left is its distance, whatever rounding does to its normal.
        grown -= beyond.norm_squared() / slope;
    }
    grown.max(f64::EPSILON)
}
