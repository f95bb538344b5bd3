//! The expanding polytope: the largest ball about the origin inside a convex set known by its support
//! function (Eqs. 16 to 19 and Theorem 1).
//!
//! A polytope grows from a small artificial simplex towards the set, always where it is thinnest: the facet
//! nearest to the origin bounds the radius from below, the support function along its normal bounds it from
//! above, and a support point becomes a new vertex. Only the neighbourhood of the minimum is ever resolved.
//!
//! **Polishing.** Of a Minkowski sum, a new vertex costs far more than a call of the oracle. So the direction is first
//! turned from the facet's normal downhill on the sphere, by Polyak's subgradient steps as if the lower bound were the
//! minimum, and the polytope grows there: close to the end rather than step by step. The certificate needs nothing
//! new. Every `p(z)` met on the way bounds the radius from above, whatever led to `z`; every vertex is a support
//! point, so the polytope stays inside the set and its facets bound the radius from below. Only progress is at stake:
//! the new vertex must cut the nearest facet nearly as deep as the plain one, or that facet would keep coming back.
//!
//! [`boundary`]: the facets and their certificates; [`facet`]: one of them; [`ridge_table`]: its neighbours;
//! [`plane_norm`]: the norm of planes; [`nearest_facets`]: the facets nearest to the origin.

pub(crate) mod boundary;
pub(crate) mod facet;
pub(crate) mod nearest_facets;
pub(crate) mod plane_norm;
pub(crate) mod ridge_table;

use crate::convex::expanding_polytope::boundary::Boundary;
use crate::convex::expanding_polytope::plane_norm::PlaneNorm;
use crate::grasp::Wrench;
use crate::interrupt;
use crate::tolerances::{BEYOND_PLANE, CLOSED_BRACKET, RIVAL_DIRECTION, RIVAL_RADIUS};
use crate::wrench_set::Support;

/// Facets at most, unless the caller allows more: `python benches/facets.py` prints time and memory. Only sets whose
/// nearest boundary points are a continuum, or nearly so, come near it.
pub const DEFAULT_MAX_FACETS: usize = 300_000;

/// Steps of polishing at most; the first that does not lead downhill ends it.
pub(crate) const POLISH: usize = 8;

/// What part of the plain cut a polished vertex must cut.
const LEAST_CUT: f64 = 0.3;

/// When to stop, and how to get there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// Relative width of the bracket that counts as converged.
    pub(crate) rtol: f64,
    /// Number of facets after which the bracket is returned as it is.
    pub(crate) max_facets: usize,
    /// The caller does not care for the radius once it is known to lie below this ...
    pub(crate) stop_below: f64,
    /// ... or above this.
    pub(crate) stop_above: f64,
    /// Downhill steps from a facet's normal before the polytope grows; zero where facets are as cheap as the oracle.
    pub(crate) polish: usize,
}

impl Limits {
    /// Stops only at the tolerance, or at [`DEFAULT_MAX_FACETS`].
    pub(crate) fn new(rtol: f64) -> Self {
        Self {
            rtol,
            max_facets: DEFAULT_MAX_FACETS,
            stop_below: f64::NEG_INFINITY,
            stop_above: f64::INFINITY,
            polish: 0,
        }
    }
}

/// What the polytope knows of the radius when it stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Radius<const D: usize> {
    /// The ball of this radius lies in the set.
    pub(crate) lower: f64,
    /// No larger ball does.
    pub(crate) upper: f64,
    /// The unit direction whose support value is `upper`.
    pub(crate) direction: Wrench<D>,
    /// Whether the bracket is as narrow as asked for.
    pub(crate) converged: bool,
    /// Calls of the oracle.
    pub(crate) supports: usize,
    /// Facets made in all.
    pub(crate) facets: usize,
}

impl<const D: usize> Radius<D> {
    /// The same bracket, converged if it is as narrow as asked for.
    pub(crate) fn settled(self, rtol: f64) -> Self {
        Self { converged: self.upper <= self.lower * (1.0 + CLOSED_BRACKET * rtol), ..self }
    }

