//! Force distribution with a preload: no normal force is below its lower bound.
//!
//! The program is not homogeneous, so there are no critical regions to remember: each wrench is solved by the simplex
//! over the columns of [`PreloadColumns`], from the last basis where that is a few pivots away. It takes true
//! cones as well as listed extreme forces.

use std::sync::Arc;

use nalgebra::SVector;

use crate::error::{Error, Result, digits};
use crate::force::certificate::{Certificate, ContactForces, Requirements, loosened};
use crate::force::double_double::DoubleDoubleProgram;
use crate::force::equilibration::{Equilibration, held_force};
use crate::force::linear_cones::cone_interior::Interior;
use crate::force::linear_cones::optimal_face::OptimalFace;
use crate::force::preload::columns::{PreloadColumns, ROWS, Share};
use crate::force::preload::optimal_face::{Bounds, UsedEdge};
use crate::force::simplex::basis::Basis;
use crate::force::simplex::columns::equilibrated_contacts;
use crate::force::simplex::pricing::Objective;
use crate::force::simplex::primal::{Outcome, RightHandSide, Simplex};
use crate::force::solution::{DistributionOptions, Method, check_wrench};
use crate::force::true_cones::program::spanning_wrenches;
use crate::grasp::contact::ForceModel;
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::{OPTIMAL_COST, UNBALANCED_WRENCH};

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 8;

/// The program of a grasp with lower bounds; it does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct PreloadProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: PreloadColumns<D>,
    /// The lower bounds, and the largest of them; it is positive.
    least: Vec<f64>,
    largest: f64,
    /// The largest force that they ask for, in units.
    held: f64,
    maps: Vec<ContactMap<D>>,
    tolerance: f64,
    precise: DoubleDoubleProgram<D>,
    /// The program without lower bounds, which tells whether they make a wrench infeasible.
    unbounded: DoubleDoubleProgram<D>,
}

/// Its buffers, and what it remembers of earlier wrenches.
#[derive(Debug, Clone)]
pub(crate) struct PreloadWorkspace {
    simplex: Simplex<ROWS>,
    last: Basis<ROWS>,
    used: Vec<UsedEdge>,
    face: OptimalFace,
}

