//! Force distribution over true cones by Clarabel's interior-point method: the answer where column generation
//! stalls.

use clarabel::solver::SupportedConeT;
use nalgebra::SVector;

use crate::force::interior_point::{ConicProgram, ConicSolution};
use crate::force::simplex::pricing::Objective;
use crate::grasp::contact::ContactForce;
use crate::wrench_set::contact_support::ContactSupport;

/// The interior-point solver's forces, moved into their cones.
pub(crate) struct LeastForces<const D: usize> {
    /// Forces within their cones.
    pub(crate) forces: Vec<ContactForce>,
    /// Their normalised normal forces.
    pub(crate) shares: Vec<f64>,
    /// What they balance: the target but for the solver's tolerance.
    pub(crate) wrench: SVector<f64, D>,
    /// The multiplier of the balance.
    pub(crate) dual: SVector<f64, D>,
}

/// The second-order cone program of force distribution in the first `rank` rows of `target`:
/// `min s + weight sum_i n_i`, or `min sum_i n_i`, subject to balance, `n_i <= s` and the friction cones, with
/// forces `f^U [n, mu y_1, mu y_2, gamma y_3]`, `|y| <= n`. Whatever it ends with is the caller's to certify.
/// The extreme forces of `all` contacts stand in the order of the grasp.
pub(crate) fn least_forces<const D: usize>(
    contacts: &[ContactSupport<D>],
    all: &[ContactForce],
    objective: Objective,
    rank: usize,
    target: &SVector<f64, D>,
) -> Option<LeastForces<D>> {
    let blocks: Vec<Vec<SVector<f64, D>>> = contacts.iter().map(variables).collect();
    let starts: Vec<usize> =
        blocks.iter().scan(0, |next, b| Some(std::mem::replace(next, *next + b.len()))).collect();
    let bounded = objective != Objective::Sum;
    let count = blocks.iter().map(Vec::len).sum::<usize>();
    let mut program = ConicProgram { bounds: target.as_slice()[..rank].to_vec(), ..ConicProgram::default() };
    for (&start, block) in starts.iter().zip(&blocks) {
        for (j, column) in block.iter().enumerate() {
            (0..rank).for_each(|k| program.constraints.push(k, start + j, column[k]));
        }
    }
    program.cost = vec![0.0; count + 1];
    program.cost[count] = 1.0;
    for (contact, (&start, block)) in contacts.iter().zip(starts.iter().zip(&blocks)) {
        let finite = contact.is_finite();
        let normals = if finite { start..start + block.len() } else { start..start + 1 };
        program.cost[normals.clone()].fill(if bounded { objective.weight() } else { 1.0 });
        if bounded {
            program.add_row(normals.clone().map(|j| (j, 1.0)).chain([(count, -1.0)]), 0.0);
        }
        if finite {
            normals.for_each(|j| program.add_row([(j, -1.0)], 0.0));
        }
    }
    program.add_row([(count, -1.0)], 0.0);
    let inequalities = program.bounds.len() - rank;
    program.cones = vec![SupportedConeT::ZeroConeT(rank), SupportedConeT::NonnegativeConeT(inequalities)];
    for (contact, (&start, block)) in contacts.iter().zip(starts.iter().zip(&blocks)) {
        if !contact.is_finite() {
            (start..start + block.len()).for_each(|j| program.add_row([(j, -1.0)], 0.0));
            program.cones.push(SupportedConeT::SecondOrderConeT(block.len()));
        }
    }
    let ConicSolution { x, z, .. } = program.solve(1e-12, 100)?;
    let mut least = LeastForces {
        forces: Vec::with_capacity(contacts.len()),
        shares: Vec::with_capacity(contacts.len()),
        wrench: SVector::zeros(),
        dual: SVector::from_fn(|k, _| if k < rank { -z[k] } else { 0.0 }),
    };
    for (contact, (&start, block)) in contacts.iter().zip(starts.iter().zip(&blocks)) {
        let mut y = x[start..start + block.len()].to_vec();
        let force = within(contact, all, &mut y);
        least.wrench += block.iter().zip(&y).map(|(column, y)| column * *y).sum::<SVector<f64, D>>();
        let finite = contact.is_finite();
        least.shares.push(if finite { y.iter().sum() } else { y[0] });
        least.forces.push(force);
    }
    Some(least)
}

/// The wrench of each variable of a contact: coefficients of extreme forces, or `n` and `y` of a cone.
fn variables<const D: usize>(contact: &ContactSupport<D>) -> Vec<SVector<f64, D>> {
    match contact {
        ContactSupport::Finite { .. } => contact.wrenches().collect(),
        ContactSupport::Cone { map, mu, gamma, .. } => {
            let shares = [1.0, *mu, *mu, *gamma];
            let count = if *gamma > 0.0 { 4 } else { 3 };
            (0..count).map(|k| map.column(k) * shares[k]).collect()
        }
    }
}

/// Moves a contact's variables into its cone and returns the force.
fn within<const D: usize>(contact: &ContactSupport<D>, all: &[ContactForce], y: &mut [f64]) -> ContactForce {
    match contact {
        ContactSupport::Finite { .. } => {
            for level in y.iter_mut() {
                *level = level.max(0.0);
            }
            all[contact.range()].iter().zip(y).map(|(force, level)| force * *level).sum()
        }
        ContactSupport::Cone { limit, mu, gamma, .. } => {
            y[0] = y[0].max(0.0);
            let load = y[1..].iter().map(|x| x * x).sum::<f64>().sqrt();
            if load > y[0] {
                let share = y[0] / load;
                for x in &mut y[1..] {
                    *x *= share;
                }
            }
            let torsion = y.get(3).copied().unwrap_or(0.0);
            ContactForce::new(y[0], mu * y[1], mu * y[2], gamma * torsion) * *limit
        }
    }
}
