//! The largest least weight of primitive wrenches that sum to zero (`FRoGGeR`).
//!
//! `l = max min_j alpha_j` subject to `sum_j alpha_j w_j = 0`, `sum_j alpha_j = 1`. With `s = sum_j w_j` of n wrenches its
//! dual is `min t` subject to `t + w_j . z >= 0` and `n t + s . z = 1`. Without `t` that is
//!
//! `n l = 1 - max s . z`  subject to  `(s - n w_j) . z <= 1`,
//!
//! the dual of the least sum `S` of `gamma >= 0` with `sum_j gamma_j (s - n w_j) = s`: force distribution over other columns
//! (Eq. 26). So `l = (1 - S) / n` of either sign, and `alpha_j = gamma_j + l`. As contacts move, `l` changes as
//! `-z . sum_j alpha_j w_j` does.

use std::ops::Range;

use crate::error::{Error, Result, Unmet};
use crate::force::equilibration::Equilibration;
use crate::force::simplex::columns::ImplicitColumns;
use crate::force::simplex::pricing::{Objective, UNUSED};
use crate::force::simplex::primal::{Outcome, Simplex};
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::surrogates::{SurrogateValue, determine_forces, with_gradient};
use crate::tolerances::SUPPORTED;
use crate::wrench_set::contact_support::ContactSupport;

/// A relative gap of the least weight above this is no answer.
const UNPROVEN_WEIGHT: f64 = 1e-9;

pub(crate) fn min_weight<const D: usize>(grasp: &Grasp<D>) -> Result<SurrogateValue> {
    let wrenches = grasp.primitive_wrenches()?;
    let extreme = grasp.extreme_forces()?;
    let count = wrenches.len() as f64;
    let sum: Wrench<D> = wrenches.iter().sum();
    let columns: Vec<Wrench<D>> = wrenches.iter().map(|wrench| sum - wrench * count).collect();
    let (mut weights, mut z, mut unique) = (vec![0.0; wrenches.len()], Wrench::zeros(), false);
    let size = wrenches.iter().map(Wrench::amax).fold(0.0, f64::max);
    if sum.amax() > f64::EPSILON * count * size {
        let equilibration = Equilibration::new(grasp, &columns);
        let reachable = equilibration.reachable(&sum)?;
        let contact = |range: Range<usize>| {
            let mapped = columns[range.clone()].iter().map(|column| equilibration.wrench(column));
            ContactSupport::finite(mapped, range.start)
        };
        let contacts = (0..grasp.num_contacts()).filter_map(|i| grasp.edges(i)).map(contact);
        let pricing = ImplicitColumns::new(Objective::Sum, contacts.collect());
        let mut simplex = Simplex::new(grasp.num_contacts());
        match simplex.cold(&pricing, &reachable.target) {
            Outcome::Optimal => {}
            Outcome::Infeasible(witness) => return Err(equilibration.infeasible(&witness)),
            Outcome::Stalled => {
                interrupt::check()?;
                return Err(unproven(simplex.pivots, Unmet::Pivots));
            }
        }
        for row in 0..equilibration.rank {
            let used = simplex.basis.edges(row).iter().find(|edge| **edge != UNUSED);
            if let Some(&edge) = used {
                weights[edge as usize] += simplex.levels[row].max(0.0) * reachable.scale;
            }
        }
        z = equilibration.dual(&simplex.multipliers[0]);
        let least = simplex.levels.rows_range(..equilibration.rank).min();
        // All levels positive: one multiplier.
        unique = equilibration.rank == D
            && least > SUPPORTED * simplex.levels.max()
            && determine_forces(grasp, |edge| columns[edge].dot(&z) >= 1.0 - SUPPORTED);
        let total: f64 = weights.iter().sum();
        let reach = columns.iter().map(|column| column.dot(&z)).fold(1.0, f64::max);
        let found = (total - sum.dot(&z) / reach).abs() / (1.0 + total);
        if found.is_nan() || found > UNPROVEN_WEIGHT {
            return Err(unproven(simplex.pivots, Unmet::Gap { found, allowed: UNPROVEN_WEIGHT }));
        }
    }
    let least = (1.0 - weights.iter().sum::<f64>()) / count;
    let mut forces = vec![ContactForce::zeros(); grasp.num_contacts()];
    for (i, force) in forces.iter_mut().enumerate() {
        for edge in grasp.edges(i).into_iter().flatten() {
            *force += extreme[edge] * (weights[edge] + least);
        }
    }
    Ok(with_gradient(grasp, least, (&-z, &forces), unique))
}

fn unproven(iterations: usize, unmet: Unmet) -> Error {
    Error::NotConverged { solver: "simplex", iterations, unmet }
}
