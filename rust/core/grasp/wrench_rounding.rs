//! What rounding may have done to the wrenches of a grasp: a bound for every component, contact by contact.
//!
//! A point of the set is a sum over contacts of `C G_i s`. Its computation starts from the normal as given. Each product
//! and each sum loses at most a unit of rounding of its own size. A component therefore loses at most a small multiple of
//! the unit times the sum of the *sizes* of its terms: `|C| |G_i| |s|`, with the sizes of the frame's components in
//! `|G_i|`. The bound is one per component: a hard metric makes some of them many orders larger than others.

use nalgebra::Vector3;

use crate::grasp::contact::{Contact, ContactForce, ForceModel};
use crate::grasp::wrench::with_torque;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::tolerances::{LEAST_TANGENT, ROUNDED_POINT};

/// The bounds for the contacts of a grasp in the coordinates `A w`, where `magnitude` is `|A|`.
pub(crate) fn of_contacts<const D: usize>(
    grasp: &Grasp<D>,
    magnitude: impl Fn(&Wrench<D>) -> Wrench<D>,
) -> Vec<Wrench<D>> {
    // Adding up as many contacts rounds as often.
    let lost = ROUNDED_POINT + grasp.num_contacts() as f64 * f64::EPSILON;
    let contacts = grasp.contacts().iter().enumerate().map(|(i, contact)| {
        let lever = (contact.position - grasp.options().origin).abs();
        let [n, o, t] = frame_magnitude::<D>(grasp, i);
        let sizes = force_magnitude(grasp, i, contact);
        let force = n * sizes[0] + o * sizes[1] + t * sizes[2];
        let torque = cross_magnitude(&lever, &force) + n * sizes[3];
        magnitude(&with_torque(&force, &torque)) * lost
    });
    contacts.collect()
}

/// `|G_i|` with the sizes of what its entries were computed from, torsion in units of `size`.
pub(crate) fn map_magnitude<const D: usize>(
    grasp: &Grasp<D>,
    i: usize,
    lever: &Vector3<f64>,
    size: f64,
) -> ContactMap<D> {
    let [n, o, t] = frame_magnitude::<D>(grasp, i);
    let mut map = ContactMap::<D>::zeros();
    for (column, axis) in [n, o, t].iter().enumerate() {
        map.set_column(column, &with_torque(axis, &cross_magnitude(lever, axis)));
    }
    if D == 6 {
        map.set_column(3, &with_torque(&Vector3::zeros(), &(n / size)));
    }
    map
}

/// The sizes of what the components of a contact's normal and tangents were computed from.
fn frame_magnitude<const D: usize>(grasp: &Grasp<D>, i: usize) -> [Vector3<f64>; 3] {
    let frame = &grasp.frames()[i];
    let n: Vector3<f64> = frame.column(0).abs();
    if D == 3 {
        let o = frame.column(1).abs();
        return [n, o, cross_magnitude(&n, &o)];
    }
    // The first tangent is a seed less its part along the normal; what that rounds is relative to what is left.
    let o = match &grasp.contacts()[i].tangent {
        Some(tangent) if tangent.amax() > 0.0 => {
            let seed = (tangent / tangent.amax()).normalize();
            let along = frame.column(0).dot(&seed).abs();
            let left = (1.0 - along * along).max(LEAST_TANGENT).sqrt();
            frame.column(1).abs() + (n + seed.abs() * along) / left
        }
        _ => frame.column(1).abs() + n,
    };
    [n, o, cross_magnitude(&n, &o)]
}

/// The largest components of what a contact can exert.
pub(crate) fn force_magnitude<const D: usize>(grasp: &Grasp<D>, i: usize, contact: &Contact) -> ContactForce {
    if let (ForceModel::Extreme(_), Some(range)) = (&contact.forces, grasp.edges(i)) {
        let all = grasp.finite_forces()[range].iter();
        return all.fold(ContactForce::zeros(), |largest, force| largest.sup(&edge_magnitude(force)));
    }
    let (mu, gamma) = (contact.friction, contact.torsion);
    ContactForce::new(1.0, mu, mu, gamma) * contact.max_normal_force
}

/// The sizes of the components of an extreme force; cosine and sine round by the size of both.
pub(crate) fn edge_magnitude(force: &ContactForce) -> ContactForce {
    let tangential = force[1].abs().max(force[2].abs());
    ContactForce::new(force[0].abs(), tangential, tangential, force[3].abs())
}

/// The sizes of a cross product's components.
fn cross_magnitude(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x)
}
