//! Force distribution over true friction cones.
//!
//! Newton's method on the optimality conditions starts from the last answer. Where that is far away or fails, column
//! generation starts from nothing: its master program is the simplex over the columns generated so far, and the oracle's
//! closed form prices the next. Newton's method takes over from a coarse answer. Where it fails, column generation goes
//! on to its tolerance; its forces are nonnegative combinations of forces in the cones, and so in the cones themselves.
//! Nothing but Newton's method remembers earlier wrenches, and its answers do not depend on where it started.

use std::sync::Arc;

use nalgebra::SVector;

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, ContactForces, Requirements, loosened};
use crate::force::double_double::DoubleDoubleProgram;
use crate::force::equilibration::{Equilibration, Reachable};
use crate::force::simplex::columns::{ImplicitColumns, equilibrated_contacts};
use crate::force::simplex::pricing::{Objective, UNUSED};
use crate::force::simplex::primal::{Outcome, RightHandSide, Simplex};
use crate::force::true_cones::choice::Choice;
use crate::force::true_cones::contact_status::StandardCone;
use crate::force::true_cones::interior_point_socp::least_forces;
use crate::force::true_cones::newton::{FEW_CHANGES, MANY_CHANGES, NewtonWorkspace};
use crate::force::true_cones::optimal_point::ConeConditions;
use crate::force::true_cones::start::classify;
use crate::grasp::contact::ContactForce;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::NEWTON_GAP;

/// Relative gaps of column generation at which Newton's method tries to take over; the last try is at the tolerance.
const START_GAPS: [f64; 3] = [1e-1, 1e-2, 1e-4];

/// Weights of the multipliers beside the forces where both nearly vanish: at the last try, one after another.
const MULTIPLIER_WEIGHTS: [f64; 6] = [1.0, 30.0, 1.0 / 30.0, 1e3, 1e-3, 1e-5];

/// The program of a grasp with true friction cones; it does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct ConeProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: ImplicitColumns<D>,
    /// The same, for answers from which Newton's method starts.
    coarse: [ImplicitColumns<D>; 3],
    /// The extreme forces of the grasp.
    extreme_forces: Arc<Vec<ContactForce>>,
    /// The conditions of Newton's method; `None` where a contact has listed extreme forces.
    conditions: Option<ConeConditions<D>>,
    maps: Vec<ContactMap<D>>,
    tolerance: f64,
    precise: DoubleDoubleProgram<D>,
}

/// Its buffers, and what it remembers of earlier wrenches.
#[derive(Debug, Clone)]
pub(crate) struct ConeWorkspace<const D: usize> {
    simplex: Simplex<D>,
    newton: NewtonWorkspace<D>,
}

impl<const D: usize> ConeWorkspace<D> {
    pub(crate) fn forget(&mut self) {
        self.newton.restart();
    }
}

impl<const D: usize> ConeProgram<D> {
    pub(crate) fn new(grasp: &Grasp<D>, objective: Objective, tolerance: f64) -> Self {
        let equilibration = Equilibration::new(grasp, &spanning_wrenches(grasp));
        let columns = ImplicitColumns::new(objective, equilibrated_contacts(grasp, &equilibration));
        let precise = DoubleDoubleProgram::new(grasp, equilibration.units(), objective, &[], tolerance);
        let coarse = START_GAPS.map(|gap| columns.with_tolerance(gap.max(tolerance)));
        let cones = (0..grasp.num_contacts())
            .map(|i| StandardCone::new(grasp, i, |wrench| equilibration.wrench(wrench)))
            .collect();
        let conditions = Option::map(cones, |cones| ConeConditions::new(cones, objective));
        let (extreme_forces, maps) = (Arc::clone(grasp.shared_forces()), grasp.maps().to_vec());
        let columns = columns.with_tolerance(tolerance);
        Self { equilibration, columns, coarse, extreme_forces, conditions, maps, tolerance, precise }
    }

    pub(crate) fn workspace(&self) -> ConeWorkspace<D> {
        let contacts = self.maps.len();
        ConeWorkspace { simplex: Simplex::new(contacts), newton: NewtonWorkspace::new(contacts) }
    }

