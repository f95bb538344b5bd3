//! The point of a convex set nearest to the origin, by Wolfe's algorithm with the support oracle.
//!
//! It answers where the polytope cannot start: the origin lies outside the set, and `rho > 0` is the distance.
//! The support plane at the current point bounds the distance from below, its norm from above.

use crate::convex::rounding::{Rounding, along};
use crate::grasp::{REPRESENTABLE, Wrench, length, unit};
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{
    DEPENDENT_EDGE, DEPENDENT_EDGE_32_DIGITS, LEAST_PROGRESS, ROUNDED_DISTANCE, ROUNDED_POINT,
    ROUNDED_QUOTIENT, UNUSED_WEIGHT, UNUSED_WEIGHT_32_DIGITS,
};
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
    /// The unit direction `z` whose support `p(z)` proves `lower`.
    pub(crate) witness: Wrench<D>,
    /// Some point of the set is no further than this.
    pub(crate) upper: f64,
    /// Whether the bracket is as narrow as asked for, or as rounding allows.
    pub(crate) converged: bool,
    pub(crate) supports: usize,
    /// `point` as a convex combination: numbers of oracle calls (from 0) and weights.
    pub(crate) combination: [(usize, f64); CORRAL],
}

/// Finds the nearest point to a relative tolerance; stops at norm `negligible`, and after `max_calls` calls of the
/// oracle where no direction has turned up by then along which the whole set lies beyond the origin.
///
/// `oracle(z)` answers for unit `z`, with points that are uncertain by their `rounding`: the bracket holds for the points as
/// they were before it.
pub(crate) fn nearest_point<const D: usize>(
    rtol: f64,
    negligible: f64,
    max_calls: usize,
    rounding: &impl Rounding<D>,
    mut oracle: impl FnMut(&Wrench<D>) -> Support<D>,
) -> NearestPoint<D> {
    let uncertain = rounding.of_any_point();
    let start = Wrench::repeat((D as f64).sqrt().recip());
    let first = oracle(&start).wrench;
    let mut corral = Corral::of(first, start);
    let mut best = NearestPoint {
        point: first,
        lower: f64::NEG_INFINITY,
        witness: start,
        upper: length(&first),
        converged: false,
        supports: 1,
        combination: corral.combination(),
    };
    let mut reached = (first, corral.directions);
    let mut stalled = 0;
    for _ in 0..MAX_ITERATIONS {
        let point = corral.nearest;
        let norm = length(&point);
        // The point that the weights give belongs to the hull; where rounding spoilt them, it is not the nearest.
        let weighted = corral.weighted();
        let distance = length(&weighted);
        if distance < best.upper {
            stalled = if distance < best.upper * (1.0 - LEAST_PROGRESS) { 0 } else { stalled };
            (best.point, best.upper, best.combination) = (point, distance, corral.combination());
            reached = (weighted, corral.directions);
        }
        // A plane nearer than what rounding does to the combination itself proves nothing.
        if norm <= negligible.max(ROUNDED_POINT * corral.combined_length())
            || (best.lower <= 0.0 && best.supports >= max_calls)
        {
            break;
        }
        // Of a point whose squares vanish, the length is no divisor.
        let z = if norm > REPRESENTABLE.start { point / -norm } else { -unit(&point) };
        let support = oracle(&z);
        best.supports += 1;
        if -support.value > best.lower {
            stalled =
                if -support.value > best.lower + LEAST_PROGRESS * best.lower.abs() { 0 } else { stalled };
            (best.lower, best.witness) = (-support.value, z);
        }
        stalled += 1;
        // Only what meets the support plane rounds it: a wrench far behind may be as long as it likes.
        let noise = ROUNDED_DISTANCE * corral.longest().max(length(&support.wrench));
        let lost = along(&z, &uncertain);
        let noise = if lost > 0.0 { noise.min(lost * (ROUNDED_DISTANCE / ROUNDED_POINT)) } else { noise };
        let gap = best.upper - best.lower - rtol * best.upper;
        best.converged = gap <= noise;
        if best.converged || interrupt::stopped() {
            break;
        }
        // A point that returns can bring nothing new, unless what is known of the others is more than rounding.
        if corral.holds(&support.wrench) || stalled > MAX_STALLED_CALLS {
            // Nor is it worth the price where rounding takes as much of the bracket, or where the origin is likely to belong
            // to the set and others will tell.
            if corral.precise || gap <= lost || (best.lower <= 0.0 && max_calls < usize::MAX) {
                break;
            }
            stalled = 0;
            corral.continue_in_32_digits();
            continue;
        }
        corral.admit(support.wrench, z, best.supports - 1);
    }
    if !certify_alike(&mut best, &reached.0, &uncertain, rtol) {
        certify(&mut best, &reached, rounding, rtol);
    }
    best
}

