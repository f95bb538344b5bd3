//! How the quality of one grasp is computed: outside first, then inside, and closure where neither is clear.
//!
//! *Outside first.* A good part of all grasps is open, and Wolfe's algorithm finds that out in a fraction of a
//! polytope's time: some dozen calls of the oracle end with the distance, with the direction in which it lies, and so
//! with the proof that there is no closure. Outside, the Minkowski sum is no nearer than the union (every point of it is
//! a sum of wrenches on the far side of the separating plane), so `rho_max = rho_sum` there and the union serves both.
//! What is not separated within a few calls is left to the polytope, so closed grasps hardly pay for the attempt.
//!
//! *Inside*, the expanding polytope brackets the radius. A set that holds no ball worth mentioning gets its class from
//! the scaled grasp, and its radius from ever smaller simplices.

use std::cmp::Ordering;

use crate::convex::expanding_polytope::{Expansion, Limits, Progress, Radius, Thinnest};
use crate::convex::min_norm_point::{NearestPoint, nearest_point};
use crate::convex::rounding::{Rounding, along};
use crate::grasp::Wrench;
use crate::interrupt;
use crate::quality::closure::{Closure, Verdict, classify, is_clear, is_separated};
use crate::quality::query::QualityQuery;
use crate::quality::result::{Quality, QualityWorkspace};
use crate::quality::set_rounding::SetRounding;
use crate::quality::symmetry::Symmetries;
use crate::tolerances::{
    DISTANCE_RTOL, EXACT_SYMMETRY, FIRST_SIMPLEX, NEAR_SYMMETRY, NEGLIGIBLE_RADIUS, ON_BOUNDARY,
    ROUNDED_QUOTIENT, SMALLER_SIMPLEX, SMALLEST_RADIUS,
};
use crate::wrench_set::Criterion;

/// Calls of the oracle within which Wolfe's algorithm must separate the origin before the polytope is tried.
const CALLS_BEFORE_POLYTOPE: usize = 16;

/// A polytope of more facets is worth a search for symmetries: some 3 ms, which most grasps do not come near.
pub(crate) const FACETS_BEFORE_SYMMETRY: usize = 10_000;

/// Calls of the oracle that are no reason not to begin again.
const CALLS_WORTH_REPEATING: usize = 1000;

/// Rounding that takes less than this part of a bracket's width is not bounded contact by contact.
const NEGLIGIBLE_WIDTH: f64 = 1e-3;

/// What looking at a grasp with an incumbent in mind yields.
pub(crate) enum Examination<const D: usize> {
    /// `epsilon <= upper`, too little; along the unit `direction` (in Euclidean coordinates).
    Below { upper: f64, direction: Wrench<D> },
    /// The quality, as if there were no incumbent: `lower <= epsilon <= upper`, with the unit direction (in Euclidean
    /// coordinates) along which the set is thinnest.
    Answer { lower: f64, upper: f64, direction: Wrench<D>, converged: bool },
}