    /// Solves for `b = -w_ext` and writes the forces.
    pub(crate) fn solve(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        forces.unique = false;
        if let Some(answer) = self.solve_warm(workspace, b, forces) {
            return Ok(answer);
        }
        let answer = self.solve_in_doubles(workspace, b, forces);
        if !self.precise.must_decide(&answer, b) {
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
                let better = self.certify(&z, b, forces, simplex.pivots, self.tolerance).or(Err(error))?;
                Ok(Certificate { fell_back: true, ..better })
            }
            Err(error) => Err(error),
        }
    }

    /// Column generation from nothing, with Newton's method from each of its answers.
    fn solve_in_doubles(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let ConeWorkspace { simplex, newton } = workspace;
        simplex.pivots = 0;
        newton.restart();
        let Reachable { target, scale } = self.equilibration.reachable(b)?;
        let mut outcome = Outcome::Stalled;
        for (attempt, columns) in self.coarse.iter().chain([&self.columns]).enumerate() {
            let spent = simplex.pivots;
            outcome = if outcome == Outcome::Optimal {
                simplex.optimise(columns, target.rank)
            } else {
                let outcome = simplex.cold(columns, &target);
                simplex.pivots += spent;
                outcome
            };
            match outcome {
                Outcome::Infeasible(z) => return Err(self.equilibration.infeasible(&z)),
                Outcome::Optimal => {}
                Outcome::Stalled => continue,
            }
            forces.clear();
            self.add_up(simplex, 1.0, forces);
            let Some(conditions) = &self.conditions else { continue };
            let z = simplex.multipliers[0];
            let z = z / self.columns.reach(&z).max(f64::MIN_POSITIVE);
            let weights =
                if attempt == START_GAPS.len() { &MULTIPLIER_WEIGHTS[..] } else { &MULTIPLIER_WEIGHTS[..1] };
            for (k, weight) in weights.iter().enumerate() {
                newton.restart();
                classify(conditions, &mut newton.point, z, &forces.forces, *weight);
                let last = k + 1 == MULTIPLIER_WEIGHTS.len();
                if let Some(choice) = newton.solve(conditions, &target.wrench, MANY_CHANGES)
                    && (last || choice != Choice::Open)
                    && let Some(answer) = self.accept(newton, choice, b, scale, forces, simplex.pivots)
                {
                    return Ok(answer);
                }
                forces.clear();
                self.add_up(simplex, 1.0, forces);
            }
        }
        newton.restart();
        forces.clear();
        self.add_up(simplex, scale, forces);
        self.certify(&simplex.multipliers[0], b, forces, simplex.pivots, self.tolerance)
    }

    /// Newton's method from the last answer.
    fn solve_warm(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Option<Certificate<D>> {
        let newton = &mut workspace.newton;
        let conditions = self.conditions.as_ref().filter(|_| newton.known)?;
        let Reachable { target, scale } = self.equilibration.reachable(b).ok()?;
        if !newton.is_near(&target.wrench) {
            return None;
        }
        // Forces that no level chooses come from nothing, so that they depend on the wrench alone.
        let choice = newton.solve(conditions, &target.wrench, FEW_CHANGES).filter(|c| *c != Choice::Open)?;
        self.accept(newton, choice, b, scale, forces, 0)
    }

    /// Writes the forces of Newton's method, if their certificate holds.
    fn accept(
        &self,
        newton: &mut NewtonWorkspace<D>,
        choice: Choice,
        b: &Wrench<D>,
        scale: f64,
        forces: &mut ContactForces,
        pivots: usize,
    ) -> Option<Certificate<D>> {
        let conditions = self.conditions.as_ref()?;
        for (i, cone) in conditions.cones.iter().enumerate() {
            let x = newton.point.force(i);
            forces.forces[i] = cone.force(&(x * scale));
            forces.shares[i] = x[0] * scale;
        }
        let answer = self.certify(&newton.point.z, b, forces, pivots, self.tolerance.min(NEWTON_GAP)).ok();
        newton.known &= answer.is_some();
        forces.unique = answer.is_some() && choice == Choice::Unique;
        answer
    }

    /// What the forces are worth beside the bound that `z` proves once it is scaled to reach one.
    fn certify(
        &self,
        z: &SVector<f64, D>,
        b: &Wrench<D>,
        forces: &ContactForces,
        pivots: usize,
        tolerance: f64,
    ) -> Result<Certificate<D>> {
        let z = z / self.columns.reach(z).max(f64::MIN_POSITIVE);
        let dual = self.equilibration.dual(&z);
        let required = Requirements {
            b,
            maps: &self.maps,
            units: self.equilibration.units(),
            least: &[],
            held: 0.0,
            objective: self.columns.objective,
            tolerance: loosened(tolerance, z.lp_norm(1) / self.columns.objective.unit()),
        };
        forces.certify(&required, (dual, dual.dot(b)), "column generation", pivots)
    }

    /// Asks the interior-point solver, and returns its multiplier. What its forces leave unbalanced is balanced by
    /// forces of the simplex, so that the sum lies in the cones exactly.
    fn fall_back(
        &self,
        simplex: &mut Simplex<D>,
        target: &RightHandSide<D>,
        scale: f64,
        forces: &mut ContactForces,
    ) -> Option<SVector<f64, D>> {
        let ImplicitColumns { objective, contacts, .. } = &self.columns;
        let least = least_forces(contacts, &self.extreme_forces, *objective, target.rank, &target.wrench)?;
        let spent = simplex.pivots;
        let rest = target.wrench - least.wrench;
        let size = rest.amax();
        forces.clear();
        for (i, (force, share)) in least.forces.iter().zip(&least.shares).enumerate() {
            forces.forces[i] = force * scale;
            forces.shares[i] = share * scale;
        }
        if size > 0.0 {
            let rest = RightHandSide { wrench: rest / size, ..*target };
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
            for (i, (contact, edge)) in self.columns.contacts.iter().zip(simplex.basis.edges(row)).enumerate()
            {
                if *edge != UNUSED {
                    forces.forces[i] += contact.force(&z, *edge as usize, &self.extreme_forces) * level;
                    forces.shares[i] += level;
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

    /// Hard and soft fingers around a ball; one may be linearised.
    fn grasp(torsion: f64, mixed: bool, turn: f64) -> Grasp<6> {
        let contacts: Vec<Contact> = (0..5_u8)
            .map(|i| {
                let (s, c) = (3.0 * turn * f64::from(i)).sin_cos();
                let outward = Vector3::new(c, s, 0.4 * f64::from(i) - 0.8).normalize();
                let contact = Contact::new(outward, -outward).friction(0.6).torsion(torsion);
                if i == 0 && mixed { contact.edges(8) } else { contact.cone() }
            })
            .collect();
        Grasp::new(&contacts).unwrap()
    }

    #[test]
    fn the_interior_point_solver_gives_what_column_generation_gives() {
        for (case, (torsion, objective)) in (0..20)
            .flat_map(|_| [0.0, 0.2])
            .flat_map(|torsion| {
                [Objective::Sum, Objective::MaxThenSum, Objective::Weighted(0.1)].map(|o| (torsion, o))
            })
            .enumerate()
        {
            // Every other grasp has true cones alone, so that Newton's method takes part.
            let grasp = grasp(torsion, case % 2 == 0, 0.8 + 0.01 * case as f64);
            let program = ConeProgram::new(&grasp, objective, 1e-8);
            let mut workspace = program.workspace();
            for k in 0..12 {
                let b = Wrench::<6>::from_fn(|row, _| f64::sin(f64::from(row as u8 * 7 + k) + 0.3));
                let mut least = ContactForces::new(5);
                let expected = match program.solve(&mut workspace, &b, &mut least) {
                    Err(Error::InfeasibleWrench { .. }) => continue,
                    expected => expected.unwrap(),
                };
                let Reachable { target, scale } = program.equilibration.reachable(&b).unwrap();
                let z = program.fall_back(&mut workspace.simplex, &target, scale, &mut least).unwrap();
                let found = program.certify(&z, &b, &least, 0, 2e-7).unwrap();
                assert!((found.sigma - expected.sigma).abs() <= 2e-7 * expected.sigma);
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
