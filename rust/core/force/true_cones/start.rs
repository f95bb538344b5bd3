//! The first point of Newton's method: statuses of contacts from forces and a multiplier that are nearly optimal.
//!
//! At the optimum either a force or its multiplier leaves room: the larger one of both tells which.

use nalgebra::SVector;

use crate::force::true_cones::contact_status::{ContactStatus, load};
use crate::force::true_cones::optimal_point::{ConeConditions, OptimalPoint};
use crate::grasp::contact::ContactForce;

/// A contact whose multiplier turns by less than this may stick, wherever its force lies.
const STICKING_TURN: f64 = 1e-6;

/// Makes a point of a multiplier and the contact forces for a wrench of unit size. With a
/// `weight` above one the multipliers decide rather than the forces, below one the forces.
pub(crate) fn classify<const D: usize>(
    conditions: &ConeConditions<D>,
    point: &mut OptimalPoint<D>,
    z: SVector<f64, D>,
    forces: &[ContactForce],
    weight: f64,
) {
    point.z = z;
    let mut longest = 0.0_f64;
    let mut level = 0.0_f64;
    for ((cone, at), force) in conditions.cones.iter().zip(&mut point.contacts).zip(forces) {
        at.x = cone.coordinates(force);
        at.v = cone.conjugate(&z);
        at.guessed = false;
        longest = longest.max(at.v.amax());
        level = level.max(at.x[0]);
    }
    point.level = level;
    for (cone, at) in conditions.cones.iter().zip(&mut point.contacts) {
        let excess = at.v[0] + load(&at.v) - conditions.price;
        let share = at.x[0] / level;
        if -excess * weight >= share {
            at.status = ContactStatus::Idle;
            continue;
        }
        let full = conditions.bounded && excess * weight > 1.0 - share;
        // Column generation puts forces on their cones, also where none has to be there.
        let inside = (1.0 - load(&at.x) / at.x[0]).max(STICKING_TURN);
        let sticks = cone.dim > 1 && inside * longest > load(&at.v) * weight;
        at.status = match (full, sticks) {
            (false, false) => ContactStatus::Sliding,
            (false, true) => ContactStatus::Sticking,
            (true, false) => ContactStatus::FullSliding,
            (true, true) => ContactStatus::FullSticking,
        };
    }
}
