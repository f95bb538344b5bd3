//! The boundary of the expanding polytope: a cycle of simplices around the origin.
//!
//! **Why its distance from the origin is a valid bound whatever rounding does.** The update is
//! *old - visible + cone(horizon, p)*, a cycle modulo 2. As long as no removed piece holds the origin, the facets cover
//! all directions, and every ray from the origin leaves through a facet. Any vector `y` certifies
//! `|x| >= min_k (y . v_k) / |y|` for all points `x` of the facet with vertices `v_k`. The final bound is taken over
//! all facets this way.
//!
//! **No removed piece holds the origin** where its plane proves so: the piece is the hull of a visible facet and `p`, and
//! `y . x > 0` on all of it if `y . v_k > 0` and `y . p > 0`. Each facet carries a bound on `|y . v_k - 1|` for that. Where
//! planes are too close to the origin for their digits, a ray that meets an odd number of facets proves it.

use std::collections::BinaryHeap;

use crate::convex::expanding_polytope::facet::{
    Candidate, Facet, least_reach, offset, regular_simplex, shared_slot, sub_ridges,
};
use crate::convex::expanding_polytope::plane_norm::PlaneNorm;
use crate::convex::expanding_polytope::ridge_table::{RidgeTable, Side};
use crate::convex::rounding::along;
use crate::grasp::Wrench;
use crate::linalg::dense::{pierces, plane_through};
use crate::tolerances::{
    BEYOND_PLANE, CANCELLED_PLANE, DRIFTED_PLANE, PROVEN_PLANE, ROUNDED_DISTANCE, ROUNDED_POINT,
    ROUNDED_QUOTIENT,
};

/// Rays that are tried in turn where one passes too close to the rim of a facet.
const MAX_RAYS: usize = 8;

/// Vertex indices are packed into 16 bits each.
const MAX_POINTS: usize = 65_000;

/// A simplicial boundary that grows by one vertex at a time, and its facets in the order of their distance.
#[derive(Debug, Clone)]
pub(crate) struct Boundary<const D: usize> {
    points: Vec<Wrench<D>>,
    facets: Vec<Facet<D>>,
    free: Vec<u32>,
    heap: BinaryHeap<Candidate>,
    visible: Vec<u32>,
    horizon: RidgeTable,
    round: u32,
    serial: u32,
    norm: PlaneNorm<D>,
    /// What rounding leaves uncertain in the distance of a plane.
    noise: f64,
    /// A bound on what rounding has done to each component of a point; zero where it is not known.
    uncertain: Wrench<D>,
    /// Whether the planes prove that no removed piece held the origin.
    proven: bool,
}

