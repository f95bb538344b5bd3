//! The point of a convex set nearest to the origin, by Wolfe's algorithm with the support oracle.
//!
//! It answers where the polytope cannot start: the origin lies outside the set, and `rho > 0` is the distance.
//! The support plane at the current point bounds the distance from below, its norm from above.

use crate::boundary::NOISE;
use crate::grasp::{Wrench, length};
use crate::interrupt;
use crate::wrench_set::Support;

/// A corral has at most `D + 1` points, and `D <= 6`.
pub(crate) const CORRAL: usize = 8;

const MAX_ITERATIONS: usize = 10_000;

/// The point nearest to the origin, with the bracket of its norm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NearestPoint<const D: usize> {
    pub(crate) point: Wrench<D>,
    /// No point of the set is nearer than this; not positive where the origin may belong to the set.
    pub(crate) lower: f64,
    /// The norm of `point`.
    pub(crate) upper: f64,
    /// Whether the bracket is as narrow as asked for, or as rounding allows.
    pub(crate) converged: bool,
    pub(crate) supports: usize,
    /// `point` as a convex combination: numbers of oracle calls (from 0) and weights.
    pub(crate) combination: [(usize, f64); CORRAL],
}

/// Finds the nearest point to a relative tolerance; stops at norm `negligible`, and after `patience` calls of the
/// oracle where no direction has turned up by then along which the whole set lies beyond the origin.
///
/// `oracle(z)` answers for unit `z`.
pub(crate) fn nearest_point<const D: usize>(
    rtol: f64,
    negligible: f64,
    patience: usize,
    mut oracle: impl FnMut(&Wrench<D>) -> Support<D>,
) -> NearestPoint<D> {
    let first = oracle(&Wrench::repeat((D as f64).sqrt().recip())).wrench;
    let mut corral = Corral::of(first);
    let mut best = NearestPoint {
        point: first,
        lower: f64::NEG_INFINITY,
        upper: length(&first),
        converged: false,
        supports: 1,
        combination: corral.combination(),
    };
    for _ in 0..MAX_ITERATIONS {
        let point = corral.nearest;
        let norm = length(&point);
        if norm < best.upper {
            (best.point, best.upper, best.combination) = (point, norm, corral.combination());
        }
        if norm <= negligible || (best.lower <= 0.0 && best.supports >= patience) {
            break;
        }
        let support = oracle(&(point / -norm));
        best.supports += 1;
        best.lower = best.lower.max(-support.value);
        // Only what meets the support plane rounds it: a wrench far behind may be as long as it likes.
        let noise = NOISE * corral.longest().max(length(&support.wrench));
        best.converged = best.upper - best.lower <= rtol * best.upper + noise;
        // A point that returns can bring nothing new.
        if best.converged || corral.holds(&support.wrench) || interrupt::stopped() {
            break;
        }
        corral.admit(support.wrench, best.supports - 1);
    }
    best.lower = best.lower.min(best.upper);
    best
}

/// Affinely independent points whose convex hull holds the current point in its relative interior.
struct Corral<const D: usize> {
    points: [Wrench<D>; CORRAL],
    /// Which oracle call gave each point.
    calls: [usize; CORRAL],
    weights: [f64; CORRAL],
    len: usize,
    /// The point of the affine hull nearest to the origin, orthogonal to it beyond what the weights can say.
    nearest: Wrench<D>,
}

impl<const D: usize> Corral<D> {
    fn of(first: Wrench<D>) -> Self {
        let mut weights = [0.0; CORRAL];
        weights[0] = 1.0;
        Self { points: [first; CORRAL], calls: [0; CORRAL], weights, len: 1, nearest: first }
    }

    fn combination(&self) -> [(usize, f64); CORRAL] {
        std::array::from_fn(|k| if k < self.len { (self.calls[k], self.weights[k]) } else { (0, 0.0) })
    }

    fn holds(&self, point: &Wrench<D>) -> bool {
        self.points[..self.len].contains(point)
    }

    /// Adds a point and moves to the nearest point of the hull, dropping what is no longer needed.
    fn admit(&mut self, point: Wrench<D>, call: usize) {
        if self.len == D + 1 {
            self.drop(self.lightest());
        }
        self.points[self.len] = point;
        self.calls[self.len] = call;
        self.weights[self.len] = 0.0;
        self.len += 1;
        for _ in 0..=D + 1 {
            self.shortest_first();
            let (target, nearest) = self.affine_minimiser();
            let reach = length(&self.points[0]);
            // A wrench's weight counts by how far it moves the point, and a long one moves it far.
            let counts = |k: usize| target[k] * (length(&self.points[k]) / reach).max(1.0) > 1e-14;
            let step = |k: usize| self.weights[k] / (self.weights[k] - target[k]).max(f64::MIN_POSITIVE);
            let outside = (0..self.len).filter(|&k| !counts(k)).map(|k| (k, step(k).min(1.0)));
            let Some((first, step)) = outside.min_by(|a, b| a.1.total_cmp(&b.1)) else {
                self.weights = target;
                self.nearest = nearest;
                return;
            };
            for (weight, target) in self.weights.iter_mut().zip(target) {
                *weight += step * (target - *weight);
            }
            self.drop(first);
        }
    }