/// Oracle calls in a row, with hardly any progress, that show that rounding is larger than what a call gains.
const MAX_STALLED_CALLS: usize = 40;

/// Moves both bounds by what rounding may have done to any point. False, and nothing is moved, where that leaves the
/// bracket wider than asked for: [`certify`] asks each contact.
fn certify_alike<const D: usize>(
    best: &mut NearestPoint<D>,
    reached: &Wrench<D>,
    uncertain: &Wrench<D>,
    rtol: f64,
) -> bool {
    let lower = best.lower - along(&best.witness, uncertain) - ROUNDED_QUOTIENT * best.lower.abs();
    let upper = length(&(reached.abs() + uncertain)) * (1.0 + ROUNDED_QUOTIENT);
    let narrow = lower > 0.0 && upper - lower <= rtol * upper;
    if narrow {
        (best.lower, best.upper, best.converged) = (lower, upper, true);
    }
    narrow
}

/// Moves both bounds by what rounding may have done to them.
fn certify<const D: usize>(
    best: &mut NearestPoint<D>,
    (reached, directions): &(Wrench<D>, [Wrench<D>; CORRAL]),
    rounding: &impl Rounding<D>,
    rtol: f64,
) {
    let (lost, _) = rounding.of_support(&best.witness);
    let before = best.lower.max(0.0);
    best.lower -= lost + ROUNDED_QUOTIENT * best.lower.abs();
    let weighted = best.combination.iter().zip(directions).filter(|((_, weight), _)| *weight != 0.0);
    let uncertain: Wrench<D> = weighted.map(|((_, weight), z)| rounding.of_support(z).1 * weight.abs()).sum();
    best.upper = length(&(reached.abs() + uncertain)) * (1.0 + ROUNDED_QUOTIENT);
    best.lower = best.lower.min(best.upper);
    // What is left beside the rounding of both bounds is no more than that rounding.
    let rounded = (before - best.lower).max(lost) + (best.upper - length(reached)).max(0.0);
    best.converged |= best.upper - best.lower <= rtol * best.upper + (2.0 * rounded).max(3.0 * lost);
}

/// Affinely independent points whose convex hull holds the current point in its relative interior.
struct Corral<const D: usize> {
    points: [Wrench<D>; CORRAL],
    /// Which oracle call gave each point, and along which direction.
    calls: [usize; CORRAL],
    directions: [Wrench<D>; CORRAL],
    weights: [f64; CORRAL],
    len: usize,
    /// The point of the affine hull nearest to the origin, orthogonal to it beyond what the weights can say.
    nearest: Wrench<D>,
    /// Whether edges that all but coincide are told apart in 32 digits.
    precise: bool,
}

impl<const D: usize> Corral<D> {
    fn of(first: Wrench<D>, z: Wrench<D>) -> Self {
        let mut weights = [0.0; CORRAL];
        weights[0] = 1.0;
        let (points, calls, directions) = ([first; CORRAL], [0; CORRAL], [z; CORRAL]);
        Self { points, calls, directions, weights, len: 1, nearest: first, precise: false }
    }

    fn combination(&self) -> [(usize, f64); CORRAL] {
        std::array::from_fn(|k| if k < self.len { (self.calls[k], self.weights[k]) } else { (0, 0.0) })
    }

    /// The convex combination of the points.
    fn weighted(&self) -> Wrench<D> {
        self.points[..self.len].iter().zip(self.weights).map(|(point, weight)| point * weight).sum()
    }

    /// Goes on in 32 digits, beginning with the current points.
    fn continue_in_32_digits(&mut self) {
        self.precise = true;
        self.minimise();
    }

    fn holds(&self, point: &Wrench<D>) -> bool {
        self.points[..self.len].contains(point)
    }

