//! The facets of a set nearest to the origin, in the order of their distance.
//!
//! An expansion ends as soon as the nearest facet is known, and leaves those further out unresolved. Grown on in the same
//! way, nearest facet first, the polytope meets the facets of the set one after the other: a facet is one of the set's own
//! where the support along its normal is no further out.

use crate::convex::expanding_polytope::Polytope;
use crate::grasp::Wrench;
use crate::interrupt;
use crate::wrench_set::Support;

/// Which facets are looked for, and at what price.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FacetSearch {
    /// Facets of the set at most.
    pub(crate) count: usize,
    /// The support beyond a facet of the set, relative to its distance: zero but for rounding, or more for smooth sets.
    pub(crate) rtol: f64,
    /// Normals nearer to each other than this count as one.
    pub(crate) apart: f64,
    /// Facets that the polytope may make.
    pub(crate) more_facets: usize,
}

impl<const D: usize> Polytope<D> {
    /// After an expansion: adds directions to `found`, with their supports, until there are `count` of them.
    pub(crate) fn nearest_facets(
        &mut self,
        search: &FacetSearch,
        found: &mut Vec<(f64, Wrench<D>)>,
        oracle: impl Fn(&Wrench<D>) -> Support<D>,
    ) {
        let most = self.boundary.facets_made() + search.more_facets;
        self.boundary.rank_all();
        while found.len() < search.count && !interrupt::stopped() {
            let Some(nearest) = self.boundary.pop_nearest() else { break };
            let z = self.boundary.normal(nearest.facet);
            if found.iter().any(|(_, known)| (known - z).norm() <= search.apart) {
                continue;
            }
            let Support { value, wrench } = oracle(&z);
            if self.boundary.is_within_noise(value, nearest.distance * (1.0 + search.rtol), &z) {
                found.push((value, z));
                continue;
            }
            self.boundary.raise_noise(wrench.norm());
            let full = self.boundary.facets_made() >= most || self.boundary.is_full();
            if full || !self.boundary.add(nearest.facet, wrench, f64::INFINITY) {
                break;
            }
        }
    }
}