    fn longest(&self) -> f64 {
        self.points[..self.len].iter().map(length).fold(0.0, f64::max)
    }

    /// Edges leave from the shortest point: beside points many times its length, no other keeps its digits.
    fn shortest_first(&mut self) {
        let lengths = self.points[..self.len].iter().map(length).enumerate();
        let shortest = lengths.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k);
        self.swap(0, shortest);
    }

    fn swap(&mut self, one: usize, other: usize) {
        self.points.swap(one, other);
        self.calls.swap(one, other);
        self.weights.swap(one, other);
    }

    fn lightest(&self) -> usize {
        let share = |k: usize| self.weights[k] * length(&self.points[k]);
        (0..self.len).min_by(|&a, &b| share(a).total_cmp(&share(b))).unwrap_or(0)
    }

    fn drop(&mut self, dropped: usize) {
        self.len -= 1;
        self.swap(dropped, self.len);
        let total: f64 = self.weights[..self.len].iter().sum();
        self.weights[..self.len].iter_mut().for_each(|w| *w /= total);
    }

    /// Weights of the point nearest to the origin in the affine hull: least squares over the edges from the
    /// first point, by Gram-Schmidt applied twice.
    fn affine_minimiser(&self) -> ([f64; CORRAL], Wrench<D>) {
        let edges = self.len - 1;
        let mut q = [Wrench::<D>::zeros(); CORRAL];
        let mut r = [[0.0; CORRAL]; CORRAL];
        for k in 0..edges {
            let edge = self.points[k + 1] - self.points[0];
            q[k] = edge;
            for _ in 0..2 {
                for j in 0..k {
                    let along = q[j].dot(&q[k]);
                    r[j][k] += along;
                    let removed = q[j] * along;
                    q[k] -= removed;
                }
            }
            let left = length(&q[k]);
            // An edge in the span of the others decides nothing; its weight is zero.
            if left > 1e-13 * length(&edge) {
                r[k][k] = left;
                q[k] /= left;
            } else {
                q[k] = Wrench::zeros();
            }
        }
        let mut target = [0.0; CORRAL];
        for k in (0..edges).rev() {
            if r[k][k] > 0.0 {
                let known: f64 = (k + 1..edges).map(|j| r[k][j] * target[j + 1]).sum();
                target[k + 1] = (-q[k].dot(&self.points[0]) - known) / r[k][k];
            }
        }
        target[0] = 1.0 - target[1..self.len].iter().sum::<f64>();
        // Near the origin the first projection cancels; the second makes the direction exact again.
        let mut nearest = self.points[0];
        for _ in 0..2 {
            for direction in &q[..edges] {
                nearest -= direction * direction.dot(&nearest);
            }
        }
        (target, nearest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hull<const D: usize>(points: &[Wrench<D>]) -> impl FnMut(&Wrench<D>) -> Support<D> {
        move |z| {
            let best = points.iter().max_by(|a, b| a.dot(z).total_cmp(&b.dot(z))).expect("points");
            Support { value: best.dot(z), wrench: *best }
        }
    }

    #[test]
    fn the_nearest_point_of_a_simplex_is_exact() {
        // The plane x + y + z = 1 lies at 1 / sqrt(3).
        let points = [Wrench::<3>::x(), Wrench::<3>::y(), Wrench::<3>::z(), Wrench::<3>::repeat(2.0)];
        let found = nearest_point(1e-12, 0.0, usize::MAX, hull(&points));
        assert!((found.upper - 3.0_f64.sqrt().recip()).abs() < 1e-14, "{found:?}");
        assert!(found.upper - found.lower < 1e-12, "{found:?}");
    }

    #[test]
    fn a_set_around_the_origin_has_no_positive_lower_bound() {
        let points = [Wrench::<3>::x(), -Wrench::<3>::x(), Wrench::<3>::y()];
        let found = nearest_point(1e-12, 1e-12, usize::MAX, hull(&points));
        assert!(found.upper < 1e-12, "{found:?}");
    }
}
