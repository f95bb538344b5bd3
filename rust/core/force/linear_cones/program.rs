//! Force distribution over finitely many extreme forces: from a wrench to the critical region it lies in.
//!
//! A wrench is looked up in the regions of the last answers; failing that, the dual simplex continues from the
//! last basis for a few pivots; failing that, the primal simplex starts afresh. Whatever way leads to the
//! multipliers, the region is then read off the face they describe, so the forces do not depend on it.

use nalgebra::SVector;

use crate::error::{Error, Result, Unmet};
use crate::force::certificate::Found;
use crate::force::equilibration::Equilibration;
use crate::force::linear_cones::critical_region::Region;
use crate::force::linear_cones::critical_region_builder::{Page, RegionReader};
use crate::force::linear_cones::enumerated::Enumeration;
use crate::force::precise::Precise;
use crate::force::precise::choice::MAX_UNKNOWNS;
use crate::force::simplex::basis::Basis;
use crate::force::simplex::pricing::{ImplicitColumns, Objective, Pricing, UNUSED};
use crate::force::simplex::primal::{Outcome, Simplex, TIE, Target};
use crate::force::solution::{DistributionOptions, Method};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;

/// Regions remembered for wrenches that jump back.
const REMEMBERED: usize = 16;

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 2;

/// A gap that rounding alone does not leave: the face was told from multipliers that are off.
const DOUBTFUL_GAP: f64 = 1e-11;

/// How negative a normalised force may be, relative to the objective, before it is another region's.
const INSIDE: f64 = 1e-11;

/// What does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct LinearProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: ImplicitColumns<D>,
    enumeration: Option<Enumeration<D>>,
    /// The points kept by the reduction of section 4.2.
    pub(crate) reduced: Option<Vec<u32>>,
    reader: RegionReader<D>,
    precise: Precise<D>,
}

/// What does.
#[derive(Debug, Clone)]
pub(crate) struct LinearWorkspace<const D: usize> {
    simplex: Simplex<D>,
    page: Page<D>,
    active: Vec<u32>,
    remembered: Vec<Remembered<D>>,
    latest: usize,
    found: Found,
    /// Whether the reduced set gave the last answer that was not known already.
    pub(crate) confirmed: bool,
    clock: u64,
}

#[derive(Debug, Clone)]
struct Remembered<const D: usize> {
    region: Region<D>,
    basis: Basis<D>,
    used: u64,
}

impl<const D: usize> Remembered<D> {
    /// A region with this multiplier answers nothing, and a basis of artificial columns starts nothing.
    fn forget(&mut self) {
        self.region.dual = SVector::zeros();
        self.basis.artificial = [true; D];
        self.used = 0;
    }
}

impl<const D: usize> LinearWorkspace<D> {
    /// The region of the last wrench.
    pub(crate) fn latest(&self) -> &Region<D> {
        &self.remembered[self.latest].region
    }

    /// Drops the known regions, but not their memory.
    pub(crate) fn forget(&mut self) {
        for known in &mut self.remembered {
            known.forget();
        }
    }
}

impl<const D: usize> LinearProgram<D> {
    pub(crate) fn new(grasp: &Grasp<D>, objective: Objective, options: &DistributionOptions) -> Result<Self> {
        let wrenches = grasp.primitive_wrenches()?;
        let equilibration = Equilibration::new(grasp, wrenches);
        let mapped = wrenches.iter().map(|w| equilibration.wrench(w)).collect();
        let enumeration = match options.method {
            Method::Implicit => None,
            Method::Enumerated | Method::Reduced => {
                Some(Enumeration::new(grasp, objective, &equilibration, options.max_points)?)
            }
        };
        let reduced = match &enumeration {
            Some(enumeration) if options.method == Method::Reduced => {
                let targets = sample_targets(&equilibration, &options.samples)?;
                let mut simplex = Simplex::new(grasp.num_contacts());
                Some(enumeration.reduce(&mut simplex, &targets, equilibration.rank)?)
            }
            _ => None,
        };
        Ok(Self {
            columns: ImplicitColumns::new(objective, ImplicitColumns::<D>::ranges(grasp), mapped),
            equilibration,
            enumeration,
            reduced,
            reader: RegionReader::new(grasp, options.rtol),
            precise: Precise::new(grasp, objective, &[], options.rtol),
        })
    }

