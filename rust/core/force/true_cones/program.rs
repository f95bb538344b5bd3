//! Force distribution over true friction cones by column generation.
//!
//! The master program is the simplex over the columns generated so far, of which only the basis matters; the
//! oracle's closed form prices the next. A basis of the last wrench starts the next one: mostly a few dual
//! pivots away. Forces are nonnegative combinations of forces in the cones, and so in the cones themselves.

use nalgebra::SVector;

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, ContactForces, Requirements, loosened};
use crate::force::double_double::DoubleDoubleProgram;
use crate::force::equilibration::{Equilibration, Reachable};
use crate::force::simplex::basis::Basis;
use crate::force::simplex::pricing::{Objective, UNUSED};
use crate::force::simplex::primal::{Outcome, Simplex, Target};
use crate::force::true_cones::columns::ConeColumns;
use crate::force::true_cones::interior_point_socp::least_forces;
use crate::grasp::contact::ContactForce;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::interrupt;

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 12;

/// The program of a grasp with true friction cones; it does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct ConeProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: ConeColumns<D>,
    maps: Vec<ContactMap<D>>,
    tolerance: f64,
    precise: DoubleDoubleProgram<D>,
}

/// Its buffers, and what it remembers of earlier wrenches.
#[derive(Debug, Clone)]
pub(crate) struct ConeWorkspace<const D: usize> {
    simplex: Simplex<D>,
    last: Basis<D>,
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
        let precise = DoubleDoubleProgram::new(grasp, objective, &[], tolerance);
        Self { equilibration, columns, maps: grasp.maps().to_vec(), tolerance, precise }
    }

    pub(crate) fn workspace(&self) -> ConeWorkspace<D> {
        let contacts = self.columns.num_contacts();
        ConeWorkspace { simplex: Simplex::new(contacts), last: Basis::new(contacts) }
    }

    /// Solves for `b = -w_ext` and adds up the forces of the basic columns (Eq. 31) in `forces`.
    pub(crate) fn solve(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let answer = self.solve_in_doubles(workspace, b, forces);
        let unclear = match &answer {
            Err(Error::NotConverged { .. }) => true,
            Err(Error::InfeasibleWrench { direction, .. }) => !self.precise.clearly_separated(direction, b),
            _ => false,
        };
        if !unclear {
            return answer;
        }
        interrupt::check()?;
        let spent = workspace.simplex.pivots;
        match self.precise.solve(b, forces) {
            Ok(answer) => Ok(Certificate { pivots: answer.pivots + spent, ..answer }),
            Err(error @ Error::NotConverged { .. }) => {
                let Ok(Reachable { target, scale }) = self.equilibration.reachable(b) else {
                    return Err(error);
                };
                let simplex = &mut workspace.simplex;
                let Some(z) = self.fall_back(simplex, &target, scale, forces) else {
                    return Err(error);
                };
                let better = self.certify(&z, b, forces, simplex.pivots).or(Err(error))?;
                Ok(Certificate { fell_back: true, ..better })
            }
            Err(error) => Err(error),
        }
    }

    fn solve_in_doubles(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let ConeWorkspace { simplex, last } = workspace;
        simplex.pivots = 0;
        let Reachable { target, scale } = self.equilibration.reachable(b)?;
        let outcome = simplex.solve_from(last, &self.columns, &target, DUAL_PIVOTS);
        if let Outcome::Infeasible(z) = outcome {
            return Err(self.equilibration.infeasible(&z));
        }
        forces.clear();
        self.add_up(simplex, scale, forces);
        let answer = self.certify(&simplex.multipliers[0], b, forces, simplex.pivots);
        match answer {
            Ok(_) => last.copy_from(&simplex.basis),
            Err(_) => last.artificial = [true; D],
        }
        answer
    }

    /// What the forces are worth beside the bound that `z` proves once it is scaled to reach one.
    fn certify(
        &self,
        z: &SVector<f64, D>,
        b: &Wrench<D>,
        forces: &ContactForces,
        pivots: usize,
    ) -> Result<Certificate<D>> {
        let z = z / self.columns.reach(z).max(f64::MIN_POSITIVE);
        let dual = self.equilibration.dual(&z);
        let required = Requirements {
            b,
            maps: &self.maps,
            units: self.equilibration.units(),
            least: &[],
            objective: self.columns.objective,
            tolerance: loosened(self.tolerance, z.lp_norm(1) / self.columns.objective.unit()),
        };
        forces.certify(&required, (dual, dual.dot(b)), "column generation", pivots)
    }

    /// Asks the interior-point solver, and returns its multiplier. What its forces leave unbalanced is balanced by
    /// forces of the simplex, so that the sum lies in the cones exactly.
    fn fall_back(
        &self,
        simplex: &mut Simplex<D>,
        target: &Target<D>,
        scale: f64,
        forces: &mut ContactForces,
    ) -> Option<SVector<f64, D>> {
        let ConeColumns { objective, contacts, .. } = &self.columns;
        let least = least_forces(contacts, *objective, target.rank, &target.wrench)?;
        let spent = simplex.pivots;
        let rest = target.wrench - least.wrench;
        let size = rest.amax();
        forces.clear();
        for (i, (force, share)) in least.forces.iter().zip(&least.shares).enumerate() {
            forces.forces[i] = force * scale;
            forces.shares[i] = share * scale;
        }
        if size > 0.0 {
            let rest = Target { wrench: rest / size, ..*target };
            simplex.cold(&self.columns, &rest);
            self.add_up(simplex, scale * size, forces);
        }
        simplex.pivots += spent;
        Some(least.dual)
    }

    fn add_up(&self, simplex: &Simplex<D>, scale: f64, forces: &mut ContactForces) {
        for row in (0..D).filter(|&row| simplex.levels[row] > 0.0 && !simplex.basis.artificial[row]) {
            let z: SVector<f64, D> = simplex.basis.directions.column(row).into();
            let level = simplex.levels[row] * scale;
            for (contact, edge) in simplex.basis.edges(row).iter().enumerate() {
                if *edge != UNUSED {
                    forces.forces[contact] += self.columns.force(contact, &z) * level;
                    forces.shares[contact] += level;
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
    use crate::grasp::contact::Contact;

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
                let mut least = ContactForces::new(5);
                let expected = program.solve(&mut workspace, &b, &mut least).unwrap();
                let Reachable { target, scale } = program.equilibration.reachable(&b).unwrap();
                let z = program.fall_back(&mut workspace.simplex, &target, scale, &mut least).unwrap();
                let found = program.certify(&z, &b, &least, 0).unwrap();
                assert!((found.sigma - expected.sigma).abs() <= 1e-7 * expected.sigma);
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
