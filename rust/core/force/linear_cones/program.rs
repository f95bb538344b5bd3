//! Force distribution over finitely many extreme forces (Eqs. 24 and 26): finds the critical region of a wrench.
//!
//! A wrench is looked up in the regions of the last answers; failing that, the dual simplex continues for a few pivots
//! from the basis that proves most of it; failing that, the primal simplex starts afresh. Whatever way leads to the
//! multipliers, the region is then built from the optimal face they describe, so the forces do not depend on it.

use nalgebra::SVector;

use crate::error::{Error, Result, Unmet};
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::double_double::DoubleDoubleProgram;
use crate::force::double_double::choice::MOST_EDGES;
use crate::force::equilibration::Equilibration;
use crate::force::linear_cones::critical_region::CriticalRegion;
use crate::force::linear_cones::critical_region_builder::CriticalRegionBuilder;
use crate::force::linear_cones::enumerated::Enumeration;
use crate::force::linear_cones::workspace::{LinearWorkspace, Remembered};
use crate::force::simplex::columns::{ImplicitColumns, equilibrated_contacts};
use crate::force::simplex::pricing::{Objective, Pricing, UNUSED, tied_cost, tied_gain};
use crate::force::simplex::primal::{Outcome, RightHandSide, Simplex};
use crate::force::solution::{DistributionOptions, Method};
use crate::grasp::contact::contact_force;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::NEGATIVE_IN_KNOWN_REGION;

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 2;

/// The program of a grasp with listed extreme forces; it does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct LinearProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: ImplicitColumns<D>,
    enumeration: Option<Enumeration<D>>,
    /// The points kept by the reduction of section 4.2.
    pub(crate) reduced: Option<Vec<u32>>,
    builder: CriticalRegionBuilder<D>,
    precise: DoubleDoubleProgram<D>,
}

impl<const D: usize> LinearProgram<D> {
    pub(crate) fn new(grasp: &Grasp<D>, objective: Objective, options: &DistributionOptions) -> Result<Self> {
        let wrenches = grasp.primitive_wrenches()?;
        let equilibration = Equilibration::new(grasp, wrenches);
        let enumeration = match options.method {
            Method::Implicit => None,
            Method::Enumerated | Method::Reduced => {
                Some(Enumeration::new(grasp, objective, &equilibration, options.max_points)?)
            }
        };
        let precise = DoubleDoubleProgram::new(grasp, equilibration.units(), objective, &[], options.rtol);
        let reduced = match &enumeration {
            Some(enumeration) if options.method == Method::Reduced => {
                let targets = sample_targets(&equilibration, &precise, &options.samples)?;
                let mut simplex = Simplex::new(grasp.num_contacts());
                Some(enumeration.reduce(&mut simplex, &targets, equilibration.rank)?)
            }
            _ => None,
        };
        Ok(Self {
            columns: ImplicitColumns::new(objective, equilibrated_contacts(grasp, &equilibration)),
            equilibration,
            enumeration,
            reduced,
            builder: CriticalRegionBuilder::new(grasp, options.rtol),
            precise,
        })
    }

    pub(crate) fn objective(&self) -> Objective {
        self.columns.objective
    }

    /// A workspace that allocates while it solves by implicit columns only where the third level has to choose forces, and
    /// for regions beyond the first few.
    pub(crate) fn workspace(&self) -> LinearWorkspace<D> {
        let (contacts, edges) = (self.columns.contacts.len(), self.columns.num_edges());
        LinearWorkspace::new(self.builder.blank(self.objective()), contacts, edges)
    }

    /// Lets a fresh workspace start from the last basis of another one, whose grasp has the same contacts and edges at
    /// slightly other places.
    pub(crate) fn adopt(&self, workspace: &mut LinearWorkspace<D>, other: &LinearWorkspace<D>) {
        let known = &mut workspace.remembered[0];
        known.basis.copy_from(&other.remembered[other.latest].basis);
        for row in (0..D).filter(|&row| !known.basis.artificial[row]) {
            let used = known.basis.edges(row).iter().enumerate().filter(|(_, edge)| **edge != UNUSED);
            let wrench: SVector<f64, D> = used.map(|(i, edge)| self.columns.wrench(i, *edge)).sum();
            known.basis.columns.set_column(row, &wrench);
        }
        if !known.basis.refactorise() {
            known.forget();
        }
    }

    /// Whether two programs number the same edges in the same way.
    pub(crate) fn matches(&self, other: &Self) -> bool {
        self.columns.ranges().eq(other.columns.ranges())
            && self.equilibration.rank == other.equilibration.rank
    }