    /// What two brackets of the same radius prove together.
    pub(crate) fn intersection(&self, other: &Self, rtol: f64) -> Self {
        let Self { upper, direction, .. } = if other.upper < self.upper { *other } else { *self };
        let lower = self.lower.max(other.lower).min(upper);
        Self {
            lower,
            upper,
            direction,
            converged: self.converged || other.converged || upper <= lower * (1.0 + 1.001 * rtol),
            supports: self.supports + other.supports,
            facets: self.facets + other.facets,
        }
    }
}

/// How an expansion ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Expansion<const D: usize> {
    /// The set contains a ball around the origin, and this is its radius.
    Radius(Radius<D>),
    /// The set does not contain the artificial simplex: its support along the direction is too small.
    Pierced(Thinnest<D>),
    /// It ended before either was known: at `stop_below`, at `max_facets`, or where rounding broke the boundary.
    Stopped(Thinnest<D>),
}

/// How far an expansion has got.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Progress {
    /// Nothing is left to do; no ball inside the set is known to be larger than this.
    Done(f64),
    /// `max_facets` is reached; with a larger one [`Polytope::grow`] goes on from here.
    Full(f64),
    /// Rounding broke the boundary.
    Broken,
}

/// The least support value that the oracle has given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Thinnest<const D: usize> {
    /// `p(direction)`: no ball around the origin inside the set is larger.
    pub(crate) upper: f64,
    /// Of unit length, or of the norm 1.
    pub(crate) direction: Wrench<D>,
    /// Calls of the oracle.
    pub(crate) supports: usize,
}

/// The memory of an expansion, to be reused: after a few grasps it no longer allocates.
#[derive(Debug, Clone)]
pub(crate) struct Polytope<const D: usize> {
    boundary: Boundary<D>,
    thinnest: Thinnest<D>,
}

impl<const D: usize> Polytope<D> {
    pub(crate) fn new() -> Self {
        Self { boundary: Boundary::new(), thinnest: Thinnest::unknown() }
    }

    /// States what rounding has done to each component of the points that the oracle of later expansions gives.
    pub(crate) fn allow(&mut self, uncertain: Wrench<D>) {
        self.boundary.allow(uncertain);
    }

    /// The radius of the set behind `oracle`, starting from a simplex whose vertices have length `size`.
    ///
    /// `oracle(z)` answers for unit `z`.
    pub(crate) fn expand(
        &mut self,
        size: f64,
        limits: &Limits,
        mut oracle: impl FnMut(&Wrench<D>) -> Support<D>,
    ) -> Expansion<D> {
        self.start(size);
        let progress = self.grow(limits, &mut oracle);
        self.conclude(progress, size, limits)
    }

    /// Starts from a simplex whose vertices have length `size`.
    pub(crate) fn start(&mut self, size: f64) {
        self.start_in(size, PlaneNorm::Euclidean);
    }

    /// The same, with distances by a norm. The oracle is then asked for directions of the norm 1.
    pub(crate) fn start_in(&mut self, size: f64, norm: PlaneNorm<D>) {
        self.boundary.start(size, norm);
        self.thinnest = Thinnest::unknown();
    }

    /// What the oracle's answers so far say of the radius.
    pub(crate) fn thinnest(&self) -> &Thinnest<D> {
        &self.thinnest
    }

    /// Expands until the bracket is closed or `max_facets` is reached; with other limits it goes on from there.
    pub(crate) fn grow(
        &mut self,
        limits: &Limits,
        oracle: &mut impl FnMut(&Wrench<D>) -> Support<D>,
    ) -> Progress {
        let rtol = limits.rtol.max(4.0 * BEYOND_PLANE);
        loop {
            // With none left, all facets lie beyond the best upper bound.
            let Some(nearest) = self.boundary.pop_nearest() else {
                return Progress::Done(self.thinnest.upper);
            };
            let lower = nearest.distance;
            // A facet that stays is ranked again: a narrower bracket may be asked for later.
            if self.closed(lower, rtol) || lower > limits.stop_above {
                self.boundary.put_back(nearest);
                return Progress::Done(lower);
            }
            let plane = self.boundary.plane(nearest.facet);
            let z = self.boundary.normal(nearest.facet);
            let support = self.ask(&z, oracle);
            if interrupt::stopped() || self.settled(lower, rtol, limits) {
                self.boundary.put_back(nearest);
                return Progress::Done(lower);
            }
            if self.boundary.facets_made() >= limits.max_facets || self.boundary.is_full() {
                self.boundary.put_back(nearest);
                return Progress::Full(lower);
            }
            let vertex = self.polished(&plane, z, support, lower, limits.polish, oracle);
            if self.settled(lower, rtol, limits) {
                self.boundary.put_back(nearest);
                return Progress::Done(lower);
            }
            if !self.boundary.add(nearest.facet, vertex, self.thinnest.upper) {
                return Progress::Broken;
            }
        }
    }

