//! The radius of a symmetric set, from the part of the sphere that its symmetries do not repeat.
//!
//! The minimisers of the support function of a symmetric set are a circle or a sphere, or as many points as there are
//! symmetries, and a polytope that must resolve all of them reaches `max_facets`. Two reductions help:
//!
//! - **Slice.** With the rotations `e^{tX}`, each orbit has a point on the hyperplane `l . z = 0` for any `l` in the range
//!   of `X`: `l . e^{tX} z` has mean zero in `t`, so it vanishes somewhere. The least `p` on the sphere is the least on
//!   that hyperplane, where `p` is the support function of the set's projection: one dimension less.
//! - **Chamber.** With finitely many maps `g`, each orbit has a point in `C = {z : z . (y - g y) >= 0 for all g}`, the
//!   cone of directions that are nearer to `y` than to its images (the point of the orbit that reaches furthest along
//!   `y`). Beyond a wall nothing need be known, so a far point `-R (y - g y)` joins the set: on `C` it changes nothing.

use nalgebra::SMatrix;

use crate::convex::expanding_polytope::plane_norm::PlaneNorm;
use crate::convex::expanding_polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::grasp::Wrench;
use crate::quality::query::QualityQuery;
use crate::quality::symmetry::{Symmetries, Symmetry};
use crate::tolerances::{
    BEYOND_WALL, CLOSED_BRACKET, FIXED_DIRECTION, PROVEN_IN_CHAMBER, ROUNDED_DISTANCE, SYMMETRIC_SIMPLEX,
};
use crate::wrench_set::Support;

/// How much further out than the longest wrench the points beyond the walls lie.
const WALL_DISTANCE: f64 = 30.0;

/// Walls at most: those to the nearest images. Fewer walls make a larger chamber, which is as valid.
const MAX_WALLS: usize = 24;

/// How far the centre of a chamber is from the thinnest direction, which may be its own image.
const OFF_CENTRE: f64 = 0.3;

/// Images nearer than this to the centre of the chamber make no wall.
const NEAR_CENTRE: f64 = 0.05;

/// What the search needs to know besides the set.
struct Search<'a, const D: usize> {
    query: &'a QualityQuery<'a, D>,
    /// Where distances are not measured by the norm of the coordinates.
    orbits: Option<&'a NormOfOrbits<D>>,
    /// What is known of the radius already.
    thinnest: &'a Thinnest<D>,
    size: f64,
    limits: &'a Limits,
}

/// The norm `max_g |N g z|` over the maps `g` of a set that has more symmetries than the norm `|N z|`.
pub(crate) struct NormOfOrbits<const D: usize> {
    images: PlaneNorm<D>,
    /// No less than `|z| / |N z|`.
    spread: f64,
}

impl<const D: usize> NormOfOrbits<D> {
    pub(crate) fn new(norm: &SMatrix<f64, D, D>, spread: f64, symmetries: &Symmetries<D>) -> Self {
        let mut images = vec![*norm];
        images.extend(symmetries.maps.iter().map(|symmetry| norm * symmetry.map.transpose()));
        Self { images: PlaneNorm::Through(images, norm.norm() * D as f64), spread }
    }

    /// The longest of `N g z`.
    pub(crate) fn longest_image(&self, z: &Wrench<D>) -> Wrench<D> {
        let PlaneNorm::Through(images, _) = &self.images else { return *z };
        let all = images.iter().map(|image| image * z);
        all.max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared())).unwrap_or(*z)
    }
}

/// The radius of a symmetric set; `None` where there is no symmetry, or it leads nowhere.
///
/// `thinnest` and `size` are those of a polytope that has not closed the bracket. By the norm of `orbits`, finitely many
/// maps count.
pub(crate) fn symmetric_radius<const D: usize>(
    query: &QualityQuery<'_, D>,
    symmetries: &Symmetries<D>,
    orbits: Option<&NormOfOrbits<D>>,
    thinnest: &Thinnest<D>,
    size: f64,
    limits: &Limits,
) -> Option<Radius<D>> {
    let spread = orbits.map_or(1.0, |orbits| orbits.spread);
    let size = size.min(SYMMETRIC_SIMPLEX * thinnest.upper / spread);
    let search = Search { query, orbits, thinnest, size, limits };
    if let Some(Symmetry { map: generator, deviation }) = &symmetries.rotation {
        let basis = slice(generator, &thinnest.direction);
        return search.on(&basis, &[], PlaneNorm::Euclidean, *deviation);
    }
    let walls = search.walls(&symmetries.maps);
    if walls.is_empty() {
        return None;
    }
    let norm = orbits.map_or(PlaneNorm::Euclidean, |orbits| orbits.images.clone());
    search.on(&SMatrix::<f64, D, D>::identity(), &walls, norm, symmetries.deviation())
}

/// An orthonormal basis of the hyperplane `l . z = 0` for the velocity `l = X z` of the orbit through `z`: there the
/// hyperplane cuts it at a right angle.
fn slice<const D: usize>(generator: &SMatrix<f64, D, D>, z: &Wrench<D>) -> SMatrix<f64, D, 5> {
    let mut l = generator * z;
    if l.norm() < FIXED_DIRECTION {
        let fastest = generator.column_iter().max_by(|a, b| a.norm().total_cmp(&b.norm()));
        l = fastest.map_or(l, nalgebra::Matrix::into_owned);
    }
    let l = l.normalize();
    // The reflection that takes l to the axis where it is largest takes the other axes to the complement.
    let at = l.iamax();
    let mut v = l;
    v[at] += l[at].signum();
    let scale = 2.0 / v.norm_squared();
    SMatrix::from_fn(|row, k| {
        let column = k + usize::from(k >= at);
        f64::from(u8::from(row == column)) - scale * v[row] * v[column]
    })
}

