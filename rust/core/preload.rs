//! Force distribution with a preload: no contact presses with less than its lower bound.
//!
//! The program is not homogeneous, so there are no regions to remember: each wrench is solved by the simplex
//! over the columns of [`PreloadColumns`], from the last basis where that is a few pivots away. It takes true
//! cones as well as listed extreme forces.

use nalgebra::SVector;

use crate::basis::Basis;
use crate::columns::Objective;
use crate::cone_columns::ConeContact;
use crate::cone_program::{ConeAnswer, spanning_wrenches};
use crate::contact::{ContactForce, ForceModel};
use crate::distribution::{DistributionOptions, Method, check_wrench};
use crate::equilibration::Equilibration;
use crate::error::{Error, Result};
use crate::grasp::{Grasp, Wrench};
use crate::preload_columns::{PreloadColumns, ROWS};
use crate::preload_face::{Bounds, Used};
use crate::region::UNBALANCED;
use crate::simplex::{Outcome, Simplex, Target};

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 8;

/// What does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct PreloadProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: PreloadColumns<D>,
    /// The largest lower bound; positive.
    largest: f64,
    tolerance: f64,
}

/// What does.
#[derive(Debug, Clone)]
pub(crate) struct PreloadWorkspace {
    simplex: Simplex<ROWS>,
    last: Basis<ROWS>,
    used: Vec<Used>,
}

impl PreloadWorkspace {
    pub(crate) fn forget(&mut self) {
        self.last.artificial = [true; ROWS];
    }
}

/// Forces and normalised normal forces of an answer, written in place.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub(crate) forces: Vec<ContactForce>,
    pub(crate) normals: Vec<f64>,
    /// Whether the forces were the only optimal ones.
    pub(crate) unique: bool,
}

impl Found {
    pub(crate) fn new(contacts: usize) -> Self {
        Self { forces: vec![ContactForce::zeros(); contacts], normals: vec![0.0; contacts], unique: false }
    }

    pub(crate) fn clear(&mut self) {
        self.forces.fill(ContactForce::zeros());
        self.normals.fill(0.0);
    }

    pub(crate) fn totals(&self) -> (f64, f64) {
        self.normals.iter().fold((0.0, 0.0), |(largest, sum), n| (f64::max(largest, *n), sum + n))
    }
}

/// The lower bounds of `options`, checked; `None` where none is positive.
pub(crate) fn checked_bounds<const D: usize>(
    grasp: &Grasp<D>,
    options: &DistributionOptions,
) -> Result<Option<Vec<f64>>> {
    let bounds = &options.min_normal;
    let refused = |row, reason| Err(Error::InvalidInput { argument: "min_normal", row, reason });
    if bounds.is_empty() {
        return Ok(None);
    }
    if bounds.len() != grasp.num_contacts() {
        return refused(None, format!("{} bounds for {} contacts", bounds.len(), grasp.num_contacts()));
    }
    for (contact, (&bound, described)) in bounds.iter().zip(grasp.contacts()).enumerate() {
        if !(bound >= 0.0 && bound.is_finite()) {
            return refused(Some(contact), format!("{bound} must be finite and not negative"));
        }
        if bound > 0.0 && matches!(described.forces, ForceModel::Extreme(_)) {
            let reason = format!("{bound}: general extreme forces have no common normal force to bound");
            return refused(Some(contact), reason);
        }
    }
    if bounds.iter().all(|bound| *bound == 0.0) {
        return Ok(None);
    }
    if options.method != Method::Implicit {
        return refused(None, "lower bounds need the method \"implicit\"".into());
    }
    Ok(Some(bounds.clone()))
}

impl<const D: usize> PreloadProgram<D> {
    /// `bounds` are not negative, and one is positive.
    pub(crate) fn new(grasp: &Grasp<D>, objective: Objective, bounds: &[f64], tolerance: f64) -> Self {
        let equilibration = Equilibration::new(grasp, &spanning_wrenches(grasp));
        let largest = bounds.iter().copied().fold(0.0, f64::max);
        let contacts = (0..grasp.num_contacts()).map(|i| ConeContact::new(grasp, i, &equilibration));
        let columns = PreloadColumns {
            objective,
            contacts: contacts.collect(),
            least: bounds.iter().map(|bound| bound / largest).collect(),
            limits: grasp.contacts().iter().map(|contact| contact.max_normal_force).collect(),
            rank: equilibration.rank,
            threshold: if grasp.is_finite() { 1e-12 } else { 0.5 * tolerance },
        };
        Self { equilibration, columns, largest, tolerance }
    }

    pub(crate) fn objective(&self) -> Objective {
        self.columns.objective
    }

    pub(crate) fn workspace(&self) -> PreloadWorkspace {
        let slots = self.columns.contacts.len() + 1;
        PreloadWorkspace { simplex: Simplex::new(slots), last: Basis::new(slots), used: Vec::new() }
    }

