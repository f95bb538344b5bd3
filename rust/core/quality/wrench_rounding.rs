//! What rounding may have done to the wrenches of a grasp: a bound for every component, contact by contact.
//!
//! A point of the set is a sum over contacts of `C G_i s`. Its computation starts from the normal as given. Each product
//! and each sum loses at most a unit of rounding of its own size. A component therefore loses at most a small multiple of
//! the unit times the sum of the *sizes* of its terms: `|C| |G_i| |s|`, with the sizes of the frame's components in
//! `|G_i|`. The bound is one per component: a hard metric makes some of them many orders larger than others.

use nalgebra::Vector3;

use crate::convex::rounding::{Rounding, along};
use crate::grasp::contact::{Contact, ContactForce, ForceModel};
use crate::grasp::wrench::with_torque;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::quality::query::QualityQuery;
use crate::tolerances::{LEAST_TANGENT, ROUNDED_POINT};
use crate::wrench_set::Criterion;

/// What rounding has done to the union, or to the Minkowski sum, about a center or not.
pub(crate) struct SetRounding<'a, const D: usize> {
    pub(crate) query: &'a QualityQuery<'a, D>,
    pub(crate) criterion: Criterion,
}

impl<const D: usize> Rounding<D> for SetRounding<'_, D> {
    fn of_any_point(&self) -> Wrench<D> {
        let (contacts, center) = self.query.rounding();
        let all = match self.criterion {
            Criterion::Max => contacts.iter().sum(),
            Criterion::Sum => contacts.iter().fold(Wrench::zeros(), |all: Wrench<D>, lost| all.sup(lost)),
        };
        all + center
    }

    fn of_support(&self, z: &Wrench<D>) -> (f64, Wrench<D>) {
        let (contacts, center) = self.query.rounding();
        // The best contact, and the sum of those that push: as computed, and with what rounding may have taken.
        let (mut best, mut sum) =
            ((f64::NEG_INFINITY, f64::NEG_INFINITY, center), (0.0, 0.0, Wrench::zeros()));
        for (i, lost) in contacts.iter().enumerate() {
            let value = self.query.set.contact_value(i, z);
            let at_most = value + along(z, lost);
            best.1 = at_most.max(best.1);
            if value > best.0 {
                (best.0, best.2) = (value, lost);
            }
            if value > 0.0 {
                sum.0 += value;
                sum.2 += lost;
            }
            sum.1 += at_most.max(0.0);
        }
        let sums = self.criterion == Criterion::Max;
        let value = if sums && sum.0 > 0.0 { sum.0 } else { best.0 };
        let at_most = if sums && sum.1 > 0.0 { sum.1 } else { best.1 };
        let uncertain = if sums && sum.0 > 0.0 { sum.2 } else { *best.2 };
        if self.query.center.is_none() {
            return (at_most - value, uncertain);
        }
        // About a center, the origin belongs to the set.
        (at_most.max(0.0) - value.max(0.0) + along(z, center), uncertain + center)
    }
}

impl<const D: usize> QualityQuery<'_, D> {
    /// What rounding may have done to each component of the set's points.
    pub(crate) fn uncertain(&self) -> Wrench<D> {
        SetRounding { query: self, criterion: self.set.criterion() }.of_any_point()
    }
}

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