    /// Adds a point and moves to the nearest point of the hull, dropping what is no longer needed.
    fn admit(&mut self, point: Wrench<D>, z: Wrench<D>, call: usize) {
        if self.len == D + 1 {
            self.drop(self.lightest());
        }
        self.points[self.len] = point;
        self.calls[self.len] = call;
        self.directions[self.len] = z;
        self.weights[self.len] = 0.0;
        self.len += 1;
        self.minimise();
    }

    /// Moves to the nearest point of the hull, dropping what is not needed.
    fn minimise(&mut self) {
        let least = if self.precise { UNUSED_WEIGHT_32_DIGITS } else { UNUSED_WEIGHT };
        for _ in 0..=D + 1 {
            self.shortest_first();
            let (target, nearest) =
                if self.precise { self.precise_minimiser() } else { self.affine_minimiser() };
            let reach = length(&self.points[0]);
            // A wrench's weight counts by how far it moves the point, and a long one moves it far.
            let counts = |k: usize| target[k] * (length(&self.points[k]) / reach).max(1.0) > least;
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

    /// The lengths of the points, by their weights.
    fn combined_length(&self) -> f64 {
        self.points[..self.len]
            .iter()
            .zip(&self.weights)
            .map(|(point, weight)| weight.abs() * length(point))
            .sum()
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
        self.directions.swap(one, other);
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
            if left > DEPENDENT_EDGE * length(&edge) {
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

    /// [`Self::affine_minimiser`] in twice the precision: along a smooth boundary, neighbouring support points differ by
    /// hardly more than rounding, and the distance may be small beside them all.
    fn precise_minimiser(&self) -> ([f64; CORRAL], Wrench<D>) {
        type Point<const D: usize> = [DoubleDouble; D];
        let zero = DoubleDouble::ZERO;
        let dot = |a: &Point<D>, b: &Point<D>| a.iter().zip(b).fold(zero, |sum, (a, b)| sum + *a * *b);
        let less = |a: &mut Point<D>, b: &Point<D>, by: DoubleDouble| {
            for (a, b) in a.iter_mut().zip(b) {
                *a -= *b * by;
            }
        };
        let first: Point<D> = std::array::from_fn(|c| self.points[0][c].into());
        let edges = self.len - 1;
        let mut q = [[zero; D]; CORRAL];
        let mut r = [[zero; CORRAL]; CORRAL];
        for k in 0..edges {
            let mut edge: Point<D> = std::array::from_fn(|c| self.points[k + 1][c].into());
            less(&mut edge, &first, 1.0.into());
            let whole = dot(&edge, &edge).sqrt();
            for _ in 0..2 {
                for j in 0..k {
                    let along = dot(&q[j], &edge);
                    r[j][k] += along;
                    less(&mut edge, &q[j], along);
                }
            }
            let left = dot(&edge, &edge).sqrt();
            if left.value() > DEPENDENT_EDGE_32_DIGITS * whole.value() {
                r[k][k] = left;
                q[k] = edge.map(|x| x / left);
            }
        }
        let mut target = [zero; CORRAL];
        for k in (0..edges).rev() {
            if r[k][k].value() > 0.0 {
                let mut right = -dot(&q[k], &first);
                for j in k + 1..edges {
                    right -= r[k][j] * target[j + 1];
                }
                target[k + 1] = right / r[k][k];
            }
        }
        target[0] = target[1..self.len].iter().fold(1.0.into(), |left, weight| left - *weight);
        let mut nearest = first;
        for _ in 0..2 {
            for direction in &q[..edges] {
                let along = dot(direction, &nearest);
                less(&mut nearest, direction, along);
            }
        }
        (target.map(DoubleDouble::value), Wrench::from_fn(|c, _| nearest[c].value()))
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
        let found = nearest_point(1e-12, 0.0, usize::MAX, &Wrench::zeros(), hull(&points));
        assert!((found.upper - 3.0_f64.sqrt().recip()).abs() < 1e-14, "{found:?}");
        assert!(found.upper - found.lower < 1e-12, "{found:?}");
    }

    #[test]
    fn a_set_around_the_origin_has_no_positive_lower_bound() {
        let points = [Wrench::<3>::x(), -Wrench::<3>::x(), Wrench::<3>::y()];
        let found = nearest_point(1e-12, 1e-12, usize::MAX, &Wrench::zeros(), hull(&points));
        assert!(found.upper < 1e-12, "{found:?}");
    }
}
