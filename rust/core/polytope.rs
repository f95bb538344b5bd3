//! The expanding polytope: the largest ball about the origin inside a convex set known by its support
//! function (Eqs. 16 to 19 and Theorem 1).
//!
//! A polytope grows from a small artificial simplex towards the set, always where it is thinnest: the facet
//! nearest to the origin bounds the radius from below, the support function along its normal bounds it from
//! above, and the support point becomes a new vertex. Only the neighbourhood of the minimum is ever resolved.
//!
//! **Why the lower bound holds whatever rounding does.** The update is *old - visible + cone(horizon, p)*, a
//! cycle modulo 2. As long as no removed piece holds the origin, the facets cover all directions, and every
//! ray from the origin leaves through a facet. Any vector `y` certifies `|x| >= min_k (y . v_k) / |y|` for
//! all points `x` of the facet with vertices `v_k`. The final bound is taken over all facets this way.

use std::collections::BinaryHeap;

use crate::facet::{Candidate, Facet, certified_distance, offset, regular_simplex, shared_slot, sub_ridges};
use crate::grasp::Wrench;
use crate::interrupt;
use crate::linear::plane_through;
use crate::ridge_table::{RidgeTable, Side};
use crate::wrench_set::Support;

/// A point is beyond a plane `y . x = 1` where it exceeds it by this much; coplanar points are not.
const BEYOND: f64 = 1e-12;

/// What rounding leaves uncertain in a distance, relative to the longest vertex.
pub(crate) const NOISE: f64 = 8.0 * f64::EPSILON;

/// Vertex indices are packed into 16 bits each.
const MAX_POINTS: usize = 65_000;

/// Work limit: a second at most. Only sets with a continuum of nearest boundary points come near it.
pub(crate) const MAX_FACETS: usize = 400_000;

/// When to stop.
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
}

impl Limits {
    /// Stops only at the tolerance, or when the bound on the work is reached.
    pub(crate) fn new(rtol: f64) -> Self {
        Self { rtol, max_facets: MAX_FACETS, stop_below: f64::NEG_INFINITY, stop_above: f64::INFINITY }
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

/// How an expansion ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Expansion<const D: usize> {
    /// The set contains the artificial simplex, and this is its radius.
    Radius(Radius<D>),
    /// The set does not contain the artificial simplex: its support along this unit direction is only `upper`.
    Pierced { upper: f64, direction: Wrench<D> },
}

/// The memory of an expansion, to be reused: after a few grasps it no longer allocates.
#[derive(Debug, Clone)]
pub(crate) struct Polytope<const D: usize> {
    points: Vec<Wrench<D>>,
    facets: Vec<Facet<D>>,
    free: Vec<u32>,
    heap: BinaryHeap<Candidate>,
    visible: Vec<u32>,
    horizon: RidgeTable,
    round: u32,
    serial: u32,
    /// What rounding leaves uncertain in the distance of a plane.
    noise: f64,
}

impl<const D: usize> Polytope<D> {
    pub(crate) fn new() -> Self {
        Self {
            points: Vec::new(),
            facets: Vec::new(),
            free: Vec::new(),
            heap: BinaryHeap::new(),
            visible: Vec::new(),
            horizon: RidgeTable::new(),
            round: 0,
            serial: 0,
            noise: 0.0,
        }
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
        let rtol = limits.rtol.max(4.0 * BEYOND);
        let mut best = (f64::INFINITY, Wrench::zeros());
        let mut supports = 0;
        let lower = loop {
            // With none left, all facets lie beyond the best upper bound.
            let Some(nearest) = self.pop_nearest() else { break best.0 };
            let lower = nearest.distance;
            if self.closed(lower, best.0, rtol) || lower > limits.stop_above {
                break lower;
            }
            let z = self.facets[nearest.facet as usize].plane.normalize();
            let support = oracle(&z);
            supports += 1;
            if support.value < best.0 {
                best = (support.value, z);
            }
            self.noise = self.noise.max(NOISE * support.wrench.norm());
            let full = self.serial as usize >= limits.max_facets || self.points.len() >= MAX_POINTS;
            let done = full || best.0 < limits.stop_below || interrupt::stopped();
            if done || self.closed(lower, best.0, rtol) {
                break lower;
            }
            if !self.add(nearest.facet, support.wrench, best.0) {
                break lower;
            }
        };
        // A facet beyond `size` holds no artificial vertex: from there on the polytope lies in the set.
        let grown = lower > size;
        if !grown && self.closed(lower, best.0, rtol) {
            return Expansion::Pierced { upper: best.0, direction: best.1 };
        }
        let lower = if grown { self.certified_radius().min(best.0) } else { 0.0 };
        Expansion::Radius(Radius {
            lower,
            upper: best.0,
            direction: best.1,
            converged: grown && self.closed(lower, best.0, 1.001 * rtol),
            supports,
            facets: self.serial as usize,
        })
    }

