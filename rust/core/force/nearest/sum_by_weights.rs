//! The least sum of shares within the limits by weights of the sum beside the maximum, for contacts of any kind.
//!
//! `min sum subject to max <= 1` has the dual `max over w of (least of (max + w sum) - 1) / w`. Each weight is a program of
//! its own, whose answer lies within the limits or beyond. Two such answers determine the next weight: the one at which
//! they are worth the same. Where its answer is worth as much, their mixture at the limits is the least sum.

use crate::force::certificate::{Certificate, ContactForces};
use crate::force::share_program::{ShareProgram, ShareSolver};
use crate::force::solution::{DistributionOptions, Method};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::{AT_LIMIT, PROVEN_SUM};
use crate::wrench_set::Criterion;

const MAX_SUM_WEIGHTS: usize = 40;

/// Leaves the forces, and returns the multiplier, the relative gap and the pivots. `None` where no forces keep the limits.
pub(crate) fn least_sum_by_weights<const D: usize>(
    grasp: &Grasp<D>,
    options: &DistributionOptions,
    b: &Wrench<D>,
    forces: &mut ContactForces,
) -> Option<(Wrench<D>, f64, usize)> {
    let mut pivots = 0;
    let mut solve = |criterion, weight: f64| -> Option<(ContactForces, Certificate<D>)> {
        let options = DistributionOptions {
            weight,
            rtol: options.rtol.min(PROVEN_SUM),
            method: Method::Implicit,
            samples: Vec::new(),
            ..options.clone()
        };
        let program = ShareProgram::new(grasp, criterion, &options).ok()?;
        let mut found = ContactForces::new(grasp.num_contacts());
        let answer = ShareSolver::new(&program).solve(b, grasp.force_components(), &mut found).ok()?;
        pivots += answer.pivots;
        Some((found, answer))
    };
    let (mut beyond, answer) = solve(Criterion::Sum, 0.0)?;
    if beyond.totals().0 <= 1.0 + AT_LIMIT {
        *forces = beyond;
        return Some((answer.dual, answer.gap, pivots));
    }
    let (mut within, _) = solve(Criterion::Max, 0.0)?;
    if within.totals().0 > 1.0 + AT_LIMIT {
        return None;
    }
    let mut proven = (answer.dual, answer.sigma * (1.0 - answer.gap));
    let mixed = |within: &ContactForces, beyond: &ContactForces| {
        let ((low, _), (high, _)) = (within.totals(), beyond.totals());
        let part = ((1.0 - low) / (high - low)).clamp(0.0, 1.0);
        let mut mixture = within.clone();
        for (force, other) in mixture.forces.iter_mut().zip(&beyond.forces) {
            *force += (other - *force) * part;
        }
        for (share, other) in mixture.shares.iter_mut().zip(&beyond.shares) {
            *share += (other - *share) * part;
        }
        mixture
    };
    for _ in 0..MAX_SUM_WEIGHTS {
        let ((low, sum_within), (high, sum_beyond)) = (within.totals(), beyond.totals());
        let weight = (high - low) / (sum_within - sum_beyond);
        if !(weight > 0.0 && weight.is_finite()) || interrupt::stopped() {
            break;
        }
        let Some((found, answer)) = solve(Criterion::Max, weight) else { break };
        let bound = (answer.sigma * (1.0 - answer.gap) - low.max(1.0)) / weight;
        if bound > proven.1 {
            proven = (answer.dual / weight, bound);
        }
        let (largest, sum) = found.totals();
        let gain = low + weight * sum_within - largest - weight * sum;
        if largest <= 1.0 {
            within = found;
        } else {
            beyond = found;
        }
        if gain <= PROVEN_SUM * answer.sigma {
            break;
        }
    }
    *forces = mixed(&within, &beyond);
    let sum = forces.totals().1;
    Some((proven.0, ((sum - proven.1) / sum).max(0.0), pivots))
}
