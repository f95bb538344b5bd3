//! Weak duality: `z . b <= p(z) sigma` for all forces that balance `b` and cost `sigma` (Eq. 26).
//!
//! The forces of an answer balance `b = residual - w_ext`. Beside a contact far away the tolerance of balance admits
//! residuals as large as a whole component of the wrench, so the bound of `-w_ext` alone says nothing of these forces.

use graspforce::{Contact, ContactForce, Distribution, ForceModel, Grasp, Wrench, WrenchSet};

/// What rounding may cost, relative to the terms of a product.
const ROUNDING: f64 = 1e-6;

/// What rounding of forces and wrenches may cost, relative to the terms of a contact's product.
const ROUNDED_TERMS: f64 = 1e-13;

/// The multiplier proves the objective the least for the wrench that the forces balance, up to `allowed`.
pub fn assert_proven<const D: usize>(
    grasp: &Grasp<D>,
    external: &Wrench<D>,
    found: &Distribution<D>,
    allowed: f64,
) {
    let product =
        |w: &Wrench<D>| -> f64 { w.iter().zip(found.dual.iter()).map(|(a, b)| (a * b).abs()).sum() };
    let proven = (found.residual - external).dot(&found.dual);
    let terms = product(external) + product(&found.residual);
    let exerted: f64 = found.contact_wrenches(grasp).iter().map(product).sum();
    let off = (proven - found.sigma).abs();
    let rounded = ROUNDED_TERMS * exerted + rounded_reach(grasp, found) * found.sigma;
    let allowed = allowed.max(ROUNDING) * terms.max(found.sigma) + rounded;
    assert!(off <= allowed, "dual proves {proven:e} of {:e}: {found:?}", found.sigma);
}

/// The multiplier reaches no point of the wrench set beyond one, so what it proves of any wrench holds.
pub fn assert_reaches_one<const D: usize>(set: &WrenchSet<D>, grasp: &Grasp<D>, found: &Distribution<D>) {
    let reach = set.value(&found.dual);
    let rounded = rounded_reach(grasp, found);
    assert!(reach <= 1.0 + ROUNDING + rounded, "p(z) = {reach:e}: {found:?}");
}

/// How far rounding of the multiplier moves what it reaches.
fn rounded_reach<const D: usize>(grasp: &Grasp<D>, found: &Distribution<D>) -> f64 {
    let terms = |i: usize| {
        let along = grasp.maps()[i].abs().tr_mul(&found.dual.abs());
        strongest(&grasp.contacts()[i]).iter().map(|force| along.dot(force)).fold(0.0, f64::max)
    };
    ROUNDED_TERMS * (0..grasp.num_contacts()).map(terms).sum::<f64>()
}

/// Forces whose components are at least those of any force of a contact.
fn strongest(contact: &Contact) -> Vec<ContactForce> {
    if let ForceModel::Extreme(forces) = &contact.forces {
        return forces.iter().map(ContactForce::abs).collect();
    }
    let (friction, torsion) = (contact.friction, contact.torsion);
    vec![ContactForce::new(1.0, friction, friction, torsion) * contact.max_normal_force]
}