    /// What an expansion proves of the radius; a `size` of zero says that the first simplex lies in the set.
    pub(crate) fn conclude(&self, progress: Progress, size: f64, limits: &Limits) -> Expansion<D> {
        let rtol = limits.rtol.max(4.0 * BEYOND_PLANE);
        let (Progress::Done(lower) | Progress::Full(lower)) = progress else {
            return Expansion::Stopped(self.thinnest);
        };
        let Thinnest { upper, direction, supports } = self.thinnest;
        if upper < limits.stop_below && !self.closed(lower, rtol) {
            return Expansion::Stopped(self.thinnest);
        }
        // What lies beyond the upper bound was never ranked, so no facet is known to be further out than both bounds.
        let reached = lower.min(upper);
        // A ball larger than `size` holds the artificial vertices: none of them is a corner, and the polytope, with its
        // ball, lies in the set.
        let certified = if reached > size && self.boundary.surrounds_origin() {
            self.boundary.certified_radius((upper / (1.0 + rtol)).min(reached), upper).min(upper)
        } else {
            0.0
        };
        if certified > size {
            return Expansion::Radius(Radius {
                lower: certified,
                upper,
                direction,
                converged: self
                    .closed(certified + 2.0 * self.boundary.uncertain_along(&direction), 1.001 * rtol),
                supports,
                facets: self.boundary.facets_made(),
            });
        }
        if self.closed(lower, rtol) && reached <= size {
            return Expansion::Pierced(self.thinnest);
        }
        Expansion::Stopped(self.thinnest)
    }

    /// The support point along `z`; what it says of the radius is remembered.
    fn ask(&mut self, z: &Wrench<D>, oracle: &mut impl FnMut(&Wrench<D>) -> Support<D>) -> Support<D> {
        let support = oracle(z);
        self.thinnest.supports += 1;
        if support.value < self.thinnest.upper {
            (self.thinnest.upper, self.thinnest.direction) = (support.value, *z);
        }
        self.boundary.raise_noise(support.wrench.norm());
        support
    }

    /// The last support point on the way downhill from the normal of the facet `plane . x = 1` that still cuts it deep.
    fn polished(
        &mut self,
        plane: &Wrench<D>,
        mut z: Wrench<D>,
        mut support: Support<D>,
        lower: f64,
        steps: usize,
        oracle: &mut impl FnMut(&Wrench<D>) -> Support<D>,
    ) -> Wrench<D> {
        let mut vertex = support.wrench;
        let deep = 1.0 + LEAST_CUT * (plane.dot(&vertex) - 1.0);
        for _ in 0..steps {
            let Some(next) = self.boundary.norm().downhill(&support, &z, lower) else { break };
            let there = self.ask(&next, oracle);
            if there.value >= support.value {
                break;
            }
            (z, support) = (next, there);
            if plane.dot(&support.wrench) > deep {
                vertex = support.wrench;
            }
        }
        vertex
    }

    /// Whether the bracket is as narrow as asked for, or the radius below what the caller cares for.
    fn settled(&self, lower: f64, rtol: f64, limits: &Limits) -> bool {
        self.closed(lower, rtol) || self.thinnest.upper < limits.stop_below
    }

    /// Whether the bracket is as narrow as asked for, or as rounding allows.
    fn closed(&self, lower: f64, rtol: f64) -> bool {
        let Thinnest { upper, direction, .. } = &self.thinnest;
        self.boundary.is_within_noise(*upper, lower * (1.0 + rtol), direction)
    }

