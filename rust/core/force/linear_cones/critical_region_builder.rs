//! Builds the critical region around a wrench from an optimal basis.
//!
//! The multipliers `z_b` of Eq. 26 describe the face of optimal solutions. If its unknowns are independent, the forces
//! are unique. Otherwise the third level chooses among them. Where rounding prevents both, the forces of the basis
//! itself are used (Eq. 31): they are least, too. The linear map of the forces is accepted only if its forces balance
//! the wrench, push, and attain the objective that the multipliers prove.

use std::sync::Arc;

use nalgebra::SVector;

use crate::error::{Error, Result, Unmet};
use crate::force::certificate::{check_size, imbalance, loosened};
use crate::force::equilibration::Equilibration;
use crate::force::linear_cones::cone_interior::Interior;
use crate::force::linear_cones::critical_region::CriticalRegion;
use crate::force::linear_cones::force_law::{self, Extremes};
use crate::force::linear_cones::optimal_face::OptimalFace;
use crate::force::simplex::columns::ImplicitColumns;
use crate::force::simplex::pricing::Objective;
use crate::force::simplex::primal::Simplex;
use crate::grasp::contact::{ContactForce, contact_force};
use crate::grasp::{ContactMap, Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::{
    DOUBTFUL_GAP, FEASIBILITY_TOLERANCE, LEAST_DOUBTFUL_GAP, LOOSEST_GAP, NEGATIVE_IN_NEW_REGION,
    ROUNDED_FORCES, ROUNDED_GAP, TRUSTED_FORCES, UNBALANCED_WRENCH,
};

/// Contacts further apart in strength than this are compared by their forces, too, and not by their shares alone.
const FAR_APART: f64 = 100.0;

/// What turns the multipliers of a grasp into its contact forces.
#[derive(Debug, Clone)]
pub(crate) struct CriticalRegionBuilder<const D: usize> {
    extreme_forces: Arc<Vec<ContactForce>>,
    components: &'static [usize],
    interiors: Vec<Option<Interior>>,
    limits: Vec<f64>,
    maps: Vec<ContactMap<D>>,
    /// Largest force of each contact at a share of one; empty unless they are far apart.
    strengths: Vec<f64>,
    tolerance: f64,
}

/// Buffers of the builder.
#[derive(Debug, Clone)]
pub(crate) struct BuilderWorkspace<const D: usize> {
    face: OptimalFace,
    coefficients: Vec<SVector<f64, D>>,
    /// Components of the forces, contact by contact.
    forces: Vec<f64>,
}

impl<const D: usize> BuilderWorkspace<D> {
    pub(crate) fn with_capacity(contacts: usize, edges: usize) -> Self {
        Self {
            face: OptimalFace::with_capacity(contacts, edges),
            coefficients: Vec::with_capacity(edges),
            forces: vec![0.0; 4 * contacts],
        }
    }
}

impl<const D: usize> CriticalRegionBuilder<D> {
    /// For a grasp with listed extreme forces.
    pub(crate) fn new(grasp: &Grasp<D>, tolerance: f64) -> Self {
        Self {
            extreme_forces: Arc::clone(grasp.shared_forces()),
            components: grasp.force_components(),
            interiors: Interior::of_contacts(grasp),
            limits: grasp.contacts().iter().map(|contact| contact.max_normal_force).collect(),
            maps: grasp.maps().to_vec(),
            strengths: strengths_far_apart(grasp),
            tolerance,
        }
    }

    /// Which components of a contact force exist.
    pub(crate) fn components(&self) -> &'static [usize] {
        self.components
    }

    /// A region with room for any force map of the grasp.
    pub(crate) fn blank(&self, objective: Objective) -> CriticalRegion<D> {
        // A condition for each extreme force or each facet of its cone, whichever are more.
        let surplus: usize = self.interiors.iter().flatten().map(Interior::surplus).sum();
        let (contacts, edges) = (self.maps.len(), self.extreme_forces.len() + surplus);
        CriticalRegion::with_capacity(objective, contacts, edges, self.components.len(), &self.strengths)
    }

    /// Writes the region in which the simplex's answer for `b` lies, or says why it is none.
    pub(crate) fn read(
        &self,
        region: &mut CriticalRegion<D>,
        simplex: &mut Simplex<D>,
        columns: &ImplicitColumns<D>,
        equilibration: &Equilibration<D>,
        buffers: &mut BuilderWorkspace<D>,
        b: &Wrench<D>,
    ) -> Result<()> {
        let mut mismatch = self.write_forces(region, simplex, columns, equilibration, buffers, b);
        if mismatch.is_nan() || mismatch > self.trusted(simplex) {
            // Updates pivot by pivot have cost the inverse its digits; a fresh one may do better.
            simplex.refactorise();
            simplex.refresh_multipliers();
            mismatch = self.write_forces(region, simplex, columns, equilibration, buffers, b);
        }
        region.basic |= buffers.face.nearly_tied;
        // A third level that was interrupted has chosen nothing.
        interrupt::check()?;
        let z = &simplex.multipliers[0];
        region.dual = equilibration.dual(z);
        region.units = *equilibration.units();
        for k in equilibration.rank..D {
            region.equations.push(&equilibration.matrix().row(k).transpose());
        }
        region.reach = columns.reach(z);
        let objective = region.dual.dot(b);
        let size = z.lp_norm(1) / columns.objective.unit();
        region.rounded_gap = (ROUNDED_GAP * size).clamp(LEAST_DOUBTFUL_GAP, DOUBTFUL_GAP);
        region.tolerance = loosened(self.tolerance, size.max(region.cancelled(b) / objective));
        // Forces that do not balance, that pull, or whose objective is not the multipliers', are no answer.
        let unbalanced = self.imbalance(region, b, &mut buffers.forces);
        let balanced = unbalanced <= FEASIBILITY_TOLERANCE;
        if mismatch <= self.trusted(simplex) && region.answers(b, NEGATIVE_IN_NEW_REGION) && balanced {
            return Ok(());
        }
        check_size(objective)?;
        let unmet = if balanced {
            Unmet::Gap { found: region.gap(b).max(mismatch), allowed: region.tolerance }
        } else {
            Unmet::Balance { found: unbalanced, allowed: FEASIBILITY_TOLERANCE }
        };
        Err(Error::NotConverged { solver: "simplex", iterations: simplex.pivots, unmet })
    }

    /// Writes the linear map of the forces on the face that the multipliers describe. Returns how far it is from
    /// balance and from the multipliers' objective at the simplex's target.
    fn write_forces(
        &self,
        region: &mut CriticalRegion<D>,
        simplex: &Simplex<D>,
        columns: &ImplicitColumns<D>,
        equilibration: &Equilibration<D>,
        buffers: &mut BuilderWorkspace<D>,
        b: &Wrench<D>,
    ) -> f64 {
        let BuilderWorkspace { face, coefficients, .. } = buffers;
        let extremes = Extremes {
            forces: &self.extreme_forces,
            components: self.components,
            strengths: &self.strengths,
            interiors: &self.interiors,
        };
        let map = equilibration.matrix();
        face.read(columns, simplex, &self.interiors);
        let trusted = self.trusted(simplex);
        let mismatch = |face: &OptimalFace, coefficients: &[SVector<f64, D>]| {
            let unbalanced = force_law::unbalanced(face, columns, coefficients, &simplex.target);
            (unbalanced, unbalanced.max(force_law::duality_gap(face, columns, coefficients, simplex)))
        };
        region.unique = false;
        if let Some(level) = force_law::unique_forces(face, columns, equilibration.rank, coefficients) {
            let (unbalanced, mismatch) = mismatch(face, coefficients);
            if mismatch <= trusted && unbalanced <= UNBALANCED_WRENCH {
                force_law::write_region(region, face, coefficients, &level, map, extremes);
                if region.nonnegative(b, NEGATIVE_IN_NEW_REGION) {
                    region.unique = true;
                    return mismatch;
                }
            }
        }
        if let Some(chosen) = force_law::least_norm_forces(face, columns, simplex, extremes, &self.limits) {
            let (_, mismatch) = mismatch(face, &chosen.coefficients);
            if mismatch <= trusted {
                force_law::write_region(region, face, &chosen.coefficients, &chosen.level, map, extremes);
                for multiplier in &chosen.multipliers {
                    region.conditions.push(&map.tr_mul(multiplier));
                }
                for equation in &chosen.equations {
                    region.equations.push(&map.tr_mul(equation));
                }
                if region.nonnegative(b, NEGATIVE_IN_NEW_REGION) {
                    return mismatch;
                }
            }
        }
        face.read_basis(columns, simplex);
        let level = force_law::basis_forces(face, simplex, coefficients);
        force_law::write_region(region, face, coefficients, &level, map, extremes);
        region.basic = true;
        for row in (0..equilibration.rank).filter(|&row| simplex.basis.artificial[row]) {
            region.equations.push(&map.tr_mul(&simplex.basis.inverse.row(row).transpose()));
        }
        mismatch(face, coefficients).1
    }

    /// Whether the forces balance every wrench of a region.
    pub(crate) fn balances_all(&self, region: &CriticalRegion<D>) -> bool {
        region.left_over(&self.maps, self.components) <= FEASIBILITY_TOLERANCE
    }

    /// How far the forces themselves, in N and N m, are from balance.
    fn imbalance(&self, region: &CriticalRegion<D>, b: &Wrench<D>, forces: &mut [f64]) -> f64 {
        region.forces.multiply(b, forces);
        let rows = forces.chunks(self.components.len());
        imbalance(
            b,
            &region.units,
            0.0,
            self.maps.iter().zip(rows.map(|row| contact_force(row, self.components))),
        )
    }

    /// How far the forces may be from balance and from the multipliers' objective, at the simplex's target.
    fn trusted(&self, simplex: &Simplex<D>) -> f64 {
        let z = simplex.multipliers[0].lp_norm(1);
        let rounding = (64.0 * f64::EPSILON * z).max(ROUNDED_FORCES * simplex.levels.lp_norm(1));
        self.tolerance.min(TRUSTED_FORCES).max(rounding.min(LOOSEST_GAP))
    }
}

/// The largest force that each contact exerts at a share of one, if they are far apart.
fn strengths_far_apart<const D: usize>(grasp: &Grasp<D>) -> Vec<f64> {
    let strength = |contact: usize| {
        let forces = &grasp.finite_forces()[grasp.edges(contact).unwrap_or_default()];
        forces.iter().map(|force| force.fixed_rows::<3>(0).amax()).fold(0.0, f64::max)
    };
    let strengths: Vec<f64> = (0..grasp.num_contacts()).map(strength).collect();
    let largest = strengths.iter().copied().fold(0.0, f64::max);
    let far_apart = strengths.iter().any(|strength| *strength * FAR_APART < largest);
    if far_apart { strengths } else { Vec::new() }
}