impl PreloadWorkspace {
    pub(crate) fn forget(&mut self) {
        self.last.artificial = [true; ROWS];
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
    let bounds = match bounds[..] {
        [all] => vec![all; grasp.num_contacts()],
        _ => bounds.clone(),
    };
    if bounds.len() != grasp.num_contacts() {
        return refused(None, format!("{} bounds for {} contacts", bounds.len(), grasp.num_contacts()));
    }
    let each = options.min_normal.len() > 1;
    for (contact, (&bound, described)) in bounds.iter().zip(grasp.contacts()).enumerate() {
        if !(bound >= 0.0 && bound.is_finite()) {
            return refused(
                each.then_some(contact),
                format!("{} must be finite and not negative", digits(bound)),
            );
        }
        if bound > 1.0 {
            let (limit, least) = (described.max_normal_force, bound * described.max_normal_force);
            let reason = format!(
                "{bound} is a share of the contact's limit and must be at most 1: it asks for {least} N, and \
                 max_normal_force is {limit} N"
            );
            return refused(Some(contact), reason);
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
    Ok(Some(bounds))
}

impl<const D: usize> PreloadProgram<D> {
    /// `bounds` are not negative, and one is positive.
    pub(crate) fn new(grasp: &Grasp<D>, objective: Objective, bounds: &[f64], tolerance: f64) -> Self {
        let equilibration = Equilibration::new(grasp, &spanning_wrenches(grasp));
        let largest = bounds.iter().copied().fold(0.0, f64::max);
        let columns = PreloadColumns {
            objective,
            contacts: equilibrated_contacts(grasp, &equilibration),
            extreme_forces: Arc::clone(grasp.shared_forces()),
            least: bounds.iter().map(|bound| bound / largest).collect(),
            interiors: Interior::of_contacts(grasp),
            limits: grasp.contacts().iter().map(|contact| contact.max_normal_force).collect(),
            rank: equilibration.rank,
            threshold: objective.unit() * if grasp.is_finite() { OPTIMAL_COST } else { 0.5 * tolerance },
        };
        let (least, maps) = (bounds.to_vec(), grasp.maps().to_vec());
        let precise = DoubleDoubleProgram::new(grasp, equilibration.units(), objective, bounds, tolerance);
        let unbounded = DoubleDoubleProgram::new(grasp, equilibration.units(), objective, &[], tolerance);
        let held = held_force(grasp, equilibration.units(), bounds);
        Self { equilibration, columns, least, largest, held, maps, tolerance, precise, unbounded }
    }

    pub(crate) fn workspace(&self) -> PreloadWorkspace {
        let contacts = self.columns.contacts.len();
        PreloadWorkspace {
            simplex: Simplex::new(contacts + 1),
            last: Basis::new(contacts + 1),
            used: Vec::new(),
            face: OptimalFace::with_capacity(contacts, 0),
        }
    }

    /// Solves for `b = -w_ext`, which may be zero: fingers that hold press against each other.
    pub(crate) fn solve(
        &self,
        workspace: &mut PreloadWorkspace,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        check_wrench(b)?;
        let answer = self.solve_in_doubles(workspace, b, forces);
        let answer = if self.precise.must_decide(&answer, b) {
            interrupt::check()?;
            let spent = workspace.simplex.pivots;
            let decided = self.precise.solve(b, forces);
            decided.map(|answer| Certificate { pivots: answer.pivots + spent, ..answer })
        } else {
            answer
        };
        match answer {
            Err(Error::InfeasibleWrench { direction, .. }) => {
                let lower_bounds = b.amax() == 0.0 || self.unbounded.solve(b, forces).is_ok();
                Err(Error::InfeasibleWrench { direction, lower_bounds })
            }
            answer => answer,
        }
    }

    fn solve_in_doubles(
        &self,
        workspace: &mut PreloadWorkspace,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        workspace.simplex.pivots = 0;
        let (target, scale) = self.target(b)?;
        let PreloadWorkspace { simplex, last, used, face } = workspace;
        let outcome = simplex.solve_from(last, &self.columns, &target, DUAL_PIVOTS);
        let mut answer = self.finish(outcome, simplex, (used, face), b, scale, forces);
        if matches!(answer, Err(Error::NotConverged { .. })) {
            // Whatever led there, a start from nothing may end on better numbers.
            let outcome = simplex.cold(&self.columns, &target);
            answer = self.finish(outcome, simplex, (used, face), b, scale, forces);
        }
        match answer {
            Ok(_) => last.copy_from(&simplex.basis),
            Err(_) => last.artificial = [true; ROWS],
        }
        answer
    }

    /// Chooses among optimal forces, writes them, and certifies what it wrote.
    fn finish(
        &self,
        outcome: Outcome<ROWS>,
        simplex: &Simplex<ROWS>,
        (used, face): (&mut Vec<UsedEdge>, &mut OptimalFace),
        b: &Wrench<D>,
        scale: f64,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        if let Outcome::Infeasible(z) = outcome {
            return Err(self.equilibration.infeasible(&self.columns.wrench_part(&z)));
        }
        self.basic_solution(simplex, used);
        self.write(simplex, used, scale, forces);
        forces.unique = false;
        if outcome == Outcome::Optimal && self.columns.is_finite() {
            let (most, _) = forces.totals();
            let bounds = Bounds { least: self.largest / scale, most: most / scale };
            if let Some(unique) = self.columns.choose_least_norm(simplex, bounds, face, used) {
                self.write(simplex, used, scale, forces);
                forces.unique = unique;
            }
            // A third level that was interrupted has chosen nothing.
            interrupt::check()?;
        }
        let required = Requirements {
            b,
            maps: &self.maps,
            units: self.equilibration.units(),
            least: &self.least,
            held: self.held,
            objective: self.columns.objective,
            tolerance: loosened(
                self.tolerance,
                simplex.multipliers[0].lp_norm(1) / self.columns.objective.unit(),
            ),
        };
        let proof = self.lower_bound(&simplex.multipliers[0], b);
        forces.certify(&required, proof, "simplex with lower bounds", simplex.pivots)
    }

    /// The right-hand side: the wrench, and the convexity of vertices, scaled to a largest of one.
    fn target(&self, b: &Wrench<D>) -> Result<(RightHandSide<ROWS>, f64)> {
        let rank = self.equilibration.rank;
        let mut wrench = SVector::<f64, ROWS>::zeros();
        let (mut scale, mut tolerance) = (self.largest, SVector::repeat(UNBALANCED_WRENCH));
        if b.amax() > 0.0 {
            let reachable = self.equilibration.reachable(b)?;
            scale = scale.max(reachable.scale);
            let share = reachable.scale / scale;
            for k in 0..rank {
                wrench[k] = reachable.target.wrench[k] * share;
                tolerance[k] = tolerance[k].max(reachable.target.tolerance[k] * share);
            }
        }
        wrench[rank] = self.largest / scale;
        Ok((RightHandSide { wrench, rank: rank + 1, tolerance }, scale))
    }

    /// The multiplier in physical coordinates, and what it proves.
    fn lower_bound(&self, multiplier: &SVector<f64, ROWS>, b: &Wrench<D>) -> (Wrench<D>, f64) {
        let z = self.columns.wrench_part(multiplier);
        let values = (0..self.columns.contacts.len()).map(|i| self.columns.support(i, &z).0);
        let z = z / self.columns.objective.reach(values).max(1.0);
        let (_, vertices) = self.columns.values(&z);
        let dual = self.equilibration.dual(&z);
        // For the sum, `values` takes no cost off, and what the contacts hold with costs itself.
        let free = match self.columns.objective {
            Objective::Sum => self.columns.least.iter().sum(),
            _ => 1.0,
        };
        (dual, dual.dot(b) + self.largest * (free - vertices))
    }

    /// The levels of the basis, added up edge by edge; true cones are left to `write`.
    fn basic_solution(&self, simplex: &Simplex<ROWS>, used: &mut Vec<UsedEdge>) {
        used.clear();
        if !self.columns.is_finite() {
            return;
        }
        for row in (0..ROWS).filter(|&row| !simplex.basis.artificial[row]) {
            for share in self.columns.shares(simplex.basis.edges(row)) {
                let level = simplex.levels[row].max(0.0) * share.normal;
                let same = |u: &&mut UsedEdge| u.contact == share.contact && u.edge == share.edge;
                if let Some(known) = used.iter_mut().find(same) {
                    known.level += level;
                } else {
                    used.push(UsedEdge { contact: share.contact, edge: share.edge, level });
                }
            }
        }
    }

    fn write(&self, simplex: &Simplex<ROWS>, used: &[UsedEdge], scale: f64, forces: &mut ContactForces) {
        forces.clear();
        if self.columns.is_finite() {
            for u in used {
                let share = Share { contact: u.contact, edge: u.edge, normal: 1.0 };
                let force = self.columns.force(&share, &SVector::zeros());
                forces.forces[u.contact] += force * (u.level * scale);
                forces.shares[u.contact] += u.level * scale;
            }
            return;
        }
        for row in (0..ROWS).filter(|&row| simplex.levels[row] > 0.0 && !simplex.basis.artificial[row]) {
            let z = self.columns.wrench_part(&simplex.basis.directions.column(row).into());
            for share in self.columns.shares(simplex.basis.edges(row)) {
                let level = simplex.levels[row] * scale * share.normal;
                forces.forces[share.contact] += self.columns.force(&share, &z) * level;
                forces.shares[share.contact] += level;
            }
        }
    }
}
