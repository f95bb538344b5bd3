//! The radius of a set that is symmetric about another point than the torque origin.
//!
//! An isometry about the contacts' centre maps contacts to contacts, but it changes torques about the origin, and so the
//! norm. In coordinates with torques about the centre the set keeps its symmetries `g`: `p(g y) = p(y)`. The norm there is
//! `|N y|`. Each orbit is worst where the norm is largest:
//!
//! `min_y p(y) / |N y| = min_{y in C} p(y) / max_g |N g y|`
//!
//! over the chamber `C` of the symmetries. The maximum is a norm, too: it ranks the planes of the polytope.

use nalgebra::{SMatrix, Vector3};

use crate::convex::expanding_polytope::{Limits, Radius, Thinnest};
use crate::grasp::{Grasp, GraspOptions};
use crate::quality::query::QualityQuery;
use crate::quality::result::QualityOptions;
use crate::quality::symmetric_radius::{NormOfOrbits, symmetric_radius};
use crate::quality::symmetry::Symmetries;
use crate::tolerances::NEAR_SYMMETRY;

impl<const D: usize> QualityQuery<'_, D> {
    /// The radius by the symmetries of the set about the torque origin, or about the centre of its contacts; `None` where
    /// there are none, or they lead nowhere.
    pub(crate) fn radius_by_symmetry(
        &self,
        symmetries: &Symmetries<D>,
        thinnest: &Thinnest<D>,
        size: f64,
        limits: &Limits,
    ) -> Option<Radius<D>> {
        if symmetries.are_none() {
            return self.radius_about_centre(thinnest, limits);
        }
        symmetric_radius(self, symmetries, None, thinnest, size, limits)
    }

    fn radius_about_centre(&self, thinnest: &Thinnest<D>, limits: &Limits) -> Option<Radius<D>> {
        if D != 6 {
            return None;
        }
        let contacts = self.grasp.contacts();
        let given = self.grasp.options();
        let origin = contacts.iter().map(|c| c.position / contacts.len() as f64).sum();
        // The coefficients of friction have been divided by the margin already.
        let centred = GraspOptions { friction_margin: 1.0, origin, ..*given };
        let grasp = Grasp::<D>::with_options(contacts, centred).ok()?;
        let shift = origin - given.origin;
        // What a functional on wrenches about the centre is on wrenches about the origin.
        let back = |shift: &Vector3<f64>| {
            let cross = shift.cross_matrix();
            let mut map = SMatrix::<f64, D, D>::identity();
            map.fixed_view_mut::<3, 3>(0, D - 3).copy_from(&cross);
            map
        };
        let (moved, returned) = (back(&shift), back(&-shift));
        let norm = self.metric.conjugate(&moved);
        let spread = self.metric.conjugate(&returned).norm();
        let options = QualityOptions {
            external_wrench: self.center.map(|(given, _)| moved.tr_mul(&given)),
            metric: Some(self.metric),
            ..QualityOptions::new(self.set.criterion())
        };
        let inner = QualityQuery::new(&grasp, &options).ok()?;
        let symmetries = Symmetries::of(&inner, NEAR_SYMMETRY * thinnest.upper / spread);
        if symmetries.maps.is_empty() {
            return None;
        }
        let orbits = NormOfOrbits::new(&norm, spread, &symmetries);
        let direction = self.metric.conjugate(&returned) * thinnest.direction;
        let inside = Thinnest { direction: direction.normalize(), ..*thinnest };
        let found = symmetric_radius(&inner, &symmetries, Some(&orbits), &inside, f64::INFINITY, limits)?;
        let (mut upper, mut direction) = (thinnest.upper, thinnest.direction);
        if found.upper < upper {
            let z = orbits.longest_image(&found.direction).normalize();
            let value = self.value(&z);
            if value < upper {
                (upper, direction) = (value, z);
            }
        }
        let lower = found.lower.min(upper);
        Some(Radius { lower, upper, direction, ..found }.settled(limits.rtol))
    }
}
