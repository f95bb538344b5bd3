//! A lower bound of the radius from the true cones that linearised ones contain.
//!
//! Linearised cones whose edges point in any direction share no symmetry, although the true cones do. An inscribed true
//! cone has the same axis and smaller coefficients, so the set that it gives lies in the wrench set, has the symmetries,
//! and loses little where edges are many:
//!
//! - A polygon of `l` edges contains the circle of `cos(pi / l)` times its radius.
//! - The latitudes of a soft finger are `pi / (2 q)` apart. Along a direction between two of them, the force on the nearer
//!   one reaches `cos(pi / (4 q))` of what the ellipse through them reaches.
//!
//! The bound is lower by some `(pi / l)^2 / 2`, twice that for soft fingers: 1e-2 at 32 edges, 6e-4 at 128.

use std::f64::consts::PI;

use crate::convex::expanding_polytope::{Limits, Radius, Thinnest};
use crate::grasp::contact::{Contact, ForceModel, latitudes};
use crate::grasp::{Grasp, GraspOptions};
use crate::quality::query::QualityQuery;
use crate::quality::result::QualityOptions;
use crate::quality::symmetry::Symmetries;
use crate::tolerances::{INSCRIBED_RTOL, NEAR_SYMMETRY, ROUNDED_QUOTIENT};

/// Cones of fewer edges contain true ones that are too small to say anything.
const FEWEST_EDGES: usize = 24;

impl<const D: usize> QualityQuery<'_, D> {
    /// The bracket whose lower end comes from the symmetries of the inscribed true cones; `None` where contacts are not
    /// linearised finely, or there is no symmetry.
    pub(crate) fn inscribed_radius(
        &self,
        thinnest: &Thinnest<D>,
        size: f64,
        limits: &Limits,
    ) -> Option<Radius<D>> {
        let given = self.grasp.contacts();
        if D != 6 || given.iter().all(|contact| contact.forces == ForceModel::Cone) {
            return None;
        }
        let contacts: Option<Vec<_>> = given.iter().map(inscribed).collect();
        // The coefficients of friction have been divided by the margin already.
        let in_place = GraspOptions { friction_margin: 1.0, ..*self.grasp.options() };
        let grasp = Grasp::<D>::with_options(&contacts?, in_place).ok()?;
        let options = QualityOptions {
            external_wrench: self.center.map(|(physical, _)| physical),
            metric: Some(self.metric),
            ..QualityOptions::new(self.set.criterion())
        };
        let inner = QualityQuery::new(&grasp, &options).ok()?;
        let symmetries = Symmetries::of(&inner, NEAR_SYMMETRY * thinnest.upper);
        let known = Thinnest { upper: inner.value(&thinnest.direction), ..*thinnest };
        if known.upper <= size {
            return None;
        }
        let limits = Limits { rtol: INSCRIBED_RTOL.max(limits.rtol), ..*limits };
        let radius = inner.radius_by_symmetry(&symmetries, &known, size, &limits)?;
        let images = symmetries.maps.iter().map(|symmetry| symmetry.map * radius.direction);
        let (mut upper, mut direction) = (thinnest.upper, thinnest.direction);
        for image in images.chain([radius.direction]) {
            let (value, z) = self.least_downhill(&image.normalize(), radius.lower);
            if value < upper {
                (upper, direction) = (value, z);
            }
        }
        let lower = radius.lower.min(upper);
        Some(Radius { upper, direction, converged: false, lower, ..radius })
    }
}

/// The contact with the largest true cone of the same axis that its linearised one contains.
fn inscribed(contact: &Contact) -> Option<Contact> {
    let edges = match contact.forces {
        ForceModel::Cone => return Some(contact.clone()),
        ForceModel::Edges(edges) if edges >= FEWEST_EDGES => edges,
        _ => return None,
    };
    let polygon = (PI / edges as f64).cos() * (1.0 - ROUNDED_QUOTIENT);
    let circle = if contact.torsion > 0.0 { (PI / (4 * latitudes(edges)) as f64).cos() } else { 1.0 };
    let mut inner = contact.clone().cone();
    inner.friction *= polygon * circle;
    inner.torsion *= circle * (1.0 - ROUNDED_QUOTIENT);
    Some(inner)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::grasp::Wrench;
    use crate::wrench_set::{Criterion, WrenchSet};

    #[test]
    fn linearised_cones_contain_the_inscribed_ones() {
        for (edges, torsion) in [(24, 0.0), (33, 0.0), (32, 0.02), (27, 0.3), (64, 0.01)] {
            let mut contact = Contact::new(Vector3::new(0.1, 0.2, 0.3), Vector3::x()).torsion(torsion);
            contact.forces = ForceModel::Edges(edges);
            let set = |contact: &Contact| {
                WrenchSet::new(&Grasp::<6>::new(std::slice::from_ref(contact)).unwrap(), Criterion::Sum)
            };
            let (outer, inner) = (set(&contact), set(&inscribed(&contact).unwrap()));
            for k in 0..5000 {
                let z = Wrench::<6>::from_fn(|row, _| ((row + 1) as f64 * (f64::from(k) + 0.5)).sin())
                    .normalize();
                assert!(inner.value(&z) <= outer.value(&z) + 1e-15, "{edges} {torsion} {z}");
            }
        }
    }
}
