//! Friction cones as inequalities, apart from the crate's extreme forces: the planes of pyramids, and the true cones.

use std::f64::consts::{PI, TAU};

use graspforce::{Contact, ContactForce, ForceModel};

/// By how much a force leaves its contact's cone, in N: along the surface, or for a soft finger along the normal.
pub fn slip(contact: &Contact, planar: bool, force: &ContactForce) -> f64 {
    let missing = load(contact, planar, force) - force[0];
    let outside = match contact.friction {
        _ if contact.torsion > 0.0 => missing,
        0.0 => force[1].hypot(force[2]),
        friction => friction * missing,
    };
    outside.max(-force[0])
}

/// The least normal force whose cone holds the tangential force and the torsion of `force`: the pyramid over the
/// contact's edges, or the true cone where it has none. Listed extreme forces are no friction cone.
pub fn load(contact: &Contact, planar: bool, force: &ContactForce) -> f64 {
    let share = |part: f64, coefficient: f64| if part == 0.0 { 0.0 } else { part / coefficient };
    let (o, t) = (share(force[1], contact.friction), share(force[2], contact.friction));
    let twist = share(force[3], contact.torsion).abs();
    let ForceModel::Edges(edges) = contact.forces else { return o.hypot(t).hypot(twist) };
    // Two edges in the plane, and none without friction, are the true cone.
    if planar || contact.friction == 0.0 {
        return o.hypot(t).hypot(twist);
    }
    let tangential = polygon(edges, o, t);
    if contact.torsion == 0.0 {
        return tangential.hypot(twist);
    }
    // The circles of latitude cut the ellipsoid's meridians into a regular polygon, too.
    polygon(4 * (edges / 4).max(2), tangential, twist)
}

/// The factor by which a regular polygon, one of its corners at (1, 0), must grow to hold a point.
fn polygon(corners: usize, x: f64, y: f64) -> f64 {
    let apothem = (PI / corners as f64).cos();
    let along = |h: usize| {
        let (s, c) = (TAU * (h as f64 + 0.5) / corners as f64).sin_cos();
        (x * c + y * s) / apothem
    };
    (0..corners).map(along).fold(0.0, f64::max)
}