    /// Writes the forces for `b = -w_ext`, which is not zero. `components` are those that exist.
    pub(crate) fn solve(
        &self,
        workspace: &mut LinearWorkspace<D>,
        b: &Wrench<D>,
        components: &[usize],
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let (region, pivots) = self.locate(workspace, b, forces)?;
        let mut rows = vec![0.0; forces.shares.len() * components.len()];
        region.write(b, &mut rows);
        for (force, row) in forces.forces.iter_mut().zip(rows.chunks(components.len())) {
            *force = contact_force(row, components);
        }
        region.shares.multiply(b, &mut forces.shares);
        forces.unique = region.unique;
        let (largest, sum) = region.totals(b);
        let (dual, gap) = region.proof(b);
        let sigma = self.objective().value(largest, sum);
        Ok(Certificate { sigma, dual, gap, pivots, fell_back: region.fell_back })
    }

    /// The region of `b = -w_ext`, and the pivots it took to find it. `b` is not zero.
    #[inline]
    pub(crate) fn locate<'a>(
        &self,
        workspace: &'a mut LinearWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<(&'a CriticalRegion<D>, usize)> {
        let latest = workspace.latest;
        if workspace.remembered[latest].region.answers(b, NEGATIVE_IN_KNOWN_REGION) {
            return Ok((&workspace.remembered[latest].region, 0));
        }
        self.locate_elsewhere(workspace, b, forces)
    }

    fn locate_elsewhere<'a>(
        &self,
        workspace: &'a mut LinearWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<(&'a CriticalRegion<D>, usize)> {
        workspace.clock += 1;
        let clock = workspace.clock;
        workspace.remembered[workspace.latest].used = clock - 1;
        let known = workspace.look_up(b);
        let (slot, pivots) = if let Some(slot) = known {
            (slot, 0)
        } else {
            workspace.simplex.pivots = 0;
            let slot = match self.solve_in_doubles(workspace, b) {
                unclear if self.precise.must_decide(&unclear, b) => self.decide(workspace, b, forces)?,
                // What the third level could not tell, it tells from the objective alone.
                Ok(slot) if self.needs_32_digits(&workspace.remembered[slot].region, b) => {
                    workspace.remembered[slot].used = clock;
                    let decided = self.decide(workspace, b, forces);
                    // Whether other wrenches are looked up in it must not depend on the order of wrenches.
                    let known = &mut workspace.remembered[slot];
                    match decided {
                        // Without an answer in 32 digits, the forces in doubles are certified.
                        Err(Error::NotConverged { .. }) => {
                            self.narrow(known, b);
                            slot
                        }
                        decided => {
                            known.forget();
                            decided?
                        }
                    }
                }
                solved => {
                    let slot = solved?;
                    let known = &mut workspace.remembered[slot];
                    if self.has_third_level_in_32_digits() {
                        // Wrenches that are doubtful here are so without a past, too.
                        known.region.tolerance = known.region.tolerance.min(known.region.rounded_gap);
                    }
                    if !self.builder.balances_all(&known.region) {
                        self.narrow(known, b);
                    }
                    slot
                }
            };
            (slot, workspace.simplex.pivots)
        };
        workspace.settle_on(slot);
        Ok((&workspace.remembered[slot].region, pivots))
    }

    fn has_third_level_in_32_digits(&self) -> bool {
        self.columns.num_edges() <= MOST_EDGES
    }

    /// Whether the forces of a region follow rounding, so that 32 digits and the third level choose better ones.
    fn needs_32_digits(&self, region: &CriticalRegion<D>, b: &Wrench<D>) -> bool {
        region.is_ill_conditioned()
            || self.has_third_level_in_32_digits() && (region.basic || region.gap(b) > region.rounded_gap)
    }

    /// Narrows a region to the ray of one wrench.
    fn narrow(&self, known: &mut Remembered<D>, b: &Wrench<D>) {
        let mut shares = vec![0.0; self.columns.contacts.len()];
        let mut rows = vec![0.0; shares.len() * self.builder.components().len()];
        known.region.write(b, &mut rows);
        known.region.shares.multiply(b, &mut shares);
        let proof = known.region.proof(b);
        known.region.write_ray(b, rows, &shares, proof, self.equilibration.units());
        known.basis.artificial = [true; D];
    }

    fn solve_in_doubles(&self, workspace: &mut LinearWorkspace<D>, b: &Wrench<D>) -> Result<usize> {
        let target = self.equilibration.reachable(b)?.target;
        let solved = self.find_basis(workspace, &target).and_then(|()| self.remember(workspace, b));
        if !matches!(solved, Err(Error::NotConverged { .. })) {
            return solved;
        }
        // Whatever led there, a start from nothing may end on better numbers.
        let spent = workspace.simplex.pivots;
        let outcome = workspace.simplex.cold(&self.columns, &target);
        workspace.simplex.pivots += spent;
        // Over the whole set, whatever the reduced one said.
        workspace.confirmed = self.reduced.is_none();
        self.optimal(outcome, &workspace.simplex)?;
        self.remember(workspace, b)
    }

    /// Solves in 32 digits, and remembers the ray of the wrench.
    fn decide(
        &self,
        workspace: &mut LinearWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<usize> {
        interrupt::check()?;
        let answer = self.precise.solve(b, forces)?;
        workspace.simplex.pivots += answer.pivots;
        let slot = workspace.place(|| self.builder.blank(self.objective()));
        let known = &mut workspace.remembered[slot];
        known.forget();
        let components = self.builder.components();
        let rows = forces.forces.iter().flat_map(|force| components.iter().map(|&row| force[row])).collect();
        let units = self.equilibration.units();
        known.region.write_ray(b, rows, &forces.shares, (answer.dual, answer.gap), units);
        known.region.fell_back = self.reduced.is_some();
        Ok(slot)
    }

    /// Leaves an optimal basis in the workspace's simplex.
    fn find_basis(&self, workspace: &mut LinearWorkspace<D>, target: &RightHandSide<D>) -> Result<()> {
        let LinearWorkspace { simplex, active, remembered, latest, .. } = workspace;
        let outcome = if let (Some(enumeration), Some(kept)) = (&self.enumeration, &self.reduced) {
            let outcome = enumeration.solve_reduced(simplex, target, kept);
            workspace.confirmed = outcome == Outcome::Optimal && self.confirms(simplex);
            if workspace.confirmed { outcome } else { simplex.cold(&self.columns, target) }
        } else if let Some(enumeration) = &self.enumeration {
            enumeration.solve(simplex, target, active)
        } else {
            simplex.solve_from(&remembered[*latest].basis, &self.columns, target, DUAL_PIVOTS)
        };
        self.optimal(outcome, simplex)
    }

    fn optimal(&self, outcome: Outcome<D>, simplex: &Simplex<D>) -> Result<()> {
        match outcome {
            Outcome::Optimal => Ok(()),
            Outcome::Infeasible(z) => Err(self.equilibration.infeasible(&z)),
            Outcome::Stalled => {
                let (solver, iterations) = ("simplex", simplex.pivots);
                Err(Error::NotConverged { solver, iterations, unmet: Unmet::Pivots })
            }
        }
    }

    /// Whether no point of the whole set improves the objective or its tie-break.
    fn confirms(&self, simplex: &mut Simplex<D>) -> bool {
        let z = &simplex.multipliers;
        let tolerance = tied_cost(&z[0]);
        let column = self.columns.furthest(&z[0], 1.0, &mut simplex.entering);
        let tied = self.columns.tie_break(z, tolerance, &mut simplex.entering);
        column.wrench.dot(&z[0]) - column.costs[0] <= tolerance
            && tied.is_none_or(|tied| tied.wrench.dot(&z[1]) - tied.costs[1] <= tied_gain(&z[1]))
    }

    /// Writes the region of the simplex's answer for `b`.
    fn remember(&self, workspace: &mut LinearWorkspace<D>, b: &Wrench<D>) -> Result<usize> {
        let slot = workspace.place(|| self.builder.blank(self.objective()));
        let LinearWorkspace { simplex, buffers, remembered, confirmed, .. } = workspace;
        let known = &mut remembered[slot];
        known.basis.copy_from(&simplex.basis);
        known.region.fell_back = !*confirmed;
        let read =
            self.builder.read(&mut known.region, simplex, &self.columns, &self.equilibration, buffers, b);
        if read.is_err() {
            known.forget();
        }
        read.map(|()| slot)
    }
}

/// The wrenches that choose the reduced set, as right-hand sides. Those that doubles cannot decide choose nothing.
fn sample_targets<const D: usize>(
    equilibration: &Equilibration<D>,
    precise: &DoubleDoubleProgram<D>,
    samples: &[Vec<f64>],
) -> Result<Vec<RightHandSide<D>>> {
    let target = |(row, sample): (usize, &Vec<f64>)| {
        let refused = |reason| Error::InvalidInput { argument: "samples", row: Some(row), reason };
        if sample.len() != D {
            return Some(Err(refused(format!("{} components, expected {D}", sample.len()))));
        }
        let b = -Wrench::<D>::from_column_slice(sample);
        match equilibration.reachable(&b) {
            Ok(reachable) => Some(Ok(reachable.target)),
            Err(Error::InvalidInput { .. }) => Some(Err(refused(format!(
                "{sample:?} has no direction, or lies outside 1e-140 to 1e140; check the units"
            )))),
            Err(Error::InfeasibleWrench { direction, .. }) if !precise.clearly_separated(&direction, &b) => {
                None
            }
            Err(error) => Some(Err(error)),
        }
    };
    samples.iter().enumerate().filter_map(target).collect()
}