    /// Whether the bracket is as narrow as asked for, or as rounding allows.
    fn closed(&self, lower: f64, upper: f64, rtol: f64) -> bool {
        upper <= lower * (1.0 + rtol) + self.noise
    }

    fn start(&mut self, size: f64) {
        self.points.clear();
        self.facets.clear();
        self.free.clear();
        self.heap.clear();
        self.round = 1;
        self.serial = 0;
        self.noise = NOISE * size;
        self.points.extend(regular_simplex::<D>().iter().map(|vertex| vertex * size));
        for opposite in 0..=D {
            let others = |slot: usize| slot + usize::from(slot >= opposite);
            self.serial += 1;
            let facet = Facet {
                plane: self.points[opposite] * (-(D as f64) / (size * size)),
                distance: size / D as f64,
                reach: 0.0,
                vertices: std::array::from_fn(|slot| others(slot) as u16),
                neighbours: std::array::from_fn(|slot| others(slot) as u32),
                round: 1,
                serial: self.serial,
                visible: false,
            };
            self.facets.push(facet);
            let Facet { distance, serial, .. } = facet;
            self.heap.push(Candidate { distance, facet: opposite as u32, serial });
        }
    }

    /// The live facet nearest to the origin, its plane freshly checked.
    fn pop_nearest(&mut self) -> Option<Candidate> {
        while let Some(mut candidate) = self.heap.pop() {
            let facet = &mut self.facets[candidate.facet as usize];
            if facet.round == 0 || facet.serial != candidate.serial {
                continue;
            }
            let vertices = facet.vertices.map(|v| self.points[v as usize]);
            if offset(&facet.plane, &vertices) > 1e-13 {
                if let Some(plane) = plane_through(&vertices) {
                    (facet.plane, facet.distance) = (plane, plane.norm().recip());
                }
                let distance = certified_distance(&facet.plane, &vertices);
                if distance > candidate.distance
                    && self.heap.peek().is_some_and(|next| next.distance < distance)
                {
                    candidate.distance = distance;
                    self.heap.push(candidate);
                    continue;
                }
                candidate.distance = distance;
            }
            return Some(candidate);
        }
        None
    }

    /// Replaces what `p` sees, starting with the facet `first`, by the cone of the horizon and `p`.
    fn add(&mut self, first: u32, p: Wrench<D>, interesting: f64) -> bool {
        self.round += 1;
        self.horizon.clear();
        self.visible.clear();
        let apex = self.points.len() as u16;
        self.points.push(p);
        let round = self.round;
        let facet = &mut self.facets[first as usize];
        (facet.round, facet.visible, facet.reach) = (round, true, facet.plane.dot(&p));
        self.visible.push(first);
        let mut next = 0;
        while let Some(&inner) = self.visible.get(next) {
            next += 1;
            for slot in 0..D {
                let outer = self.facets[inner as usize].neighbours[slot];
                let neighbour = &mut self.facets[outer as usize];
                if neighbour.round != round {
                    neighbour.round = round;
                    neighbour.reach = neighbour.plane.dot(&p);
                    let uncertain = BEYOND + self.noise / neighbour.distance;
                    neighbour.visible = neighbour.reach > 1.0 + uncertain;
                    if neighbour.visible {
                        self.visible.push(outer);
                    }
                }
                if !self.facets[outer as usize].visible {
                    self.join(inner, slot, outer, apex, interesting);
                }
            }
        }
        for index in 0..self.visible.len() {
            let gone = self.visible[index];
            self.facets[gone as usize].round = 0;
            self.free.push(gone);
        }
        self.horizon.is_paired()
    }