impl<const D: usize> Boundary<D> {
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
            norm: PlaneNorm::Euclidean,
            noise: 0.0,
            uncertain: Wrench::zeros(),
            proven: true,
        }
    }

    /// States what rounding has done to each component of the points to come, for this and later boundaries.
    pub(crate) fn allow(&mut self, uncertain: Wrench<D>) {
        self.uncertain = uncertain;
    }

    /// The boundary of a regular simplex whose vertices have length `size`, with planes ranked by a norm.
    pub(crate) fn start(&mut self, size: f64, norm: PlaneNorm<D>) {
        self.points.clear();
        self.facets.clear();
        self.free.clear();
        self.heap.clear();
        self.round = 1;
        self.serial = 0;
        self.proven = true;
        self.noise = ROUNDED_DISTANCE * size;
        self.norm = norm;
        self.points.extend(regular_simplex::<D>().map(|vertex| vertex * size));
        for opposite in 0..=D {
            let others = |slot: usize| slot + usize::from(slot >= opposite);
            self.serial += 1;
            let plane = self.points[opposite] * (-(D as f64) / (size * size));
            let length = D as f64 / size;
            let facet = Facet {
                plane,
                length,
                norm: self.norm.of(&plane, length),
                error: 64.0 * f64::EPSILON,
                reach: 0.0,
                vertices: std::array::from_fn(|slot| others(slot) as u16),
                neighbours: std::array::from_fn(|slot| others(slot) as u32),
                round: 1,
                serial: self.serial,
                visible: false,
            };
            self.facets.push(facet);
            let Facet { norm, serial, .. } = facet;
            self.heap.push(Candidate { distance: norm.recip(), facet: opposite as u32, serial });
        }
    }

    /// Facets made in all.
    pub(crate) fn facets_made(&self) -> usize {
        self.serial as usize
    }

    /// Whether there is no number for another vertex.
    pub(crate) fn is_full(&self) -> bool {
        self.points.len() >= MAX_POINTS
    }

    /// Whether `value` exceeds `bound` by no more than what of [`Self::noise`] concerns products with `z`: of points that
    /// differ by orders of magnitude among their components, a small part. More work would not improve it.
    #[inline]
    pub(crate) fn is_within_noise(&self, value: f64, bound: f64, z: &Wrench<D>) -> bool {
        // No norm exceeds the sum of the components: mostly that decides, without a square root.
        let sum: f64 = z.iter().map(|x| x.abs()).sum();
        value <= bound
            || (value <= bound + self.noise * sum
                && value <= bound + noise_along(z, &self.uncertain, self.noise))
    }

    /// `|z| . e`: a bound on what is uncertain in products of points with `z`.
    pub(crate) fn uncertain_along(&self, z: &Wrench<D>) -> f64 {
        along(z, &self.uncertain)
    }

    /// Raises the noise to what rounding makes of a point of this length.
    pub(crate) fn raise_noise(&mut self, length: f64) {
        self.noise = self.noise.max(ROUNDED_DISTANCE * length);
    }

    /// `y` with `y . x = 1` on the facet.
    pub(crate) fn plane(&self, facet: u32) -> Wrench<D> {
        self.facets[facet as usize].plane
    }

    /// The direction of the norm 1 that is normal to a facet.
    pub(crate) fn normal(&self, facet: u32) -> Wrench<D> {
        let Facet { plane, norm, .. } = &self.facets[facet as usize];
        plane / *norm
    }

    /// The norm of planes, which are measured as directions.
    pub(crate) fn norm(&self) -> &PlaneNorm<D> {
        &self.norm
    }

    /// Normals of the facets no further out than `distance`.
    pub(crate) fn normals_within(&self, distance: f64) -> impl Iterator<Item = Wrench<D>> {
        let near = self.facets.iter().filter(move |facet| facet.round != 0 && facet.norm * distance >= 1.0);
        near.map(|facet| facet.plane / facet.norm)
    }

    /// The live facet nearest to the origin, its plane freshly checked.
    pub(crate) fn pop_nearest(&mut self) -> Option<Candidate> {
        while let Some(mut candidate) = self.heap.pop() {
            let facet = &mut self.facets[candidate.facet as usize];
            if facet.round == 0 || facet.serial != candidate.serial {
                continue;
            }
            let vertices = facet.vertices.map(|v| self.points[v as usize]);
            if offset(&facet.plane, &vertices) > DRIFTED_PLANE {
                if let Some(plane) = plane_through(&vertices) {
                    (facet.plane, facet.length) = (plane, plane.norm());
                    facet.norm = self.norm.of(&plane, facet.length);
                    facet.error = offset(&plane, &vertices) + self.noise * facet.length;
                }
                let distance = least_reach(&facet.plane, &vertices) / facet.norm;
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

    /// Ranks all live facets, also those that were too far out when they were made.
    pub(crate) fn rank_all(&mut self) {
        self.heap.clear();
        let live = self.facets.iter().zip(0..).filter(|(facet, _)| facet.round != 0);
        self.heap.extend(live.map(|(facet, index)| Candidate {
            distance: facet.norm.recip(),
            facet: index,
            serial: facet.serial,
        }));
    }

    /// Ranks a facet again that [`Self::pop_nearest`] gave.
    pub(crate) fn put_back(&mut self, candidate: Candidate) {
        self.heap.push(candidate);
    }

    /// Replaces what `p` sees, starting with the facet `first`, by the cone of the horizon and `p`. False where rounding
    /// broke the cycle; what is further out than `interesting` is never ranked.
    pub(crate) fn add(&mut self, first: u32, p: Wrench<D>, interesting: f64) -> bool {
        self.round += 1;
        self.horizon.clear();
        self.visible.clear();
        let apex = self.points.len() as u16;
        self.points.push(p);
        let round = self.round;
        let facet = &mut self.facets[first as usize];
        (facet.round, facet.visible, facet.reach) = (round, true, facet.plane.dot(&p));
        self.proven &= facet.error + self.noise * facet.length < PROVEN_PLANE;
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
                    let beyond = neighbour.reach - 1.0 - BEYOND_PLANE;
                    let noise = self.noise * neighbour.length;
                    neighbour.visible = beyond > noise
                        || (beyond > 0.0
                            && beyond > noise_along(&neighbour.plane, &self.uncertain, self.noise));
                    if neighbour.visible {
                        self.proven &= neighbour.error + noise < PROVEN_PLANE;
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
        let (plane, length, error) = self.tilted_plane(inside, outside, &vertices);
        let back = shared_slot(outside, inner, &vertices);
        let mut neighbours = [outer; D];
        let (made, serial) = self.next_slot();
        self.facets[outer as usize].neighbours[back] = made;
        let keys = sub_ridges(&vertices);
        let norm = self.norm.of(&plane, length);
        for slot in 0..D - 1 {
            let side = Side { facet: made, slot: slot as u32 };
            // A sub-ridge met for the first time gets its neighbour when it is met again.
            neighbours[slot] = u32::MAX;
            if let Some(partner) = self.horizon.toggle(keys[slot], side) {
                neighbours[slot] = partner.facet;
                self.facets[partner.facet as usize].neighbours[partner.slot as usize] = made;
            }
        }
        self.facets[made as usize] = Facet {
            plane,
            length,
            norm,
            error,
            reach: 1.0,
            vertices,
            neighbours,
            round: self.round,
            serial,
            visible: false,
        };
        // What is further out than the radius can never be the nearest facet before the bracket closes.
        if norm * interesting > 1.0 {
            self.heap.push(Candidate { distance: norm.recip(), facet: made, serial });
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
    /// that meet in the ridge: a convex combination, so errors in old vertices never grow. With its length, and a bound
    /// on `|y . v_k - 1|`.
    fn tilted_plane(
        &self,
        inside: &Facet<D>,
        outside: &Facet<D>,
        vertices: &[u16; D],
    ) -> (Wrench<D>, f64, f64) {
        let t = ((1.0 - outside.reach) / (inside.reach - outside.reach)).clamp(0.0, 1.0);
        let plane = outside.plane + (inside.plane - outside.plane) * t;
        // Where large planes (of the tiny first simplex) nearly cancel, their digits are gone: start afresh.
        let length = plane.norm();
        if length < CANCELLED_PLANE * larger(outside.length, t * inside.length) {
            let vertices = vertices.map(|v| self.points[v as usize]);
            if let Some(plane) = plane_through(&vertices) {
                let length = plane.norm();
                return (plane, length, offset(&plane, &vertices) + self.noise * length);
            }
        }
        // Of the ridge the larger of both errors, of the apex what the clamp leaves, and the rounding of these lines.
        let rounded = 2.0 * self.noise * (outside.length + inside.length);
        (plane, length, larger(larger(inside.error, outside.error), outside.reach - 1.0) + rounded)
    }

    /// Whether it is certain that the facets surround the origin. Rounding may have removed the piece that holds the origin
    /// where points differ by many orders.
    pub(crate) fn surrounds_origin(&self) -> bool {
        let ray = |k: usize| Wrench::from_fn(|row, _| (1.7 * row as f64 + 0.9 + 2.3 * k as f64).sin());
        self.proven || (0..MAX_RAYS).find_map(|k| self.crossings_are_odd(&ray(k))) == Some(true)
    }

    /// Whether a ray crosses an odd number of facets; if one does, all do. `None` where it passes too close to a rim.
    fn crossings_are_odd(&self, ray: &Wrench<D>) -> Option<bool> {
        let mut live = self.facets.iter().filter(|facet| facet.round != 0);
        live.try_fold(false, |odd, facet| {
            Some(odd ^ pierces(ray, &facet.vertices.map(|v| self.points[v as usize]))?)
        })
    }

    /// No point of the facet, had it not been rounded, is nearer to the origin than this; zero where nothing is certain.
    fn certified(&self, plane: &Wrench<D>, vertices: &[Wrench<D>; D]) -> f64 {
        let lost = along(plane, &self.uncertain) * (1.0 + ROUNDED_QUOTIENT);
        let reach = (least_reach(plane, vertices) * (1.0 - ROUNDED_QUOTIENT) - lost).max(0.0);
        let length = plane.norm();
        // Zero rather than a number that is none, which would drop out of the minimum over all facets.
        (reach / (self.norm.of(plane, length) + self.norm.lost(length)) * (1.0 - ROUNDED_QUOTIENT)).max(0.0)
    }

    /// The radius of a ball that no facet enters; zero where rounding left nothing certain, and anything from `enough`
    /// on where it is at least that.
    ///
    /// Planes that have drifted and certify less than `wanted` are computed afresh: the better of two is as valid.
    pub(crate) fn certified_radius(&self, wanted: f64, enough: f64) -> f64 {
        let far = 1.0 + 8.0 * ROUNDED_QUOTIENT;
        let lost = self.uncertain.norm();
        let certified = |facet: &Facet<D>| {
            // The bound that the facet carries decides for most of them.
            let norm = facet.norm + self.norm.lost(facet.length);
            if 1.0 - facet.error > (enough * norm + lost * facet.length) * far {
                return f64::INFINITY;
            }
            let vertices = facet.vertices.map(|v| self.points[v as usize]);
            let drifted = self.certified(&facet.plane, &vertices);
            if drifted >= wanted {
                return drifted;
            }
            plane_through(&vertices).map_or(drifted, |plane| self.certified(&plane, &vertices).max(drifted))
        };
        self.facets.iter().filter(|facet| facet.round != 0).map(certified).fold(f64::INFINITY, f64::min)
    }
}

/// The larger of two numbers in one instruction, of which [`f64::max`] takes several.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// What of `noise` concerns products with `z`, where points are `uncertain` by so much.
fn noise_along<const D: usize>(z: &Wrench<D>, uncertain: &Wrench<D>, noise: f64) -> f64 {
    let along = along(z, uncertain) * (ROUNDED_DISTANCE / ROUNDED_POINT);
    if along > 0.0 { along.min(noise * z.norm()) } else { noise * z.norm() }
}