impl<const D: usize> Search<'_, D> {
    /// Far points beyond the walls of the chamber around a direction near the thinnest one.
    ///
    /// The best point of an orbit lies in the chamber as far as the maps are a group: where a wall's map and another one
    /// make none of them to the last digit, the best point may lie that little beyond the wall. A wall is dropped unless
    /// its far point gives less than the thinnest support there.
    fn walls(&self, maps: &[Symmetry<D>]) -> Vec<Wrench<D>> {
        let generic = Wrench::<D>::from_fn(|row, _| (1.7 * row as f64 + 0.9).sin()).normalize();
        let centre = self.thinnest.direction + generic * OFF_CENTRE;
        let away = |symmetry: &Symmetry<D>| centre - symmetry.map * centre;
        let mut nearest: Vec<_> = maps.iter().map(|symmetry| (away(symmetry), symmetry)).collect();
        nearest.retain(|(away, _)| away.norm() > NEAR_CENTRE);
        nearest.sort_by(|a, b| a.0.norm().total_cmp(&b.0.norm()));
        nearest.truncate(MAX_WALLS);
        let far = WALL_DISTANCE * self.query.scale;
        let walls = nearest.into_iter().filter(|(away, symmetry)| {
            let beyond = open_by(&symmetry.map, maps) * centre.norm() / away.norm();
            far * beyond < BEYOND_WALL * self.thinnest.upper / self.spread()
        });
        walls.map(|(away, _)| away.normalize() * -far).collect()
    }

    fn spread(&self) -> f64 {
        self.orbits.map_or(1.0, |orbits| orbits.spread)
    }

    /// The radius in the subspace of an orthonormal `basis` with the far points `walls` in it.
    fn on<const E: usize>(
        &self,
        basis: &SMatrix<f64, D, E>,
        walls: &[Wrench<E>],
        norm: PlaneNorm<E>,
        deviation: f64,
    ) -> Option<Radius<D>> {
        let Self { query, thinnest, size, limits, .. } = *self;
        let mut oracle = |y: &Wrench<E>| {
            let support = query.support(&(basis * y));
            let mut best = Support { value: support.value, wrench: basis.tr_mul(&support.wrench) };
            for wall in walls {
                let beyond = wall.dot(y);
                if beyond > best.value {
                    best = Support { value: beyond, wrench: *wall };
                }
            }
            best
        };
        // What the deviation takes is to be left of the tolerance.
        // Products with the far points round by their length.
        let furthest = if walls.is_empty() { 1.0 } else { WALL_DISTANCE } * query.scale;
        let lost = self.spread() * (deviation + query.uncertain().norm() + 2.0 * ROUNDED_DISTANCE * furthest);
        let rtol = (limits.rtol - lost / thinnest.upper).max(0.5 * limits.rtol);
        let narrower = Limits { rtol, ..*limits };
        let mut polytope = Polytope::<E>::new();
        polytope.start_in(size, norm);
        let progress = polytope.grow(&narrower, &mut oracle);
        let found = match polytope.conclude(progress, size, &narrower) {
            Expansion::Radius(found) => found,
            Expansion::Stopped(stopped) if stopped.upper < limits.stop_below => Radius {
                lower: 0.0,
                upper: stopped.upper,
                direction: stopped.direction,
                converged: false,
                supports: stopped.supports,
                facets: 0,
            },
            Expansion::Stopped(_) | Expansion::Pierced(_) => return None,
        };
        let mut lower = found.lower - lost;
        // Walls give up to a thousandth of the thinnest support inside the chamber: so little proves nothing.
        if lower <= PROVEN_IN_CHAMBER * thinnest.upper {
            if found.upper >= limits.stop_below {
                return None;
            }
            lower = 0.0;
        }
        let inner = basis * found.direction;
        let (upper, direction) = if found.upper < thinnest.upper {
            (found.upper, inner)
        } else {
            (thinnest.upper, thinnest.direction)
        };
        Some(Radius {
            lower: lower.clamp(0.0, upper),
            upper,
            direction,
            converged: found.converged
                && upper <= lower * (1.0 + CLOSED_BRACKET * limits.rtol) + ROUNDED_DISTANCE * query.scale,
            supports: found.supports + thinnest.supports,
            facets: found.facets,
        })
    }
}

/// How far `map^T g` is from the nearest of the maps and the identity, for the worst `g` of them.
fn open_by<const D: usize>(map: &SMatrix<f64, D, D>, maps: &[Symmetry<D>]) -> f64 {
    let identity = SMatrix::<f64, D, D>::identity();
    let all = || maps.iter().map(|symmetry| &symmetry.map).chain([&identity]);
    let nearest = |product: SMatrix<f64, D, D>| {
        all().map(|other| (product - other).norm()).fold(f64::INFINITY, f64::min)
    };
    all().map(|g| nearest(map.tr_mul(g))).fold(0.0, f64::max)
}
