//! Thin wrench sets: their bracket and their class in coordinates where they are round.

use nalgebra::SMatrix;

use crate::convex::round_coordinates::{RoundSet, round_map};
use crate::convex::rounding::force_magnitude;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::quality::query::QualityQuery;
use crate::quality::result::Quality;
use crate::tolerances::{CLOSED_BRACKET, QUALITY_RTOL};

/// The longest wrenches of each contact along the axes of its frame, by maps `G_i`, all contacts in units of `size(i)`.
pub(crate) fn axes_of_contacts<const D: usize>(
    grasp: &Grasp<D>,
    maps: &[ContactMap<D>],
    size: impl Fn(usize) -> f64,
) -> Vec<Wrench<D>> {
    let of_contact = |(i, map): (usize, &ContactMap<D>)| {
        let forces = force_magnitude(grasp, i, &grasp.contacts()[i]) / size(i);
        let axes: Vec<Wrench<D>> =
            map.column_iter().zip(forces.iter()).map(|(column, by)| column * *by).collect();
        axes
    };
    maps.iter().enumerate().flat_map(of_contact).collect()
}

impl<const D: usize> QualityQuery<'_, D> {
    /// The answer with the bracket of a radius narrowed where rounding left it wider than asked for.
    pub(crate) fn narrowed(&self, found: Quality<D>) -> Quality<D> {
        let rtol = self.rtol().max(QUALITY_RTOL);
        let wide = -found.lower > -found.upper * (1.0 + CLOSED_BRACKET * rtol);
        if !wide || found.facets >= self.limits.max_facets {
            return found;
        }
        self.narrowed_by_round_coordinates(&found).unwrap_or(found)
    }

    fn narrowed_by_round_coordinates(&self, found: &Quality<D>) -> Option<Quality<D>> {
        let map: SMatrix<f64, D, D> = round_map(axes_of_contacts(self.grasp, self.grasp.maps(), |_| 1.0))?;
        let round = self.through(&map);
        let norm = self.metric.functionals_to_euclidean(&map.transpose());
        let set = RoundSet {
            norm: &norm,
            uncertain: round.uncertain(),
            longest: round.scale,
            oracle: |z: &Wrench<D>| round.support(z),
        };
        let radius = set.radius(&self.limits).ok()?;
        let mut narrowed = Quality {
            upper: found.upper.min(-radius.lower),
            converged: true,
            supports: found.supports + radius.supports,
            facets: found.facets + radius.facets,
            ..*found
        };
        if radius.upper < -found.lower {
            narrowed.lower = -radius.upper;
            narrowed.direction = self.metric.to_physical(&(norm * radius.direction).normalize());
        }
        // Two valid brackets meet; what is left of their difference is rounding.
        narrowed.lower = narrowed.lower.min(narrowed.upper);
        narrowed.converged = found.converged || radius.converged;
        narrowed.rho = narrowed.upper;
        narrowed.wrench = narrowed.direction * -narrowed.upper;
        Some(narrowed)
    }
}
