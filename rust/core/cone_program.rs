//! Force distribution over true friction cones by column generation.
//!
//! The master program is the simplex over the columns generated so far, of which only the basis matters; the
//! oracle's closed form prices the next. A basis of the last wrench starts the next one: mostly a few dual
//! pivots away. Forces are nonnegative combinations of forces in the cones, and so in the cones themselves.

use nalgebra::SVector;

use crate::basis::Basis;
use crate::columns::{Objective, UNUSED};
use crate::cone_columns::ConeColumns;
use crate::contact::ContactForce;
use crate::equilibration::{Equilibration, Reachable};
use crate::error::{Error, Result};
use crate::grasp::{Grasp, Wrench};
use crate::law::objective_value;
use crate::preload::Found;
use crate::second_order::least_forces;
use crate::simplex::{Outcome, Simplex, Target};

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 12;

/// What does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct ConeProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: ConeColumns<D>,
    tolerance: f64,
}

/// What does.
#[derive(Debug, Clone)]
pub(crate) struct ConeWorkspace<const D: usize> {
    simplex: Simplex<D>,
    last: Basis<D>,
}

/// The multipliers and their certificate; the forces are written where the caller wants them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConeAnswer<const D: usize> {
    pub(crate) sigma: f64,
    pub(crate) dual: Wrench<D>,
    pub(crate) gap: f64,
    pub(crate) pivots: usize,
    /// Whether the interior-point solver had to give the answer.
    pub(crate) fell_back: bool,
}

impl<const D: usize> ConeWorkspace<D> {
    pub(crate) fn forget(&mut self) {
        self.last.artificial = [true; D];
    }
}

impl<const D: usize> ConeProgram<D> {
    pub(crate) fn new(grasp: &Grasp<D>, objective: Objective, tolerance: f64) -> Self {
        let equilibration = Equilibration::new(grasp, &spanning_wrenches(grasp));
        let columns = ConeColumns::new(grasp, objective, &equilibration, tolerance);
        Self { equilibration, columns, tolerance }
    }

    pub(crate) fn objective(&self) -> Objective {
        self.columns.objective
    }

    pub(crate) fn workspace(&self) -> ConeWorkspace<D> {
        let contacts = self.columns.num_contacts();
        ConeWorkspace { simplex: Simplex::new(contacts), last: Basis::new(contacts) }
    }

    /// Solves for `b = -w_ext` and adds up the forces of the basic columns (Eq. 31) in `found`.
    pub(crate) fn solve(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        found: &mut Found,
    ) -> Result<ConeAnswer<D>> {
        let Reachable { target, scale } = self.equilibration.reachable(b)?;
        let ConeWorkspace { simplex, last } = workspace;
        simplex.restart(last);
        let mut outcome = simplex.warm(&self.columns, &target, DUAL_PIVOTS).unwrap_or(Outcome::Stalled);
        if outcome != Outcome::Optimal {
            let spent = simplex.pivots;
            outcome = simplex.cold(&self.columns, &target);
            simplex.pivots += spent;
        }
        if let Outcome::Infeasible(z) = outcome {
            return Err(self.equilibration.infeasible(&z));
        }
        let z = &simplex.multipliers[0];
        let weight = self.columns.objective.weight();
        let reach = self.columns.value(z, weight).max(if weight > 0.0 { 1.0 } else { 0.0 });
        let upper = simplex.basis.costs[0].dot(&simplex.levels);
        let lower = simplex.target.dot(z) / reach;
        let gap = ((upper - lower) / upper).abs();
        let tolerance = self.tolerance.max(32.0 * f64::EPSILON * z.lp_norm(1));
        let stalled = simplex.basis.artificial[..target.rank].contains(&true);
        if stalled || simplex.falls_short() || gap.is_nan() || gap > tolerance {
            last.artificial = [true; D];
            let iterations = simplex.pivots;
            let better = self.fall_back(simplex, &target, scale, found).filter(|a| a.gap <= tolerance);
            return better.ok_or(Error::NotConverged { solver: "column generation", iterations, gap });
        }
        last.copy_from(&simplex.basis);
        found.clear();
        self.add_up(simplex, scale, found);
        let dual = self.equilibration.dual(z) / reach;
        Ok(ConeAnswer { sigma: upper * scale, dual, gap, pivots: simplex.pivots, fell_back: false })
    }

