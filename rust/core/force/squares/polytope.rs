//! Projections onto pyramids, cut or not, and onto the convex hull of zero and finitely many extreme forces.
//!
//! The projection searches over faces (Wolfe 1976; for cones the nonnegative least squares of Lawson and Hanson). It
//! projects onto the affine hull of the current face. Points with negative weights leave the face. The extreme force that
//! reaches furthest along the residual joins it. A contact force has four components, so a face needs at most five points.

use crate::force::squares::projection::{Force, Projection};
use crate::force::squares::pyramid::Pyramid;
use crate::grasp::contact::ContactForce;
use crate::linalg::real::{Real, dot, norm, values};
use crate::tolerances::{DEPENDENT_EDGE, ROUNDED_REACH_OF_FACE};

/// Extreme forces with lower and upper bounds on the sum of their coefficients.
#[derive(Debug, Clone)]
pub(crate) struct Polytope {
    pub(crate) forces: Vec<ContactForce>,
    /// Number of dimensions that they span.
    pub(crate) rank: usize,
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Whether their normal forces differ: bounds then cut no face off, but end at each force.
    pub(crate) general: bool,
    /// The closed form that doubles use instead of the search, where these are the edges of a pyramid.
    pyramid: Option<Pyramid>,
}

/// How the apex, the force of zero, takes part.
#[derive(Clone, Copy, PartialEq)]
enum Apex {
    /// Any nonnegative combination belongs to the set: its weight is free.
    Free,
    /// Convex combinations with zero.
    Vertex,
    /// Convex combinations of extreme forces alone.
    Absent,
}

const APEX: usize = usize::MAX;

/// Points of a face, and one that comes in.
const FACE: usize = 6;

impl Polytope {
    pub(crate) fn new(forces: Vec<ContactForce>, general: bool) -> Self {
        let rank = Self::span(&forces).len();
        let pyramid = if general { None } else { Pyramid::of(&forces) };
        Self { forces, rank, low: 0.0, high: f64::INFINITY, general, pyramid }
    }

    /// Orthonormal forces that span these.
    pub(crate) fn span(forces: &[ContactForce]) -> Vec<ContactForce> {
        let longest = forces.iter().map(ContactForce::norm).fold(0.0, f64::max);
        let mut axes: Vec<ContactForce> = Vec::with_capacity(4);
        for force in forces {
            let axis = without(force, &axes);
            if axes.len() < 4 && axis.norm() > 1e-12 * longest {
                axes.push(axis.normalize());
            }
        }
        axes
    }

    /// Searches over faces from now on, whose tolerance keeps nearly degenerate forces on one face.
    pub(crate) fn search_only(&mut self) {
        self.pyramid = None;
    }

    #[inline]
    pub(crate) fn project<R: Real>(&self, x: &Force<R>) -> Projection<R> {
        match &self.pyramid {
            Some(pyramid) if R::ROUNDING == 1.0 => {
                pyramid.project(&values(x), self.low, self.high).converted()
            }
            _ => self.search(x),
        }
    }

    fn search<R: Real>(&self, x: &Force<R>) -> Projection<R> {
        if self.general && self.high.is_finite() {
            return self.nearest(x, self.high, Apex::Vertex);
        }
        let found = self.nearest(x, 1.0, Apex::Free);
        if found.share.value() > self.high {
            self.nearest(x, self.high, Apex::Absent)
        } else if found.share.value() < self.low {
            self.nearest(x, self.low, Apex::Absent)
        } else {
            found
        }
    }

