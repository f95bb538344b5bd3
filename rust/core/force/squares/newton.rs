//! The minimiser of the dual function by Newton's method: semismooth, with a line search on the dual function.

use nalgebra::{SMatrix, SVector};

use crate::force::squares::dual::{Dual, DualPoint};
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;
use crate::interrupt;
use crate::linalg::dense::solve_definite;
use crate::linalg::real::{Real, dot, norm, values};

/// Newton steps at most: 7 from nothing and 2 from the last wrench are usual.
const MAX_NEWTON_STEPS: usize = 80;

/// The same in 32 digits, which are asked where a high price makes the function steep.
const MAX_NEWTON_STEPS_32_DIGITS: usize = 40;

/// Points that a line search looks at.
const MAX_TRIALS: usize = 60;
const MAX_TRIALS_32_DIGITS: usize = 200;

/// The gradient that counts as zero, relative to its terms: some hundred roundings.
const CONVERGED_GRADIENT: f64 = 3e-14;

/// A step that no longer halves the gradient ends the iteration once it is this small.
const STALLED_GRADIENT: f64 = 1e-11;

/// What regularises Newton's matrix, relative to the gradient; and its bounds beside the identity.
const REGULARISED: f64 = 1e-3;
const LEAST_REGULARISED: f64 = 1e-17;
const MOST_REGULARISED: f64 = 1e-3;

/// A line search beyond so many Newton steps may have no end.
const LONG_STEP: f64 = 15.0;

/// Multipliers beyond this, relative to what forces of that size need, belong to no answer.
const DIVERGED: f64 = 1e12;

/// Minimises the dual function from `start`; returns the best point and the number of steps. The forces are those of the
/// point.
pub(crate) fn minimise<const D: usize, R: Real>(
    dual: &Dual<D>,
    b: &Wrench<D>,
    start: DualPoint<D, R>,
    forces: &mut [ContactForce],
    shares: &mut [f64],
) -> (DualPoint<D, R>, usize) {
    let mut point = start;
    let mut stalled = 0;
    let mut was_long = false;
    // Beside a high price the forces are a small part of the terms.
    let finer = R::ROUNDING.sqrt();
    let max_steps = if R::ROUNDING == 1.0 { MAX_NEWTON_STEPS } else { MAX_NEWTON_STEPS_32_DIGITS };
    for step in 0..max_steps {
        let left = norm(&point.gradient).value();
        let relative = left / point.size;
        let converged = relative <= CONVERGED_GRADIENT * finer || relative.is_nan();
        if converged || (stalled >= 3 && relative <= STALLED_GRADIENT * finer) {
            return (point, step);
        }
        // Multipliers of wrenches that nothing balances grow without end.
        if (was_long || step % 4 == 3) && relative > STALLED_GRADIENT && dual.separates(&values(&point.y), b)
        {
            return (point, step);
        }
        if stalled >= 10
            || (step % 8 == 7 && interrupt::stopped())
            || norm(&point.y).value() > DIVERGED / R::ROUNDING * point.size
        {
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
        was_long = norm(&(next.y - point.y)).value() > LONG_STEP * norm(&direction).value();
        let halved = norm(&next.gradient).value() <= 0.5 * left;
        stalled = if halved { 0 } else { stalled + usize::from(relative <= STALLED_GRADIENT * finer) };
        point = next;
    }
    (point, max_steps)
}

fn newton_direction<const D: usize, R: Real>(point: &DualPoint<D, R>, regularised: f64) -> SVector<R, D> {
    let mut matrix = point.hessian;
    let least = LEAST_REGULARISED * R::ROUNDING;
    let regularised = R::from(regularised.clamp(least, MOST_REGULARISED));
    for k in 0..D {
        matrix[(k, k)] += regularised;
    }
    solve_definite(&mut matrix, &-point.gradient, least)
}

/// The curvature along a direction; of the matrix the lower triangle counts.
fn along<const D: usize, R: Real>(hessian: &SMatrix<R, D, D>, direction: &SVector<R, D>) -> R {
    let mut sum = R::zero();
    for c in 0..D {
        let mut row = hessian[(c, c)] * direction[c];
        for r in c + 1..D {
            row += (hessian[(r, c)] * direction[r]).times(2.0);
        }
        sum += row * direction[c];
    }
    sum
}

/// A point along the direction where the function is lower and its slope at most half. The function is convex, so its
/// slope grows along the direction: a slope that is still negative proves the descent without differences of
/// values, which rounding hides near the end.
fn line_search<const D: usize, R: Real>(
    dual: &Dual<D>,
    b: &Wrench<D>,
    from: &DualPoint<D, R>,
    direction: &SVector<R, D>,
    forces: &mut [ContactForce],
    shares: &mut [f64],
) -> Option<DualPoint<D, R>> {
    let slope = dot(&from.gradient, direction).value();
    if slope >= 0.0 || slope.is_nan() {
        return None;
    }
    // Steps that differ by less lead to the same multiplier.
    let resolution =
        f64::EPSILON * R::ROUNDING * norm(&from.y).value() / norm(direction).value().max(f64::MIN_POSITIVE);
    let (mut low, mut low_slope, mut high, mut high_slope) = (R::zero(), slope, None::<R>, 0.0);
    let mut lower: Option<DualPoint<D, R>> = None;
    let mut step = R::from(1.0);
    let max_trials = if R::ROUNDING == 1.0 { MAX_TRIALS } else { MAX_TRIALS_32_DIGITS };
    for trial in 1..=max_trials {
        let found = dual.at(&(from.y + direction * step), b, forces, shares);
        let at_point = dot(&found.gradient, direction);
        let now = at_point.value();
        if !now.is_finite() {
            high = Some(step);
            step = step.times(0.1);
            continue;
        }
        let rounding = 8.0 * f64::EPSILON * R::ROUNDING * found.terms.max(from.terms);
        let lowered = || (found.value - from.value).value() <= rounding;
        if now.abs() <= 0.5 * slope.abs() && (now <= 0.0 || lowered()) {
            return Some(found);
        }
        // Beside a high price the slope rises steeply from a kink on: Newton's method meets it from there.
        let curvature = along(&found.hessian, direction);
        let newton = if curvature > R::zero() { step - at_point / curvature } else { step };
        if now <= 0.0 {
            (low, low_slope, lower) = (step, now, Some(found));
            // Along a direction without end.
            if high.is_none() && step.value() > LONG_STEP && dual.separates(&values(&found.y), b) {
                return Some(found);
            }
        } else {
            (high, high_slope) = (Some(step), now);
        }
        step = if let Some(high) = high {
            if (high - low).value() <= resolution {
                break;
            }
            // Every third time the middle: at a kink secant and tangent come nearer from one side only.
            let middle = trial % 3 == 0;
            if !middle && newton > low && newton < high {
                newton
            } else {
                let secant = high_slope > 0.0 && !middle;
                let share = if secant { low_slope / (low_slope - high_slope) } else { 0.5 };
                low + (high - low).times(share.clamp(0.1, 0.9))
            }
        } else {
            step.times(4.0)
        };
    }
    let found = lower?;
    Some(dual.at(&found.y, b, forces, shares))
}
