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
use crate::simplex::{Outcome, Simplex};

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

    /// Solves for `b = -w_ext` and adds up the forces of the basic columns (Eq. 31) in `forces`.
    pub(crate) fn solve(
        &self,
        workspace: &mut ConeWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut [ContactForce],
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
        if stalled || gap.is_nan() || gap > tolerance {
            last.artificial = [true; D];
            let iterations = simplex.pivots;
            return Err(Error::NotConverged { solver: "column generation", iterations, gap });
        }
        last.copy_from(&simplex.basis);
        self.add_up(simplex, scale, forces);
        let dual = self.equilibration.dual(z) / reach;
        Ok(ConeAnswer { sigma: upper * scale, dual, gap, pivots: simplex.pivots, fell_back: false })
    }

    fn add_up(&self, simplex: &Simplex<D>, scale: f64, forces: &mut [ContactForce]) {
        forces.fill(ContactForce::zeros());
        for row in (0..D).filter(|&row| simplex.levels[row] > 0.0 && !simplex.basis.artificial[row]) {
            let z: SVector<f64, D> = simplex.basis.directions.column(row).into();
            let level = simplex.levels[row] * scale;
            for (contact, force) in forces.iter_mut().enumerate() {
                if simplex.basis.edges(row)[contact] != UNUSED {
                    *force += self.columns.force(contact, &z) * level;
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