    /// The normals of facets that are no further away than this.
    pub(crate) fn normals_within(&self, distance: f64) -> impl Iterator<Item = Wrench<D>> {
        self.boundary.normals_within(distance)
    }

    /// After an expansion to `radius`: whether the set is as thin along some direction other than `z`.
    pub(crate) fn has_rival(
        &self,
        radius: f64,
        z: &Wrench<D>,
        mut value: impl FnMut(&Wrench<D>) -> f64,
    ) -> bool {
        // Around a smooth minimum, too, directions close to it are nearly as bad: those are no rivals.
        let thin = radius * (1.0 + RIVAL_RADIUS);
        let mut normals = self.boundary.normals_within(thin);
        normals.any(|other| {
            (other - z).norm() > RIVAL_DIRECTION && (value(&other) <= thin || interrupt::stopped())
        })
    }
}

impl<const D: usize> Thinnest<D> {
    fn unknown() -> Self {
        Self { upper: f64::INFINITY, direction: Wrench::zeros(), supports: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radius<const D: usize>(size: f64, oracle: impl FnMut(&Wrench<D>) -> Support<D>) -> Radius<D> {
        match Polytope::new().expand(size, &Limits::new(1e-9), oracle) {
            Expansion::Radius(radius) => radius,
            other => panic!("{other:?}"),
        }
    }

    fn box_support<const D: usize>(half: &Wrench<D>, z: &Wrench<D>) -> Support<D> {
        let corner = half.zip_map(z, |h, z| h * z.signum());
        Support { value: corner.dot(z), wrench: corner }
    }

    fn cross_support<const D: usize>(z: &Wrench<D>) -> Support<D> {
        let at = z.iamax();
        let wrench = Wrench::from_fn(|row, _| if row == at { z[at].signum() } else { 0.0 });
        Support { value: z[at].abs(), wrench }
    }

    #[test]
    fn boxes_and_cross_polytopes_have_their_known_radius() {
        let half = Wrench::<6>::from_iterator([2.0, 3.0, 1.5, 4.0, 5.0, 1.25]);
        let found = radius(1e-3, |z| box_support(&half, z));
        assert!(found.converged && (found.upper - 1.25).abs() < 1e-9, "{found:?}");
        let found = radius::<6>(1e-3, cross_support);
        assert!(found.converged && (found.upper - 1.0 / 6.0_f64.sqrt()).abs() < 1e-9, "{found:?}");
        let found = radius::<3>(1e-3, cross_support);
        assert!(found.converged && (found.upper - 1.0 / 3.0_f64.sqrt()).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_thin_set_pierces_the_artificial_simplex() {
        let half = Wrench::<3>::new(1.0, 1.0, 1e-7);
        match Polytope::new().expand(1e-3, &Limits::new(1e-9), |z| box_support(&half, z)) {
            Expansion::Pierced(thinnest) => assert!(thinnest.upper <= 1e-3),
            other => panic!("{other:?}"),
        }
        let found = radius(1e-9, |z| box_support(&half, z));
        assert!((found.upper / 1e-7 - 1.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn an_ellipsoid_is_bracketed_to_the_tolerance_or_to_the_work_limit() {
        let axes = Wrench::<3>::new(1.0, 2.0, 3.0);
        let ellipsoid = |z: &Wrench<3>| {
            let value = axes.component_mul(z).norm();
            Support { value, wrench: axes.component_mul(&axes).component_mul(z) / value }
        };
        let found = radius(1e-3, ellipsoid);
        assert!(found.converged && found.lower <= 1.0 && found.upper >= 1.0 - 1e-12, "{found:?}");
        let ball = |z: &Wrench<3>| Support { value: 1.0, wrench: *z };
        let limits = Limits { max_facets: 5000, ..Limits::new(1e-9) };
        let Expansion::Radius(found) = Polytope::new().expand(1e-3, &limits, ball) else { panic!() };
        assert!(!found.converged && found.lower <= 1.0 && found.upper >= 1.0 - 1e-12, "{found:?}");
        assert!(found.lower > 0.99, "{found:?}");
    }
}