    pub(crate) fn objective(&self) -> Objective {
        self.columns.objective
    }

    /// A workspace that will not allocate while it solves by implicit columns, unless the third level has to choose
    /// forces.
    pub(crate) fn workspace(&self) -> LinearWorkspace<D> {
        let (contacts, edges) = (self.columns.contacts.len(), self.columns.wrenches.len());
        let unknown =
            Remembered { region: self.reader.blank(self.objective()), basis: Basis::new(contacts), used: 0 };
        LinearWorkspace {
            simplex: Simplex::new(contacts),
            page: Page::with_capacity(contacts, edges + D * contacts),
            active: Vec::new(),
            remembered: vec![unknown; REMEMBERED],
            latest: 0,
            found: Found::new(contacts),
            confirmed: true,
            clock: 0,
        }
    }

    /// Lets a fresh workspace start from the last basis of another one, whose grasp has the same contacts and edges at
    /// slightly other places.
    pub(crate) fn adopt(&self, workspace: &mut LinearWorkspace<D>, other: &LinearWorkspace<D>) {
        let known = &mut workspace.remembered[0];
        known.basis.copy_from(&other.remembered[other.latest].basis);
        for row in (0..D).filter(|&row| !known.basis.artificial[row]) {
            let used = known.basis.edges(row).iter().filter(|edge| **edge != UNUSED);
            let wrench: SVector<f64, D> = used.map(|edge| self.columns.wrenches[*edge as usize]).sum();
            known.basis.columns.set_column(row, &wrench);
        }
        if !known.basis.refactorise() {
            known.forget();
        }
    }

    /// Whether two programs number the same edges in the same way.
    pub(crate) fn matches(&self, other: &Self) -> bool {
        self.columns.contacts == other.columns.contacts && self.equilibration.rank == other.equilibration.rank
    }