    /// The nearest point to `x` among combinations of `level` times the forces.
    fn nearest<R: Real>(&self, x: &Force<R>, level: f64, apex: Apex) -> Projection<R> {
        let zero = Force::repeat(R::zero());
        let corner = |k: usize| self.forces[k].map(|component| R::from(level).times(component));
        let mut face = if apex == Apex::Absent {
            let (first, _) = self.furthest(x);
            Face::of(first, corner(first))
        } else {
            Face::of(APEX, zero)
        };
        let free = apex == Apex::Free;
        for _ in 0..4 * self.forces.len() + 32 {
            let rest = without(&(x - face.point), &face.axes[..face.rank]);
            let (next, reach) = self.furthest(&rest);
            let (next, reach) = if apex == Apex::Vertex && reach < R::zero() {
                (APEX, R::zero())
            } else {
                (next, reach.times(level))
            };
            let point = if next == APEX { zero } else { corner(next) };
            let gain = reach - dot(&rest, &face.point);
            // Torsions may be many orders smaller than forces: what is left counts, not the whole.
            let noise = norm(&rest) * (norm(&point) + norm(&face.point));
            if face.rank == self.rank
                || gain <= noise.times(ROUNDED_REACH_OF_FACE * R::ROUNDING)
                || face.at[..face.len].contains(&next)
                || face.len == FACE
            {
                break;
            }
            (face.at[face.len], face.points[face.len], face.weights[face.len]) = (next, point, R::zero());
            face.len += 1;
            let before = face.point;
            face.settle(x, free);
            // Rounding alone would go round in circles.
            let (now, then) = (x - face.point, x - before);
            if dot(&now, &now) >= dot(&then, &then) {
                break;
            }
        }
        let used = face.at[..face.len].iter().zip(&face.weights).filter(|(at, _)| **at != APEX);
        let shares =
            used.map(|(_, weight)| if *weight > R::zero() { weight.times(level) } else { R::zero() });
        let mut found = Projection::fixed(face.point, shares.fold(R::zero(), |sum, share| sum + share));
        found.inside = face.rank == self.rank;
        for axis in &face.axes[..face.rank.min(4)] {
            found.push(*axis, R::from(1.0));
        }
        found
    }

    pub(crate) fn furthest<R: Real>(&self, direction: &Force<R>) -> (usize, R) {
        let mut best = (0, R::from(f64::NEG_INFINITY));
        for (k, force) in self.forces.iter().enumerate() {
            let mut reach = direction[0].times(force[0]);
            for component in 1..4 {
                reach += direction[component].times(force[component]);
            }
            if reach > best.1 {
                best = (k, reach);
            }
        }
        best
    }
}

/// `x` without its components along orthonormal axes.
fn without<R: Real>(x: &Force<R>, axes: &[Force<R>]) -> Force<R> {
    let mut rest = *x;
    // A second time, for what cancellation left.
    for _ in 0..2 {
        for axis in axes {
            rest -= axis * dot(axis, &rest);
        }
    }
    rest
}

/// The points whose combination is the nearest so far.
struct Face<R: Real> {
    at: [usize; FACE],
    points: [Force<R>; FACE],
    weights: [R; FACE],
    len: usize,
    point: Force<R>,
    /// Orthonormal directions along the face.
    axes: [Force<R>; FACE],
    rank: usize,
}

impl<R: Real> Face<R> {
    fn of(at: usize, point: Force<R>) -> Self {
        let none = [Force::repeat(R::zero()); FACE];
        let weights = [R::zero(); FACE];
        let mut face = Self { at: [APEX; FACE], points: none, weights, len: 1, point, axes: none, rank: 0 };
        (face.at[0], face.points[0], face.weights[0]) = (at, point, R::from(1.0));
        face
    }

    /// Moves to the nearest point of the hull, leaving out points with negative weights; the first one's is `free`.
    fn settle(&mut self, x: &Force<R>, free: bool) {
        for _ in 0..FACE {
            let target = self.affine_weights(x);
            let mut leaving: Option<(usize, R)> = None;
            for (k, aim) in target.iter().enumerate().take(self.len).skip(usize::from(free)) {
                if *aim <= R::zero() {
                    let away = self.weights[k] - *aim;
                    let whole = away <= R::zero() || self.weights[k] > away;
                    let step = if whole { R::from(1.0) } else { self.weights[k] / away };
                    if leaving.is_none_or(|(_, least)| step < least) {
                        leaving = Some((k, step));
                    }
                }
            }
            let Some((out, step)) = leaving else {
                self.weights = target;
                return;
            };
            if self.len == 1 {
                return;
            }
            for (weight, target) in self.weights.iter_mut().zip(target) {
                let moved = step * (target - *weight);
                *weight += moved;
            }
            self.len -= 1;
            self.at.swap(out, self.len);
            self.points.swap(out, self.len);
            self.weights.swap(out, self.len);
        }
    }