    /// Solves for `b = -w_ext`, which may be zero: fingers that hold press against each other.
    pub(crate) fn solve(
        &self,
        workspace: &mut PreloadWorkspace,
        b: &Wrench<D>,
        found: &mut Found,
    ) -> Result<ConeAnswer<D>> {
        check_wrench(b)?;
        let (target, scale) = self.target(b)?;
        let PreloadWorkspace { simplex, last, used } = workspace;
        simplex.restart(last);
        let mut outcome = simplex.warm(&self.columns, &target, DUAL_PIVOTS).unwrap_or(Outcome::Stalled);
        if outcome != Outcome::Optimal {
            let spent = simplex.pivots;
            outcome = simplex.cold(&self.columns, &target);
            simplex.pivots += spent;
        }
        if let Outcome::Infeasible(z) = outcome {
            return Err(self.equilibration.infeasible(&self.columns.wrench_part(&z)));
        }
        let (dual, bound) = self.lower_bound(simplex, scale);
        self.basic_solution(simplex, used);
        let sigma = self.write(simplex, used, scale, found);
        let gap = ((sigma - bound) / sigma).abs();
        let z = &simplex.multipliers[0];
        let tolerance = self.tolerance.max(32.0 * f64::EPSILON * z.lp_norm(1));
        let stalled = simplex.basis.artificial[..target.rank].contains(&true)
            && simplex.levels.iter().zip(simplex.basis.artificial).any(|(x, a)| a && *x != 0.0);
        if stalled || simplex.falls_short() || gap.is_nan() || gap > tolerance {
            last.artificial = [true; ROWS];
            let iterations = simplex.pivots;
            return Err(Error::NotConverged { solver: "simplex with lower bounds", iterations, gap });
        }
        last.copy_from(&simplex.basis);
        found.unique = false;
        if self.columns.is_finite() {
            let (most, _) = found.totals();
            let bounds = Bounds { least: self.largest / scale, most: most / scale };
            if let Some(unique) = self.columns.settle(simplex, bounds, used) {
                self.write(simplex, used, scale, found);
                found.unique = unique;
            }
        }
        let sigma = self.value(found);
        Ok(ConeAnswer { sigma, dual, gap, pivots: simplex.pivots, fell_back: false })
    }

    /// The right-hand side: the wrench, and the convexity of holding columns, scaled to a largest of one.
    fn target(&self, b: &Wrench<D>) -> Result<(Target<ROWS>, f64)> {
        let rank = self.equilibration.rank;
        let mut wrench = SVector::<f64, ROWS>::zeros();
        let (mut scale, mut tolerance) = (self.largest, UNBALANCED);
        if b.amax() > 0.0 {
            let reachable = self.equilibration.reachable(b)?;
            scale = scale.max(reachable.scale);
            let share = reachable.scale / scale;
            for k in 0..rank {
                wrench[k] = reachable.target.wrench[k] * share;
            }
            tolerance = tolerance.max(reachable.target.tolerance * share);
        }
        wrench[rank] = self.largest / scale;
        Ok((Target { wrench, rank: rank + 1, tolerance }, scale))
    }

    /// The multiplier in physical coordinates, and what it proves.
    fn lower_bound(&self, simplex: &Simplex<ROWS>, scale: f64) -> (Wrench<D>, f64) {
        let z = self.columns.wrench_part(&simplex.multipliers[0]);
        let z = z / self.columns.values(&z).0.max(1.0);
        let (_, holding) = self.columns.values(&z);
        let along = self.columns.wrench_part(&simplex.target).dot(&z) * scale;
        // For the sum, `values` takes no cost off, and what the contacts hold with costs itself.
        let free = match self.columns.objective {
            Objective::Sum => self.columns.least.iter().sum(),
            _ => 1.0,
        };
        (self.equilibration.dual(&z), along + self.largest * (free - holding))
    }

    /// The levels of the basis, added up edge by edge; true cones are left to `write`.
    fn basic_solution(&self, simplex: &Simplex<ROWS>, used: &mut Vec<Used>) {
        used.clear();
        if !self.columns.is_finite() {
            return;
        }
        for row in (0..ROWS).filter(|&row| !simplex.basis.artificial[row]) {
            for share in self.columns.shares(simplex.basis.edges(row)) {
                let level = simplex.levels[row].max(0.0) * share.normal;
                let same = |u: &&mut Used| u.contact == share.contact && u.edge == share.edge;
                if let Some(known) = used.iter_mut().find(same) {
                    known.level += level;
                } else {
                    used.push(Used { contact: share.contact, edge: share.edge, level });
                }
            }
        }
    }

    /// Writes the forces; returns the objective.
    fn write(&self, simplex: &Simplex<ROWS>, used: &[Used], scale: f64, found: &mut Found) -> f64 {
        found.clear();
        if self.columns.is_finite() {
            for u in used {
                if let ConeContact::Finite { forces, .. } = &self.columns.contacts[u.contact] {
                    found.forces[u.contact] += forces[u.edge] * (u.level * scale);
                    found.normals[u.contact] += u.level * scale;
                }
            }
            return self.value(found);
        }
        for row in (0..ROWS).filter(|&row| simplex.levels[row] > 0.0 && !simplex.basis.artificial[row]) {
            let z = self.columns.wrench_part(&simplex.basis.directions.column(row).into());
            for share in self.columns.shares(simplex.basis.edges(row)) {
                let level = simplex.levels[row] * scale * share.normal;
                found.forces[share.contact] += self.columns.force(&share, &z) * level;
                found.normals[share.contact] += level;
            }
        }
        self.value(found)
    }

    fn value(&self, found: &Found) -> f64 {
        let (largest, sum) = found.totals();
        crate::law::objective_value(self.objective(), largest, sum)
    }
}
