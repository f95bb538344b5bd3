//! The minimiser of the dual function by Newton's method: semismooth, with a line search on the dual function.

use nalgebra::SMatrix;

use crate::force::squares::dual::{Dual, DualPoint};
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;
use crate::linalg::dense::solve_definite;

/// Newton steps at most: 7 from nothing and 2 from the last wrench are usual.
const MAX_STEPS: usize = 80;

/// Points that a line search looks at.
const MAX_TRIALS: usize = 60;

/// The gradient that counts as zero, relative to its terms: some hundred roundings.
const CONVERGED: f64 = 3e-14;

/// A step that no longer halves the gradient ends the iteration once it is this small.
const STALLED: f64 = 1e-11;

/// What regularises Newton's matrix, relative to the gradient; and its bounds beside the identity.
const REGULARISED: f64 = 1e-3;
const LEAST_REGULARISED: f64 = 1e-17;
const MOST_REGULARISED: f64 = 1e-3;

/// A line search beyond so many Newton steps may have no end.
const LEAP: f64 = 15.0;

/// Multipliers beyond this, relative to what forces of that size need, belong to no answer.
const DIVERGED: f64 = 1e12;

/// Minimises the dual function from `start`; returns the best point and the number of steps. The forces are those of the
/// point.
pub(crate) fn minimise<const D: usize>(
    dual: &Dual<D>,
    b: &Wrench<D>,
    start: DualPoint<D>,
    forces: &mut [ContactForce],
    shares: &mut [f64],
) -> (DualPoint<D>, usize) {
    let mut point = start;
    let mut stalled = 0;
    let mut leapt = false;
    for step in 0..MAX_STEPS {
        let norm = point.gradient.norm();
        let relative = norm / point.size;
        let converged = relative <= CONVERGED || relative.is_nan();
        if converged || (stalled >= 3 && relative <= STALLED) {
            return (point, step);
        }
        // Multipliers of wrenches that nothing balances grow without end.
        if (leapt || step % 4 == 3) && relative > STALLED && dual.separates(&point.y, b) {
            return (point, step);
        }
        if stalled >= 10 || point.y.norm() > DIVERGED * point.size {
            return (point, step);
        }
        // With a price of the residual the matrix is definite by itself.
        let regularised = if dual.slack.is_some() { 0.0 } else { REGULARISED * relative };
        let direction = newton_direction(&point, regularised);
        let next = line_search(dual, b, &point, &direction, forces, shares);
        let Some(next) = next else {
            point = dual.at(&point.y, b, forces, shares);
            return (point, step);
        };
        leapt = (next.y - point.y).norm_squared() > LEAP * LEAP * direction.norm_squared();
        stalled =
            if next.gradient.norm() <= 0.5 * norm { 0 } else { stalled + usize::from(relative <= STALLED) };
        point = next;
    }
    (point, MAX_STEPS)
}

fn newton_direction<const D: usize>(point: &DualPoint<D>, regularised: f64) -> Wrench<D> {
    let mut matrix: SMatrix<f64, D, D> = point.hessian;
    let regularised = regularised.clamp(LEAST_REGULARISED, MOST_REGULARISED);
    for k in 0..D {
        matrix[(k, k)] += regularised;
    }
    solve_definite(&mut matrix, &-point.gradient, LEAST_REGULARISED)
}

/// A point along the direction where the function is lower and its slope at most half. The function is convex, so its
/// slope grows along the direction: a slope that is still negative proves the descent without differences of
/// values, which rounding hides near the end.
fn line_search<const D: usize>(
    dual: &Dual<D>,
    b: &Wrench<D>,
    from: &DualPoint<D>,
    direction: &Wrench<D>,
    forces: &mut [ContactForce],
    shares: &mut [f64],
) -> Option<DualPoint<D>> {
    let slope = from.gradient.dot(direction);
    if slope >= 0.0 || slope.is_nan() {
        return None;
    }
    let (mut low, mut low_slope, mut high, mut high_slope) = (0.0, slope, f64::INFINITY, 0.0);
    let mut lower: Option<DualPoint<D>> = None;
    let mut step = 1.0;
    for trial in 1..=MAX_TRIALS {
        let found = dual.at(&(from.y + direction * step), b, forces, shares);
        let now = found.gradient.dot(direction);
        if !now.is_finite() {
            high = step;
            step *= 0.1;
            continue;
        }
        let rounding = 8.0 * f64::EPSILON * found.terms.max(from.terms);
        if now.abs() <= 0.5 * slope.abs() && (now <= 0.0 || found.value <= from.value + rounding) {
            return Some(found);
        }
        if now <= 0.0 {
            (low, low_slope, lower) = (step, now, Some(found));
            // Along a direction without end.
            if !high.is_finite() && step > LEAP && dual.separates(&found.y, b) {
                return Some(found);
            }
        } else {
            (high, high_slope) = (step, now);
        }
        step = if high.is_finite() {
            // Every third time the middle: at a kink the secant comes nearer from one side only.
            let secant = if high_slope > 0.0 && trial % 3 != 0 {
                low - low_slope * (high - low) / (high_slope - low_slope)
            } else {
                0.5 * (low + high)
            };
            secant.clamp(low + 0.1 * (high - low), high - 0.1 * (high - low))
        } else {
            4.0 * step
        };
    }
    let found = lower?;
    Some(dual.at(&found.y, b, forces, shares))
}