    /// The region of `b = -w_ext`, and the pivots it took to find it. `b` is not zero.
    #[inline]
    pub(crate) fn locate<'a>(
        &self,
        workspace: &'a mut LinearWorkspace<D>,
        b: &Wrench<D>,
    ) -> Result<(&'a Region<D>, usize)> {
        let latest = workspace.latest;
        if workspace.remembered[latest].region.answers(b, INSIDE) {
            return Ok((&workspace.remembered[latest].region, 0));
        }
        self.locate_elsewhere(workspace, b)
    }

    fn locate_elsewhere<'a>(
        &self,
        workspace: &'a mut LinearWorkspace<D>,
        b: &Wrench<D>,
    ) -> Result<(&'a Region<D>, usize)> {
        workspace.clock += 1;
        let clock = workspace.clock;
        workspace.remembered[workspace.latest].used = clock - 1;
        let found = workspace.remembered.iter().position(|known| known.region.answers(b, INSIDE));
        let (slot, pivots) = if let Some(slot) = found {
            (slot, 0)
        } else {
            workspace.simplex.pivots = 0;
            let slot = match self.solve_in_doubles(workspace, b) {
                Err(Error::NotConverged { .. }) => self.decide(workspace, b)?,
                Err(Error::InfeasibleWrench { direction, .. })
                    if !self.precise.clearly_separated(&direction, b) =>
                {
                    self.decide(workspace, b)?
                }
                // What the third level could not tell, it tells from the objective alone.
                Ok(slot) if self.is_doubtful(&workspace.remembered[slot].region, b) => {
                    workspace.remembered[slot].used = clock;
                    match self.decide(workspace, b) {
                        Err(Error::Interrupted) => return Err(Error::Interrupted),
                        decided => decided.unwrap_or(slot),
                    }
                }
                solved => solved?,
            };
            (slot, workspace.simplex.pivots)
        };
        workspace.latest = slot;
        workspace.remembered[slot].used = clock;
        Ok((&workspace.remembered[slot].region, pivots))
    }

    /// Whether the law of a region follows rounding, so that 32 digits and the third level choose better forces.
    fn is_doubtful(&self, region: &Region<D>, b: &Wrench<D>) -> bool {
        self.columns.wrenches.len() <= MAX_UNKNOWNS
            && (region.basic || region.is_steep(b) || region.gap(b) > DOUBTFUL_GAP)
    }

    fn solve_in_doubles(&self, workspace: &mut LinearWorkspace<D>, b: &Wrench<D>) -> Result<usize> {
        let target = self.equilibration.reachable(b)?.target;
        let solved = self.solve(workspace, &target).and_then(|()| self.remember(workspace, b));
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
    fn decide(&self, workspace: &mut LinearWorkspace<D>, b: &Wrench<D>) -> Result<usize> {
        interrupt::check()?;
        let LinearWorkspace { simplex, remembered, found, .. } = workspace;
        let answer = self.precise.solve(b, found)?;
        simplex.pivots += answer.pivots;
        let slot = (0..REMEMBERED).min_by_key(|&k| remembered[k].used).unwrap_or(0);
        let known = &mut remembered[slot];
        known.forget();
        let components = self.reader.components();
        let rows = found.forces.iter().flat_map(|force| components.iter().map(|&row| force[row]));
        let units = self.equilibration.units();
        known.region.write_ray(b, rows, &found.normals, (answer.dual, answer.gap), units);
        known.region.fell_back = self.reduced.is_some();
        Ok(slot)
    }

    /// Leaves an optimal basis in the workspace's simplex.
    fn solve(&self, workspace: &mut LinearWorkspace<D>, target: &Target<D>) -> Result<()> {
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
        let tolerance = TIE.max(2e-15 * z[0].lp_norm(1));
        let column = self.columns.furthest(&z[0], 1.0, &mut simplex.entering);
        let tied = self.columns.tie_break(z, tolerance, &mut simplex.entering);
        column.wrench.dot(&z[0]) - column.costs[0] <= tolerance
            && tied.is_none_or(|tied| tied.wrench.dot(&z[1]) - tied.costs[1] <= tied_gain(&z[1]))
    }

    /// Writes the region of the simplex's answer for `b` over the one that was not used for the longest time.
    fn remember(&self, workspace: &mut LinearWorkspace<D>, b: &Wrench<D>) -> Result<usize> {
        let LinearWorkspace { simplex, page, remembered, confirmed, .. } = workspace;
        let slot = (0..REMEMBERED).min_by_key(|&k| remembered[k].used).unwrap_or(0);
        let known = &mut remembered[slot];
        known.basis.copy_from(&simplex.basis);
        known.region.fell_back = !*confirmed;
        let read = self.reader.read(&mut known.region, simplex, &self.columns, &self.equilibration, page, b);
        if read.is_err() {
            known.forget();
        }
        read.map(|()| slot)
    }
}

/// Tied columns that gain less than this are no improvement of the tie-break.
pub(crate) fn tied_gain<const R: usize>(z: &SVector<f64, R>) -> f64 {
    1e-9_f64.max(1e-12 * z.lp_norm(1))
}

/// The wrenches that choose the reduced set, as right-hand sides.
fn sample_targets<const D: usize>(
    equilibration: &Equilibration<D>,
    samples: &[Vec<f64>],
) -> Result<Vec<Target<D>>> {
    let target = |(row, sample): (usize, &Vec<f64>)| {
        if sample.len() != D {
            let reason = format!("{} components, expected {D}", sample.len());
            return Err(Error::InvalidInput { argument: "samples", row: Some(row), reason });
        }
        equilibration.reachable(&-Wrench::<D>::from_column_slice(sample)).map(|found| found.target).map_err(
            |error| match error {
                Error::InvalidInput { .. } => {
                    let reason = format!(
                        "{sample:?} has no direction, or lies outside 1e-140 to 1e140; check the units"
                    );
                    Error::InvalidInput { argument: "samples", row: Some(row), reason }
                }
                error => error,
            },
        )
    };
    samples.iter().enumerate().map(target).collect()
}