    /// Makes the facet of a horizon ridge and the apex, and links it with its neighbours.
    fn join(&mut self, inner: u32, slot: usize, outer: u32, apex: u16, interesting: f64) {
        let inside = &self.facets[inner as usize];
        let outside = &self.facets[outer as usize];
        let mut vertices = [apex; D];
        for (k, vertex) in vertices[..D - 1].iter_mut().enumerate() {
            *vertex = inside.vertices[k + usize::from(k >= slot)];
        }
        let plane = self.tilted_plane(inside, outside, &vertices);
        let back = shared_slot(outside, inner, &vertices);
        let mut neighbours = [outer; D];
        let (made, serial) = self.next_slot();
        self.facets[outer as usize].neighbours[back] = made;
        let keys = sub_ridges(&vertices);
        for slot in 0..D - 1 {
            let side = Side { facet: made, slot: slot as u32 };
            // A sub-ridge met for the first time gets its neighbour when it is met again.
            neighbours[slot] = u32::MAX;
            if let Some(partner) = self.horizon.toggle(keys[slot], side) {
                neighbours[slot] = partner.facet;
                self.facets[partner.facet as usize].neighbours[partner.slot as usize] = made;
            }
        }
        let distance = plane.norm().recip();
        self.facets[made as usize] = Facet {
            plane,
            distance,
            reach: 1.0,
            vertices,
            neighbours,
            round: self.round,
            serial,
            visible: false,
        };
        // What is further out than the radius can never be the nearest facet before the bracket closes.
        if distance < interesting {
            self.heap.push(Candidate { distance, facet: made, serial });
        }
    }

    /// A slot for a new facet, and the number that tells it from earlier ones there.
    fn next_slot(&mut self) -> (u32, u32) {
        self.serial += 1;
        let index = self.free.pop().unwrap_or_else(|| {
            self.facets.push(self.facets[0]);
            self.facets.len() as u32 - 1
        });
        (index, self.serial)
    }

    /// The plane through the ridge and the apex, by the pencil `y = y_b + t (y_a - y_b)` of the two planes
    /// that meet in the ridge: a convex combination, so errors in old vertices never grow.
    fn tilted_plane(&self, inside: &Facet<D>, outside: &Facet<D>, vertices: &[u16; D]) -> Wrench<D> {
        let t = ((1.0 - outside.reach) / (inside.reach - outside.reach)).clamp(0.0, 1.0);
        let plane = outside.plane + (inside.plane - outside.plane) * t;
        // Where large planes (of the tiny first simplex) nearly cancel, their digits are gone: start afresh.
        let before = outside.plane.norm_squared().max(t * t * inside.plane.norm_squared());
        if plane.norm_squared() < 1e-6 * before {
            let vertices = vertices.map(|v| self.points[v as usize]);
            return plane_through(&vertices).unwrap_or(plane);
        }
        plane
    }

    /// After an expansion to `radius`: whether the set is as thin along some direction other than `z`.
    pub(crate) fn has_rival(
        &self,
        radius: f64,
        z: &Wrench<D>,
        mut value: impl FnMut(&Wrench<D>) -> f64,
    ) -> bool {
        // Around a smooth minimum, too, directions close to it are nearly as bad: those are no rivals.
        let thin = radius * (1.0 + 1e-9);
        self.facets
            .iter()
            .filter(|facet| facet.round != 0 && facet.distance <= thin)
            .map(|facet| facet.plane * facet.distance)
            .any(|other| (other - z).norm() > 1e-3 && (value(&other) <= thin || interrupt::stopped()))
    }

    /// The radius of a ball that no facet enters.
    fn certified_radius(&self) -> f64 {
        let live = self.facets.iter().filter(|facet| facet.round != 0);
        let distances = live
            .map(|facet| certified_distance(&facet.plane, &facet.vertices.map(|v| self.points[v as usize])));
        distances.fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn radius<const D: usize>(size: f64, oracle: impl FnMut(&Wrench<D>) -> Support<D>) -> Radius<D> {
        match Polytope::new().expand(size, &Limits::new(1e-9), oracle) {
            Expansion::Radius(radius) => radius,
            Expansion::Pierced { upper, direction } => panic!("pierced at {upper} along {direction:?}"),
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
            Expansion::Pierced { upper, .. } => assert!(upper <= 1e-3),
            Expansion::Radius(radius) => panic!("{radius:?}"),
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
