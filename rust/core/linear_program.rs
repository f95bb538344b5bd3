//! Force distribution over finitely many extreme forces: from a wrench to the critical region it lies in.
//!
//! A wrench is looked up in the regions of the last answers; failing that, the dual simplex continues from the
//! last basis for a few pivots; failing that, the primal simplex starts afresh. Whatever way leads to the
//! multipliers, the region is then read off the face they describe, so the forces do not depend on it.

use nalgebra::SVector;

use crate::basis::Basis;
use crate::columns::{ImplicitColumns, Objective, Pricing, UNUSED};
use crate::contact::ContactForce;
use crate::distribution::{DistributionOptions, Method};
use crate::enumerated::Enumeration;
use crate::equilibration::Equilibration;
use crate::error::{Error, Result};
use crate::face::Face;
use crate::grasp::{Grasp, Wrench};
use crate::interior::Interior;
use crate::law::{self, Extremes};
use crate::least_squares::least_squares_law;
use crate::region::{Region, UNBALANCED};
use crate::simplex::{Outcome, Simplex, TIE, Target};

/// Regions remembered for wrenches that jump back.
const REMEMBERED: usize = 16;

/// Dual pivots before a cold start is the better bet.
const DUAL_PIVOTS: usize = 2;

/// How negative a normalised force may be, relative to the objective, before it is another region's.
const INSIDE: f64 = 1e-11;

/// The same of a law that was just made, where rounding of its coefficients counts, too.
const PUSHES: f64 = 1e-6;

/// What does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct LinearProgram<const D: usize> {
    equilibration: Equilibration<D>,
    columns: ImplicitColumns<D>,
    enumeration: Option<Enumeration<D>>,
    /// The points kept by the reduction of section 4.2.
    pub(crate) reduced: Option<Vec<u32>>,
    extreme_forces: Vec<ContactForce>,
    components: &'static [usize],
    interiors: Vec<Option<Interior>>,
    limits: Vec<f64>,
    tolerance: f64,
}