    /// Asks the interior-point solver. What its forces leave unbalanced is balanced by forces of the simplex, so
    /// that the sum lies in the cones exactly; its multiplier, scaled to reach one, proves the bound.
    fn fall_back(
        &self,
        simplex: &mut Simplex<D>,
        target: &Target<D>,
        scale: f64,
        found: &mut Found,
    ) -> Option<ConeAnswer<D>> {
        let ConeColumns { objective, contacts, .. } = &self.columns;
        let least = least_forces(contacts, *objective, target.rank, &target.wrench)?;
        let spent = simplex.pivots;
        let rest = target.wrench - least.wrench;
        let size = rest.amax();
        found.clear();
        for (i, (force, normal)) in least.forces.iter().zip(&least.normals).enumerate() {
            found.forces[i] = force * scale;
            found.normals[i] = normal * scale;
        }
        let mut upper = {
            let largest = least.normals.iter().copied().fold(0.0, f64::max);
            objective_value(*objective, largest, least.normals.iter().sum())
        };
        if size > 0.0 {
            let rest = Target { wrench: rest / size, rank: target.rank, tolerance: target.tolerance };
            let outcome = simplex.cold(&self.columns, &rest);
            if matches!(outcome, Outcome::Infeasible(_))
                || simplex.basis.artificial[..rest.rank].contains(&true)
            {
                return None;
            }
            self.add_up(simplex, scale * size, found);
            upper += size * simplex.basis.costs[0].dot(&simplex.levels);
        }
        let weight = self.columns.objective.weight();
        let floor = if weight > 0.0 { 1.0 } else { f64::MIN_POSITIVE };
        let dual = least.dual / self.columns.value(&least.dual, weight).max(floor);
        let gap = ((upper - dual.dot(&target.wrench)) / upper).abs();
        let pivots = spent + simplex.pivots;
        Some(ConeAnswer {
            sigma: upper * scale,
            dual: self.equilibration.dual(&dual),
            gap,
            pivots,
            fell_back: true,
        })
    }

    fn add_up(&self, simplex: &Simplex<D>, scale: f64, found: &mut Found) {
        for row in (0..D).filter(|&row| simplex.levels[row] > 0.0 && !simplex.basis.artificial[row]) {
            let z: SVector<f64, D> = simplex.basis.directions.column(row).into();
            let level = simplex.levels[row] * scale;
            for (contact, edge) in simplex.basis.edges(row).iter().enumerate() {
                if *edge != UNUSED {
                    found.forces[contact] += self.columns.force(contact, &z) * level;
                    found.normals[contact] += level;
                }
            }
        }
    }
}

/// Wrenches that span what the grasp can exert: extreme forces, and the axes of the true cones.
pub(crate) fn spanning_wrenches<const D: usize>(grasp: &Grasp<D>) -> Vec<Wrench<D>> {
    let mut wrenches = grasp.finite_wrenches().to_vec();
    for (i, contact) in grasp.contacts().iter().enumerate().filter(|(i, _)| grasp.edges(*i).is_none()) {
        let (limit, mu, gamma) = (contact.max_normal_force, contact.friction, contact.torsion);
        let axes = [(1, mu), (1, -mu), (2, mu), (2, -mu), (3, gamma), (3, -gamma)];
        for (component, share) in axes.into_iter().filter(|(_, share)| *share != 0.0) {
            let mut force = ContactForce::new(1.0, 0.0, 0.0, 0.0);
            force[component] = share;
            wrenches.push(grasp.maps()[i] * force * limit);
        }
    }
    wrenches
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::contact::Contact;

    /// Hard and soft fingers around a ball, and one that is linearised.
    fn grasp(torsion: f64) -> Grasp<6> {
        let contacts: Vec<Contact> = (0..5_u8)
            .map(|i| {
                let (s, c) = (2.4 * f64::from(i)).sin_cos();
                let outward = Vector3::new(c, s, 0.4 * f64::from(i) - 0.8).normalize();
                let contact = Contact::new(outward, -outward).friction(0.6).torsion(torsion);
                if i == 0 { contact.edges(8) } else { contact.cone() }
            })
            .collect();
        Grasp::new(&contacts).unwrap()
    }

    #[test]
    fn the_interior_point_solver_gives_what_column_generation_gives() {
        for (torsion, objective) in [0.0, 0.2].into_iter().flat_map(|torsion| {
            [Objective::Sum, Objective::MaxThenSum, Objective::Weighted(0.1)].map(|o| (torsion, o))
        }) {
            let grasp = grasp(torsion);
            let program = ConeProgram::new(&grasp, objective, 1e-8);
            let mut workspace = program.workspace();
            for k in 0..6 {
                let b = Wrench::<6>::from_fn(|row, _| f64::sin(f64::from(row as u8 * 7 + k) + 0.3));
                let mut least = Found::new(5);
                let expected = program.solve(&mut workspace, &b, &mut least).unwrap();
                let Reachable { target, scale } = program.equilibration.reachable(&b).unwrap();
                let found = program.fall_back(&mut workspace.simplex, &target, scale, &mut least).unwrap();
                assert!((found.sigma - expected.sigma).abs() <= 1e-7 * expected.sigma);
                assert!(found.fell_back && found.gap <= 1e-8, "{:e}", found.gap);
                let balance: Wrench<6> = grasp.maps().iter().zip(&least.forces).map(|(map, f)| map * f).sum();
                assert!((balance - b).amax() <= 1e-12, "{:e}", (balance - b).amax());
                for (contact, f) in grasp.contacts().iter().zip(&least.forces) {
                    let twist = if torsion > 0.0 { f[3] / torsion } else { 0.0 };
                    let load = (f[1].hypot(f[2]) / contact.friction).hypot(twist);
                    assert!(load <= f[0] * (1.0 + 1e-12));
                }
            }
        }
    }
}