    /// Weights of the point nearest to `x` in the affine hull, by Gram-Schmidt applied twice. A point that depends on
    /// others gets none.
    fn affine_weights(&mut self, x: &Force<R>) -> [R; FACE] {
        let base = self.points[0];
        let zero = R::zero();
        let mut r = [[zero; FACE]; FACE];
        let mut q = [Force::repeat(zero); FACE];
        (self.rank, self.point) = (0, base);
        let edges = self.len - 1;
        for k in 0..edges {
            let edge = self.points[k + 1] - base;
            let mut rest = edge;
            for _ in 0..2 {
                for j in 0..k {
                    let along = dot(&q[j], &rest);
                    r[j][k] += along;
                    rest -= q[j] * along;
                }
            }
            let left = norm(&rest);
            if left > norm(&edge).times(DEPENDENT_EDGE) {
                (r[k][k], q[k]) = (left, rest / left);
                (self.axes[self.rank], self.rank) = (q[k], self.rank + 1);
            }
        }
        let away = x - base;
        let mut along = [zero; FACE];
        for k in 0..edges {
            along[k] = dot(&q[k], &away);
            self.point += q[k] * along[k];
        }
        let mut weights = [zero; FACE];
        let mut used = zero;
        for k in (0..edges).rev() {
            if r[k][k] > zero {
                let known = (k + 1..edges).fold(zero, |sum, j| sum + r[k][j] * weights[j + 1]);
                weights[k + 1] = (along[k] - known) / r[k][k];
                used += weights[k + 1];
            }
        }
        weights[0] = R::from(1.0) - used;
        weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_numbers::numbers;

    /// Pyramids, soft fingers' polytopes and any forces, with bounds or without, and a point.
    fn cases() -> impl Iterator<Item = (Polytope, ContactForce)> {
        let mut number = numbers(3);
        (0..4_000).map(move |k| {
            let general = k % 3 == 0;
            let mut forces: Vec<ContactForce> = (0..3 + k % 6)
                .map(|h| {
                    let (s, c) = (f64::from(h) * 6.3 / f64::from(3 + k % 6)).sin_cos();
                    let twist = if k % 2 == 0 { 0.0 } else { 0.2 * number() };
                    let normal = if general { 1.0 + 0.3 * number() } else { 1.0 };
                    ContactForce::new(normal, 0.6 * c, 0.6 * s, twist)
                })
                .collect();
            if k % 11 == 0 {
                forces.push(forces[0]);
            }
            let mut polytope = Polytope::new(forces, general);
            if k % 4 < 2 {
                polytope.high = 1.0;
            }
            if !general && k % 5 == 0 {
                polytope.low = 0.3;
            }
            (polytope, ContactForce::from_fn(|_, _| 2.0 * number()))
        })
    }

    #[test]
    fn what_a_projection_takes_away_is_orthogonal_to_the_hull() {
        for (polytope, x) in cases() {
            let found = polytope.project(&x);
            let (rest, p) = (x - found.force, found.force);
            let corners = polytope.forces.iter().map(|f| f.dot(&rest));
            let most = corners.fold(f64::NEG_INFINITY, f64::max);
            let (low, high) = (polytope.low, polytope.high);
            let reach = if high.is_finite() { (low * most).max(high * most) } else { low * most };
            assert!(high.is_finite() || most <= 1e-13, "{polytope:?} {x} {most:e}");
            assert!(reach - rest.dot(&p) <= 1e-13, "{polytope:?} {x} {p} {:e}", reach - rest.dot(&p));
            let again = polytope.project(&p);
            assert!((again.force - p).norm() <= 1e-13, "{polytope:?} {x} {p} {}", again.force);
            assert!(
                found.share >= low - 1e-13 && found.share <= high + 1e-13,
                "{polytope:?} {}",
                found.share
            );
        }
    }

    #[test]
    fn the_derivative_of_a_projection_projects_onto_the_face() {
        let mut number = numbers(3);
        let mut checked = 0;
        for (polytope, x) in cases() {
            let step = ContactForce::from_fn(|_, _| 1e-7 * number());
            let [found, ahead] = [x, x + step].map(|x| polytope.project(&x));
            if found.count != ahead.count {
                continue;
            }
            let axes = found.axes.iter().take(found.count);
            let expected: ContactForce = axes.map(|axis| axis * axis.dot(&step)).sum();
            assert!((ahead.force - found.force - expected).norm() <= 1e-13, "{polytope:?} {x}");
            checked += 1;
        }
        assert!(checked > 3_900, "{checked}");
    }
}
