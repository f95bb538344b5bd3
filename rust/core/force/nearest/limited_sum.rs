//! The least sum of shares among forces that balance a wrench within the limits, where the least sum without them breaks
//! them.
//!
//! Proximal steps `min sum_i share_i + sum_i |f_i - f_k,i|^2 / (2 step f_i^U^2)` are least squares towards a reference of
//! smaller normal forces. Over pyramids finitely many of them end at the least sum; over true cones the gap says how near
//! the last one is. Steps become longer where short ones bring little. With the multiplier `z` of the balance the sum is at
//! least `b . z - sum_i max over bounded shares of share (max_h w_ih . z - 1)`.

use crate::force::certificate::ContactForces;
use crate::force::squares::dual::{Dual, DualContact};
use crate::force::squares::newton::minimise;
use crate::grasp::contact::ForceModel;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::{BALANCED_STEP, CLOSE_GAP, LOOSEST_GAP, PROVEN_SUM};

/// Lengths of the first and of the longest proximal step in shares, and what a step grows by.
pub(crate) const FIRST_STEP: f64 = 3.0;
const LONGEST_STEP: f64 = 1e5;
const LONGER: f64 = 4.0;

const MAX_SUM_STEPS: usize = 80;

/// Whether the share of every contact is its normal force over its limit; not so of general extreme forces.
pub(crate) fn is_linear_in_forces<const D: usize>(grasp: &Grasp<D>) -> bool {
    !grasp.contacts().iter().any(|contact| matches!(contact.forces, ForceModel::Extreme(_)))
}

/// Weights in which forces are shares.
pub(crate) fn weights_of_shares<const D: usize>(grasp: &Grasp<D>) -> Vec<f64> {
    grasp.contacts().iter().map(|contact| contact.max_normal_force.powi(-2) / FIRST_STEP).collect()
}

/// Lowers the sum of the shares of forces that balance `b` and belong to the sets of `dual`, whose weights and references
/// are overwritten. Returns the multiplier, the relative gap and Newton's steps; `None` where no step balances `b` with a
/// proven sum. Shares have to be linear in the forces.
pub(crate) fn lower_sum<const D: usize>(
    grasp: &Grasp<D>,
    dual: &mut Dual<D>,
    b: &Wrench<D>,
    forces: &mut ContactForces,
) -> Option<(Wrench<D>, f64, usize)> {
    let contacts = grasp.contacts();
    let mut length = FIRST_STEP;
    let target = dual.whitening.wrench(b);
    let mut kept = forces.clone();
    let mut y = Wrench::zeros();
    let (mut best, mut stalled, mut steps) = ((Wrench::zeros(), f64::INFINITY), 0, 0);
    for _ in 0..MAX_SUM_STEPS {
        if interrupt::stopped() {
            return None;
        }
        for ((contact, described), force) in dual.contacts.iter_mut().zip(contacts).zip(&forces.forces) {
            contact.reference = *force;
            contact.weight = described.max_normal_force.powi(-2) / length;
            contact.reference[0] -= length * described.max_normal_force;
        }
        let ContactForces { forces: f, shares, .. } = &mut *forces;
        let start = dual.at(&y, &target, f, shares);
        let (point, more) = minimise(dual, &target, start, f, shares);
        (y, steps) = (point.y, steps + more);
        let z = dual.physical(&y);
        let lost = |(contact, map): (&DualContact<D>, &ContactMap<D>)| {
            let above = contact.furthest(&map.tr_mul(&z)) * contact.unit - 1.0;
            let (low, high) = contact.bounds();
            above * if above > 0.0 { high } else { low } / contact.unit
        };
        let lower = b.dot(&z) - dual.contacts.iter().zip(grasp.maps()).map(lost).sum::<f64>();
        let (_, sum) = forces.totals();
        let gap = if sum > 0.0 { (sum - lower) / sum } else { 0.0 };
        // What is left unbalanced belongs to another wrench, and so does a bound above the sum.
        let balanced = point.gradient.norm() <= BALANCED_STEP * target.norm() && gap >= -BALANCED_STEP;
        let gap = gap.max(0.0);
        stalled = if balanced && gap < 0.9 * best.1 { 0 } else { stalled + 1 };
        if balanced && gap < best.1 {
            best = (z, gap);
            kept.clone_from(forces);
        }
        if (balanced && gap <= PROVEN_SUM)
            || (stalled >= 6 && (best.1 <= CLOSE_GAP || length >= LONGEST_STEP))
        {
            break;
        }
        if stalled > 0 {
            length = (length * LONGER).min(LONGEST_STEP);
        }
    }
    *forces = kept;
    (best.1 <= LOOSEST_GAP).then_some((best.0, best.1, steps))
}