/// What does.
#[derive(Debug, Clone)]
pub(crate) struct LinearWorkspace<const D: usize> {
    simplex: Simplex<D>,
    face: Face,
    coefficients: Vec<SVector<f64, D>>,
    active: Vec<u32>,
    remembered: Vec<Remembered<D>>,
    latest: usize,
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
    /// A region with this multiplier contains nothing, and a basis of artificial columns starts nothing.
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
            extreme_forces: grasp.extreme_forces()?.to_vec(),
            components: grasp.force_components(),
            interiors: (0..grasp.num_contacts())
                .map(|i| Interior::new(grasp, i, grasp.finite_forces()))
                .collect(),
            limits: grasp.contacts().iter().map(|contact| contact.max_normal_force).collect(),
            tolerance: options.tolerance,
        })
    }

    pub(crate) fn objective(&self) -> Objective {
        self.columns.objective
    }

    /// A workspace that will not allocate while it solves, unless the third level has to choose forces.
    pub(crate) fn workspace(&self) -> LinearWorkspace<D> {
        let (contacts, edges) = (self.columns.contacts.len(), self.columns.wrenches.len());
        let unknown = Remembered {
            region: Region::with_capacity(contacts, edges, self.components.len()),
            basis: Basis::new(contacts),
            used: 0,
        };
        LinearWorkspace {
            simplex: Simplex::new(contacts),
            face: Face::with_capacity(contacts, edges + D * contacts),
            coefficients: Vec::with_capacity(edges),
            active: Vec::new(),
            remembered: vec![unknown; REMEMBERED],
            latest: 0,
            confirmed: true,
            clock: 0,
        }
    }

    /// A workspace that starts from the last basis of another one, whose grasp has the same contacts and edges
    /// at slightly other places.
    pub(crate) fn adopt(&self, other: &LinearWorkspace<D>) -> LinearWorkspace<D> {
        let mut workspace = self.workspace();
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
        workspace
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
        if workspace.remembered[latest].region.contains(b, INSIDE) {
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
        let found = workspace.remembered.iter().position(|known| known.region.contains(b, INSIDE));
        let (slot, pivots) = if let Some(slot) = found {
            (slot, 0)
        } else {
            let target = self.equilibration.reachable(b)?.target;
            self.solve(workspace, &target)?;
            let (slot, pivots) = (self.remember(workspace)?, workspace.simplex.pivots);
            let known = &mut workspace.remembered[slot];
            if !known.region.pushes(b, PUSHES) {
                known.forget();
                return Err(Error::NotConverged {
                    solver: "simplex",
                    iterations: pivots,
                    gap: f64::INFINITY,
                });
            }
            (slot, pivots)
        };
        workspace.latest = slot;
        workspace.remembered[slot].used = clock;
        Ok((&workspace.remembered[slot].region, pivots))
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
            simplex.restart(&remembered[*latest].basis);
            let mut outcome = simplex.warm(&self.columns, target, DUAL_PIVOTS).unwrap_or(Outcome::Stalled);
            if outcome != Outcome::Optimal {
                let spent = simplex.pivots;
                outcome = simplex.cold(&self.columns, target);
                simplex.pivots += spent;
            }
            outcome
        };
        match outcome {
            Outcome::Optimal => Ok(()),
            Outcome::Infeasible(z) => Err(self.equilibration.infeasible(&z)),
            Outcome::Stalled => {
                Err(Error::NotConverged { solver: "simplex", iterations: simplex.pivots, gap: f64::INFINITY })
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
            && tied.is_none_or(|tied| tied.wrench.dot(&z[1]) - tied.costs[1] <= 100.0 * tolerance)
    }

    /// Writes the region of the simplex's answer over the one that was not used for the longest time.
    fn remember(&self, workspace: &mut LinearWorkspace<D>) -> Result<usize> {
        let LinearWorkspace { simplex, face, coefficients, remembered, confirmed, .. } = workspace;
        let slot = (0..REMEMBERED).min_by_key(|&k| remembered[k].used).unwrap_or(0);
        let known = &mut remembered[slot];
        known.basis.copy_from(&simplex.basis);
        let region = &mut known.region;
        let mut mismatch = self.write_law(region, simplex, face, coefficients);
        if mismatch.is_nan() || mismatch > self.trusted(simplex) {
            // Updates pivot by pivot have worn the inverse out; a fresh one may do better.
            simplex.refactorise();
            simplex.refresh_multipliers();
            mismatch = self.write_law(region, simplex, face, coefficients);
        }
        let z = &simplex.multipliers[0];
        region.dual = self.equilibration.dual(z);
        region.fell_back = !*confirmed;
        region.units = *self.equilibration.units();
        for k in self.equilibration.rank..D {
            region.equations.push(&self.equilibration.matrix().row(k).transpose());
        }
        let weight = self.columns.objective.weight();
        let reach = self.columns.value(z, weight);
        // With a weight the bound is not homogeneous in z, and only multipliers that reach too far may shrink.
        region.reach = if weight > 0.0 { reach.max(1.0) } else { reach };
        // Forces that do not balance, or whose objective is not the multipliers', are no answer.
        let mismatch = if mismatch <= self.trusted(simplex) { 0.0 } else { mismatch };
        let gap = (1.0 - 1.0 / region.reach).abs().max(mismatch);
        // Multipliers that large cannot be written down in double precision any better.
        let tolerance = self.tolerance.max(32.0 * f64::EPSILON * z.lp_norm(1));
        if gap.is_nan() || gap > tolerance || mismatch.is_nan() || mismatch > 0.0 {
            known.forget();
            return Err(Error::NotConverged { solver: "simplex", iterations: simplex.pivots, gap });
        }
        Ok(slot)
    }

    /// How far a law may be from balance and from the multipliers' objective, at the simplex's target.
    fn trusted(&self, simplex: &Simplex<D>) -> f64 {
        let z = simplex.multipliers[0].lp_norm(1);
        let rounding = 1e-14 * simplex.levels.lp_norm(1);
        self.tolerance.min(1e-9).max(64.0 * f64::EPSILON * z).max(rounding)
    }

    /// The linear law of the forces on the face that the multipliers describe. Returns how far it is from
    /// balance and from the multipliers' objective at the simplex's target.
    fn write_law(
        &self,
        region: &mut Region<D>,
        simplex: &Simplex<D>,
        face: &mut Face,
        coefficients: &mut Vec<SVector<f64, D>>,
    ) -> f64 {
        let extremes = Extremes {
            forces: &self.extreme_forces,
            components: self.components,
            interiors: &self.interiors,
        };
        let map = self.equilibration.matrix();
        face.read(&self.columns, simplex, &self.interiors);
        let unique = law::unique_law(face, &self.columns, self.equilibration.rank, coefficients)
            .filter(|_| law::unbalanced(face, &self.columns, coefficients, &simplex.target) <= UNBALANCED);
        region.unique = unique.is_some();
        let trusted = self.trusted(simplex);
        let mismatch = |face: &Face, coefficients: &[SVector<f64, D>]| {
            let unbalanced = law::unbalanced(face, &self.columns, coefficients, &simplex.target);
            unbalanced.max(law::duality_gap(face, &self.columns, coefficients, simplex))
        };
        let unique = unique.filter(|_| mismatch(face, coefficients) <= trusted);
        if let Some(level) = unique {
            law::write_region(region, face, coefficients, &level, map, extremes);
            return mismatch(face, coefficients);
        }
        let law = least_squares_law(face, &self.columns, simplex, extremes, &self.limits)
            .filter(|law| mismatch(face, &law.coefficients) <= trusted);
        if let Some(law) = law {
            law::write_region(region, face, &law.coefficients, &law.level, map, extremes);
            for multiplier in &law.multipliers {
                region.conditions.push(&map.tr_mul(multiplier));
            }
            for equation in &law.equations {
                region.equations.push(&map.tr_mul(equation));
            }
            mismatch(face, &law.coefficients)
        } else {
            face.read_basis(&self.columns, simplex);
            let level = law::basic_law(face, simplex, coefficients);
            law::write_region(region, face, coefficients, &level, map, extremes);
            for row in (0..self.equilibration.rank).filter(|&row| simplex.basis.artificial[row]) {
                region.equations.push(&map.tr_mul(&simplex.basis.inverse.row(row).transpose()));
            }
            mismatch(face, coefficients)
        }
    }
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
        equilibration.reachable(&-Wrench::<D>::from_column_slice(sample)).map(|found| found.target)
    };
    samples.iter().enumerate().map(target).collect()
}