impl<const D: usize> QualityQuery<'_, D> {
    pub(crate) fn answer(&self, workspace: &mut QualityWorkspace<D>) -> Quality<D> {
        if let Some(quality) = self.separated() {
            return quality;
        }
        workspace.polytope.allow(self.uncertain());
        let first = self.expand(self.first_size(), &self.limits, workspace);
        self.conclude(first, workspace)
    }

    /// The answer, unless `epsilon` turns out to lie below `stop_below` on the way.
    pub(crate) fn examine(&self, stop_below: f64, workspace: &mut QualityWorkspace<D>) -> Examination<D> {
        let limits = Limits { stop_below, ..self.limits };
        workspace.polytope.allow(self.uncertain());
        let first = self.expand(self.first_size(), &limits, workspace);
        let (upper, direction) = match first {
            Expansion::Radius(Radius { converged: true, .. }) => (f64::INFINITY, Wrench::zeros()),
            Expansion::Radius(Radius { upper, direction, .. })
            | Expansion::Pierced(Thinnest { upper, direction, .. })
            | Expansion::Stopped(Thinnest { upper, direction, .. }) => (upper, direction),
        };
        if upper < stop_below {
            return Examination::Below { upper, direction };
        }
        let Quality { rho, lower, converged, direction, .. } = self.conclude(first, workspace);
        let direction = self.metric.to_euclidean(&direction);
        Examination::Answer { lower: -rho, upper: -lower, direction, converged }
    }

    /// The expanding polytope, helped by the symmetries of the set where it does not end early.
    fn expand(&self, size: f64, limits: &Limits, workspace: &mut QualityWorkspace<D>) -> Expansion<D> {
        let QualityWorkspace { polytope, symmetric, .. } = workspace;
        *symmetric = false;
        let mut oracle = |z: &Wrench<D>| self.support(z);
        polytope.start(size);
        let early = Limits { max_facets: FACETS_BEFORE_SYMMETRY.min(limits.max_facets / 2), ..*limits };
        let mut progress = polytope.grow(&early, &mut oracle);
        let mut known = None;
        if matches!(progress, Progress::Full(_)) {
            let thinnest = *polytope.thinnest();
            if thinnest.upper <= size {
                return Expansion::Pierced(thinnest);
            }
            let symmetries = Symmetries::of(self, NEAR_SYMMETRY * thinnest.upper);
            let exact = symmetries.deviation() <= EXACT_SYMMETRY * limits.rtol * thinnest.upper;
            if exact {
                known = self.radius_by_symmetry(&symmetries, &thinnest, size, limits);
            }
            // What neither closed the bracket nor reached `max_facets` was stopped by rounding.
            if let Some(radius) = known
                && (radius.converged
                    || radius.facets >= limits.max_facets
                    || radius.upper < limits.stop_below)
            {
                *symmetric = true;
                return Expansion::Radius(self.lowered(radius, limits));
            }
            progress = polytope.grow(limits, &mut oracle);
            if !exact && matches!(progress, Progress::Full(_)) {
                known = self.radius_by_symmetry(&symmetries, polytope.thinnest(), size, limits);
            }
            if matches!(progress, Progress::Full(_)) {
                let inscribed = self.inscribed_radius(polytope.thinnest(), size, limits);
                known = match (known, inscribed) {
                    (Some(known), Some(inscribed)) => Some(known.intersection(&inscribed, limits.rtol)),
                    (known, inscribed) => known.or(inscribed),
                };
            }
            *symmetric = known.is_some();
        }
        if matches!(progress, Progress::Full(_)) {
            known = known.map(|radius| self.lowered(radius, limits));
        }
        match (polytope.conclude(progress, size, limits), known) {
            (Expansion::Radius(plain), Some(known)) => {
                Expansion::Radius(plain.intersection(&known, limits.rtol))
            }
            (Expansion::Stopped(_) | Expansion::Pierced(_), Some(known)) => Expansion::Radius(known),
            (plain, None) => plain,
        }
    }

    /// An open bracket with its upper end from a few steps downhill.
    fn lowered(&self, radius: Radius<D>, limits: &Limits) -> Radius<D> {
        let (upper, direction) = self.least_downhill(&radius.direction, radius.lower);
        if radius.converged || upper >= radius.upper {
            return radius;
        }
        Radius { upper: upper.max(radius.lower), direction, ..radius }.settled(limits.rtol)
    }

    /// A set that holds a ball of a thousandth of its size holds the origin well inside: the usual case.
    fn first_size(&self) -> f64 {
        FIRST_SIMPLEX * self.scale
    }

    /// The quality of a grasp whose wrenches all lie beyond a plane, and beyond the tolerance of closure.
    fn separated(&self) -> Option<Quality<D>> {
        if self.center.is_some() {
            return None;
        }
        let nearest = self.nearest(CALLS_BEFORE_POLYTOPE);
        if nearest.lower <= 0.0 {
            return None;
        }
        let functional = self.metric.functional(&nearest.witness);
        let open = is_separated(self.grasp, &self.metric, &functional, nearest.lower, self.scale);
        open.then(|| self.at_distance(&nearest, 0.0, Closure::None))
    }

    fn conclude(&self, first: Expansion<D>, workspace: &mut QualityWorkspace<D>) -> Quality<D> {
        if let (Expansion::Radius(radius), None) = (first, self.center)
            && is_clear(self.grasp, &self.metric, radius.lower, self.scale)
        {
            return self.narrowed(self.inside(&radius, 0.0, Closure::Force));
        }
        let verdict = classify(self.grasp, &mut workspace.scaled);
        let closure = verdict.closure;
        match self.center {
            Some(_) => match self.small_radius(first, NEGLIGIBLE_RADIUS * self.scale, workspace) {
                Ok(radius) => self.narrowed(self.inside(&radius, 0.0, closure)),
                Err(unresolved) => self.about_center(&unresolved, closure),
            },
            None if closure == Closure::Force => {
                let radius = self.small_radius(first, SMALLEST_RADIUS * self.scale, workspace);
                let unknown = |thinnest: Thinnest<D>| Radius {
                    lower: 0.0,
                    upper: thinnest.upper.max(0.0),
                    direction: thinnest.direction,
                    converged: false,
                    supports: thinnest.supports,
                    facets: 0,
                };
                // What the scaled grasp proves is little, but more than nothing.
                let least = verdict.certain(self.grasp, &self.metric);
                self.narrowed(self.inside(&radius.unwrap_or_else(unknown), least, closure))
            }
            None => self.outside(&verdict),
        }
    }

    /// The radius of a set that is thin for its size: from ever smaller simplices. Where even a `negligible` one
    /// does not fit, what is known of it.
    fn small_radius(
        &self,
        first: Expansion<D>,
        negligible: f64,
        workspace: &mut QualityWorkspace<D>,
    ) -> std::result::Result<Radius<D>, Thinnest<D>> {
        let (mut expansion, mut size) = (first, self.first_size());
        loop {
            let thinnest = match expansion {
                Expansion::Radius(radius) => return Ok(radius),
                // What rounding broke early may go well from another simplex; `max_facets` would be reached again.
                Expansion::Stopped(thinnest)
                    if thinnest.supports > CALLS_WORTH_REPEATING || interrupt::stopped() =>
                {
                    return Err(thinnest);
                }
                Expansion::Pierced(thinnest) | Expansion::Stopped(thinnest) => thinnest,
            };
            size = SMALLER_SIMPLEX * size.min(thinnest.upper);
            // Not greater, rather than less: a size that is no number ends the search, too.
            if size.partial_cmp(&negligible) != Some(Ordering::Greater) {
                return Err(thinnest);
            }
            expansion = self.expand(size, &self.limits, workspace);
        }
    }

    /// `least` is a lower bound of the radius that is known besides.
    fn inside(&self, radius: &Radius<D>, least: f64, closure: Closure) -> Quality<D> {
        let direction = self.metric.to_physical(&radius.direction);
        let lost = self.lost_along(&radius.direction, radius.upper);
        let upper = radius.upper + lost + ROUNDED_QUOTIENT * radius.upper;
        let lower = radius.lower.max(least.min(upper));
        Quality {
            rho: -lower,
            lower: -upper,
            upper: -lower,
            converged: radius.converged,
            closure,
            direction,
            wrench: direction * lower,
            supports: radius.supports,
            facets: radius.facets,
            metric: self.metric,
        }
    }

    /// A bound on what is uncertain of `p(z)`, about which so much is known.
    fn lost_along(&self, z: &Wrench<D>, value: f64) -> f64 {
        let rounding = SetRounding { query: self, criterion: self.set.criterion() };
        let of_any_point = along(z, &rounding.of_any_point());
        // A smaller bound would not be seen in the bracket.
        if of_any_point <= NEGLIGIBLE_WIDTH * self.rtol() * value {
            return of_any_point;
        }
        rounding.of_support(z).0
    }

    /// Without a center, where the origin is not inside.
    fn outside(&self, verdict: &Verdict<D>) -> Quality<D> {
        let nearest = self.nearest(usize::MAX);
        if verdict.closure == Closure::None {
            return self.at_distance(&nearest, verdict.certain(self.grasp, &self.metric), verdict.closure);
        }
        let z = self.metric.unit_of_functional(&verdict.direction);
        self.on_boundary(&z, self.value(&z), &nearest, verdict.closure)
    }

    /// With a center, where not even a negligible simplex fits: on the boundary, or outside.
    fn about_center(&self, unresolved: &Thinnest<D>, closure: Closure) -> Quality<D> {
        let rounding = SetRounding { query: self, criterion: self.set.criterion() };
        let negligible = NEGLIGIBLE_RADIUS * self.scale;
        let nearest =
            nearest_point(self.outer_rtol(), negligible, usize::MAX, &rounding, |z| self.support(z));
        if nearest.upper <= 2.0 * negligible && nearest.lower <= 0.0 {
            return self.on_boundary(&unresolved.direction, unresolved.upper, &nearest, closure);
        }
        self.at_distance(&nearest, 0.0, closure)
    }

    /// Wolfe's algorithm on the union within this many calls, unless it finds the origin outside by then.
    fn nearest(&self, max_calls: usize) -> NearestPoint<D> {
        let rounding = SetRounding { query: self, criterion: Criterion::Sum };
        nearest_point(self.outer_rtol(), 0.0, max_calls, &rounding, |z| self.set.union_support(z))
    }

    /// Outside, rounding sets the only price of precision.
    fn outer_rtol(&self) -> f64 {
        self.limits.rtol.min(DISTANCE_RTOL)
    }

    /// `rho = 0`: neither is a ball certain inside, nor a plane outside. The bracket says what both leave open.
    fn on_boundary(
        &self,
        z: &Wrench<D>,
        reach: f64,
        nearest: &NearestPoint<D>,
        closure: Closure,
    ) -> Quality<D> {
        let direction = self.metric.to_physical(z);
        let left = reach.max(0.0) + self.lost_along(z, reach);
        Quality {
            rho: 0.0,
            lower: -left,
            upper: nearest.upper,
            converged: left.max(nearest.upper) <= ON_BOUNDARY * self.scale,
            closure,
            direction,
            wrench: direction * -0.0,
            supports: nearest.supports,
            facets: 0,
            metric: self.metric,
        }
    }

    /// `least` is a lower bound of the distance that is known besides.
    fn at_distance(&self, nearest: &NearestPoint<D>, least: f64, closure: Closure) -> Quality<D> {
        let nearest = self.turned_to(nearest);
        let direction = self.metric.to_physical(&nearest.witness);
        Quality {
            rho: nearest.upper,
            lower: nearest.lower.max(least).min(nearest.upper).max(0.0),
            upper: nearest.upper,
            converged: nearest.converged || nearest.upper - nearest.lower <= self.rtol() * nearest.upper,
            closure,
            direction,
            wrench: direction * -nearest.upper,
            supports: nearest.supports,
            facets: 0,
            metric: self.metric,
        }
    }
}
