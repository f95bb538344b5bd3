//! Projections onto pyramids, cut or not, and onto the convex hull of zero and finitely many extreme forces.
//!
//! The projection searches over faces (Wolfe 1976; for cones the nonnegative least squares of Lawson and Hanson). It
//! projects onto the affine hull of the current face. Points with negative weights leave the face. The extreme force that
//! reaches furthest along the residual joins it. A contact force has four components, so a face needs at most five points.

use crate::force::squares::projection::Projection;
use crate::grasp::contact::ContactForce;
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
        Self { forces, rank, low: 0.0, high: f64::INFINITY, general }
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

    pub(crate) fn project(&self, x: &ContactForce) -> Projection {
        if self.general && self.high.is_finite() {
            return self.nearest(x, self.high, Apex::Vertex);
        }
        let found = self.nearest(x, 1.0, Apex::Free);
        if found.share > self.high {
            self.nearest(x, self.high, Apex::Absent)
        } else if found.share < self.low {
            self.nearest(x, self.low, Apex::Absent)
        } else {
            found
        }
    }

    /// The nearest point to `x` among combinations of `level` times the forces.
    fn nearest(&self, x: &ContactForce, level: f64, apex: Apex) -> Projection {
        let mut face = if apex == Apex::Absent {
            let (first, _) = self.furthest(x);
            Face::of(first, self.forces[first] * level)
        } else {
            Face::of(APEX, ContactForce::zeros())
        };
        let free = apex == Apex::Free;
        for _ in 0..4 * self.forces.len() + 32 {
            let rest = without(&(x - face.point), &face.axes[..face.rank]);
            let (next, reach) = self.furthest(&rest);
            let (next, reach) =
                if apex == Apex::Vertex && reach < 0.0 { (APEX, 0.0) } else { (next, reach * level) };
            let point = if next == APEX { ContactForce::zeros() } else { self.forces[next] * level };
            let gain = reach - rest.dot(&face.point);
            // Torsions may be many orders smaller than forces: what is left counts, not the whole.
            let noise = rest.norm() * (point.norm() + face.point.norm());
            if face.rank == self.rank
                || gain <= ROUNDED_REACH_OF_FACE * noise
                || face.at[..face.len].contains(&next)
                || face.len == FACE
            {
                break;
            }
            (face.at[face.len], face.points[face.len], face.weights[face.len]) = (next, point, 0.0);
            face.len += 1;
            let before = face.point;
            face.settle(x, free);
            // Rounding alone would go round in circles.
            if (x - face.point).norm_squared() >= (x - before).norm_squared() {
                break;
            }
        }
        let used = face.at[..face.len].iter().zip(&face.weights).filter(|(at, _)| **at != APEX);
        let mut found = Projection::fixed(face.point, used.map(|(_, weight)| weight.max(0.0) * level).sum());
        found.inside = face.rank == self.rank;
        for axis in &face.axes[..face.rank.min(4)] {
            found.push(*axis, 1.0);
        }
        found
    }

    fn furthest(&self, direction: &ContactForce) -> (usize, f64) {
        let mut best = (0, f64::NEG_INFINITY);
        for (k, force) in self.forces.iter().enumerate() {
            let reach = force.dot(direction);
            if reach > best.1 {
                best = (k, reach);
            }
        }
        best
    }
}

/// `x` without its components along orthonormal axes.
fn without(x: &ContactForce, axes: &[ContactForce]) -> ContactForce {
    let mut rest = *x;
    // A second time, for what cancellation left.
    for _ in 0..2 {
        for axis in axes {
            rest -= axis * axis.dot(&rest);
        }
    }
    rest
}

/// The points whose combination is the nearest so far.
struct Face {
    at: [usize; FACE],
    points: [ContactForce; FACE],
    weights: [f64; FACE],
    len: usize,
    point: ContactForce,
    /// Orthonormal directions along the face.
    axes: [ContactForce; FACE],
    rank: usize,
}

impl Face {
    fn of(at: usize, point: ContactForce) -> Self {
        let (none, axes) = ([ContactForce::zeros(); FACE], [ContactForce::zeros(); FACE]);
        let mut face =
            Self { at: [APEX; FACE], points: none, weights: [0.0; FACE], len: 1, point, axes, rank: 0 };
        (face.at[0], face.points[0], face.weights[0]) = (at, point, 1.0);
        face
    }

    /// Moves to the nearest point of the hull, leaving out points with negative weights; the first one's is `free`.
    fn settle(&mut self, x: &ContactForce, free: bool) {
        for _ in 0..FACE {
            let target = self.affine_weights(x);
            let first = usize::from(free);
            let step = |k: usize| self.weights[k] / (self.weights[k] - target[k]).max(f64::MIN_POSITIVE);
            let leaving = (first..self.len).filter(|&k| target[k] <= 0.0).map(|k| (k, step(k).min(1.0)));
            let Some((out, step)) = leaving.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                self.weights = target;
                return;
            };
            if self.len == 1 {
                return;
            }
            for (weight, target) in self.weights.iter_mut().zip(target) {
                *weight += step * (target - *weight);
            }
            self.len -= 1;
            self.at.swap(out, self.len);
            self.points.swap(out, self.len);
            self.weights.swap(out, self.len);
        }
    }

    /// Weights of the point nearest to `x` in the affine hull, by Gram-Schmidt applied twice. A point that depends on
    /// others gets none.
    fn affine_weights(&mut self, x: &ContactForce) -> [f64; FACE] {
        let base = self.points[0];
        let mut r = [[0.0; FACE]; FACE];
        let mut q = [ContactForce::zeros(); FACE];
        (self.rank, self.point) = (0, base);
        let edges = self.len - 1;
        for k in 0..edges {
            let edge = self.points[k + 1] - base;
            let mut rest = edge;
            for _ in 0..2 {
                for j in 0..k {
                    let along = q[j].dot(&rest);
                    r[j][k] += along;
                    rest -= q[j] * along;
                }
            }
            let left = rest.norm();
            if left > DEPENDENT_EDGE * edge.norm() {
                (r[k][k], q[k]) = (left, rest / left);
                (self.axes[self.rank], self.rank) = (q[k], self.rank + 1);
            }
        }
        let away = x - base;
        let mut along = [0.0; FACE];
        for k in 0..edges {
            along[k] = q[k].dot(&away);
            self.point += q[k] * along[k];
        }
        let mut weights = [0.0; FACE];
        for k in (0..edges).rev() {
            if r[k][k] > 0.0 {
                let known: f64 = (k + 1..edges).map(|j| r[k][j] * weights[j + 1]).sum();
                weights[k + 1] = (along[k] - known) / r[k][k];
            }
        }
        weights[0] = 1.0 - weights[1..self.len].iter().sum::<f64>();
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
