//! The facets of the expanding polytope: simplices with their planes and neighbours.

use std::cmp::Ordering;

use crate::grasp::Wrench;

/// A simplex on the boundary, in two lines of the processor's cache: growing a polytope reads facets in any order.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Facet<const D: usize> {
    /// `plane . v = 1` for all vertices.
    pub(crate) plane: Wrench<D>,
    /// `|plane|` in the coordinates of the points.
    pub(crate) length: f64,
    /// The inverse of the distance from the origin: the norm of the plane.
    pub(crate) norm: f64,
    /// A bound on `|plane . v - 1|` for all vertices.
    pub(crate) error: f64,
    /// Of the point being added: `plane . p`.
    pub(crate) reach: f64,
    /// In ascending order, so that the newest point is always the last.
    pub(crate) vertices: [u16; D],
    /// Slot k: the facet on the other side of the ridge opposite to vertex k.
    pub(crate) neighbours: [u32; D],
    /// The round in which `reach` was computed; 0 marks a facet that is no more.
    pub(crate) round: u32,
    /// Tells apart the facets that use a slot one after another.
    pub(crate) serial: u32,
    pub(crate) visible: bool,
}

/// A facet waiting to be examined, nearest first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) distance: f64,
    pub(crate) facet: u32,
    pub(crate) serial: u32,
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        // Reversed: `BinaryHeap` pops the greatest. Serials make the order, and so the result, deterministic.
        other.distance.total_cmp(&self.distance).then(other.serial.cmp(&self.serial))
    }
}

/// How far `y . v = 1` is from holding at the vertices.
pub(crate) fn offset<const D: usize>(plane: &Wrench<D>, vertices: &[Wrench<D>; D]) -> f64 {
    vertices.iter().map(|v| (plane.dot(v) - 1.0).abs()).fold(0.0, f64::max)
}

/// `min_k y . v_k`: over the norm of `y`, no point of the facet is nearer to the origin.
pub(crate) fn least_reach<const D: usize>(plane: &Wrench<D>, vertices: &[Wrench<D>; D]) -> f64 {
    vertices.iter().map(|v| plane.dot(v)).fold(f64::INFINITY, f64::min)
}

/// The slot of `outside` that faces `inner` across the ridge which `vertices` holds besides the apex.
#[inline]
pub(crate) fn shared_slot<const D: usize>(outside: &Facet<D>, inner: u32, vertices: &[u16; D]) -> usize {
    let facing = |slot: &usize| outside.neighbours[*slot] == inner;
    // Two facets may share two ridges where points coincide: then only one slot has its vertex off this ridge.
    (0..D)
        .filter(facing)
        .find(|&slot| !vertices[..D - 1].contains(&outside.vertices[slot]))
        .or_else(|| (0..D).find(facing))
        .unwrap_or(0)
}

/// For each slot but the apex's: the vertices of a new facet other than the apex and that one, 16 bits each.
#[inline]
pub(crate) fn sub_ridges<const D: usize>(vertices: &[u16; D]) -> [u64; D] {
    let mut keys = [0; D];
    let mut before = 0_u64;
    for slot in 0..D - 1 {
        keys[slot] = before;
        before = before << 16 | u64::from(vertices[slot]);
    }
    let (mut after, mut bits) = (0_u64, 0);
    for slot in (0..D - 1).rev() {
        keys[slot] = if bits < 64 { keys[slot] << bits | after } else { after };
        if bits < 64 {
            after |= u64::from(vertices[slot]) << bits;
        }
        bits += 16;
    }
    keys
}

/// Unit vertices of a regular simplex, in a position that shares no symmetry with the axes.
pub(crate) fn regular_simplex<const D: usize>() -> impl Iterator<Item = Wrench<D>> {
    // e_1 .. e_D and a multiple of (1, .., 1) are equidistant; then centre and normalise.
    let d = D as f64;
    let last = (1.0 - (1.0 + d).sqrt()) / d;
    let centroid = Wrench::<D>::repeat((1.0 + last) / (d + 1.0));
    let corners = (0..D)
        .map(|axis| Wrench::<D>::from_fn(|row, _| f64::from(u8::from(row == axis))))
        .chain([Wrench::repeat(last)]);
    // A reflection along a generic direction takes the simplex out of the axes' symmetry.
    let mirror = Wrench::<D>::from_fn(|row, _| (row as f64 + 1.3).sqrt() - 0.4).normalize();
    corners
        .map(move |corner| (corner - centroid).normalize())
        .map(move |v: Wrench<D>| v - mirror * (2.0 * mirror.dot(&v)))
}
