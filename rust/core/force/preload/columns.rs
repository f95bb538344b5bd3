//! Columns of the force distribution program with lower bounds on the normal forces.
//!
//! With normalised normal forces `c_i <= n_i <= c_max + t` the wrenches within reach are
//! `sum_i [c_i, c_max] H_i + t sum_i [0, 1] H_i`, where `H_i` is what contact i exerts at its limit. They form a
//! polyhedron with vertices and rays. The *vertices* are points of the first set: they are combined convexly (one more
//! row), and cost nothing beyond `c_max`. The *rays* are points of the second set, the columns of the program without
//! bounds. The furthest vertex is again a support query: `sum_i max(c_i h_i, c_max h_i)`. For the sum, a vertex has
//! exactly the share `c_i` at each contact, and a ray has one contact.

use std::sync::Arc;

use nalgebra::SVector;

use crate::force::linear_cones::cone_interior::Interior;
use crate::force::simplex::columns::best_tied;
use crate::force::simplex::pricing::{Column, Objective, Pricing, UNUSED};
use crate::grasp::contact::ContactForce;
use crate::wrench_set::contact_support::ContactSupport;

/// Rows of the program: at most six of the wrench and the one that makes combinations convex.
pub(crate) const ROWS: usize = 7;

/// Marks a contact whose share in a vertex is the largest of the lower bounds, and not its own.
const RAISED: u32 = 1 << 31;

/// In the slot behind the contacts: this column is a vertex.
const VERTEX: u32 = 0;

/// The columns of a grasp with lower bounds, scaled so that the largest bound is one.
#[derive(Debug, Clone)]
pub(crate) struct PreloadColumns<const D: usize> {
    pub(crate) objective: Objective,
    pub(crate) contacts: Vec<ContactSupport<D>>,
    /// The extreme forces of the grasp.
    pub(crate) extreme_forces: Arc<Vec<ContactForce>>,
    /// `c_i / c_max`.
    pub(crate) least: Vec<f64>,
    /// The cones whose interior is described by facets.
    pub(crate) interiors: Vec<Option<Interior>>,
    /// `f_i^U`.
    pub(crate) limits: Vec<f64>,
    /// Rows of the wrench; the convexity row comes next.
    pub(crate) rank: usize,
    /// Reduced costs below this are no improvement.
    pub(crate) threshold: f64,
}

/// What one contact contributes to a column.
pub(crate) struct Share {
    pub(crate) contact: usize,
    pub(crate) edge: usize,
    /// Its normalised normal force.
    pub(crate) normal: f64,
}

impl<const D: usize> PreloadColumns<D> {
    /// The part of a multiplier that belongs to the wrench.
    pub(crate) fn wrench_part(&self, z: &SVector<f64, ROWS>) -> SVector<f64, D> {
        SVector::from_fn(|k, _| if k < self.rank { z[k] } else { 0.0 })
    }

    /// Whether every contact has finitely many extreme forces.
    pub(crate) fn is_finite(&self) -> bool {
        self.contacts.iter().all(ContactSupport::is_finite)
    }

    /// The support functions of the rays and of the vertices, costs taken off.
    pub(crate) fn values(&self, z: &SVector<f64, D>) -> (f64, f64) {
        let weight = self.objective.weight();
        let (mut rays, mut vertices) = (0.0_f64, 0.0);
        for (contact, &least) in self.least.iter().enumerate() {
            let value = self.support(contact, z).0 - weight;
            if self.objective == Objective::Sum {
                rays = rays.max(value);
                vertices += least * value;
            } else {
                rays += value.max(0.0);
                vertices += if value > 0.0 { value } else { least * value };
            }
        }
        (rays, vertices)
    }

    /// The forces that make up the column with these slots, for its level one.
    pub(crate) fn shares<'a>(&'a self, slots: &'a [u32]) -> impl Iterator<Item = Share> + 'a {
        let is_vertex = slots[self.contacts.len()] == VERTEX;
        let contacts = slots[..self.contacts.len()].iter().enumerate();
        contacts.filter(|(_, slot)| **slot != UNUSED).map(move |(contact, slot)| Share {
            contact,
            edge: (slot & !RAISED) as usize,
            normal: if is_vertex && slot & RAISED == 0 { self.least[contact] } else { 1.0 },
        })
    }

    /// The force of a contact at its limit, in a column that was priced at `z`.
    pub(crate) fn force(&self, share: &Share, z: &SVector<f64, D>) -> ContactForce {
        self.contacts[share.contact].force(z, share.edge, &self.extreme_forces)
    }

    /// `h_i(z)` and the edge that attains it; zero for a true cone.
    pub(crate) fn support(&self, contact: usize, z: &SVector<f64, D>) -> (f64, usize) {
        self.contacts[contact].furthest(z)
    }

    fn point(&self, contact: usize, edge: usize, z: &SVector<f64, D>) -> SVector<f64, D> {
        self.contacts[contact].wrench(z, edge)
    }

    fn widened(&self, wrench: &SVector<f64, D>, is_vertex: bool) -> SVector<f64, ROWS> {
        SVector::from_fn(|k, _| match k {
            k if k < self.rank => wrench[k],
            k if k == self.rank && is_vertex => 1.0,
            _ => 0.0,
        })
    }

    /// Builds the column whose slots hold each contact's edge, marked `RAISED` where its share is the largest bound.
    fn assemble(&self, is_vertex: bool, z: &SVector<f64, D>, slots: &mut [u32]) -> Column<ROWS> {
        let m = self.contacts.len();
        let (mut wrench, mut total, mut count) = (SVector::<f64, D>::zeros(), 0.0, 0);
        for (contact, slot) in slots.iter_mut().enumerate().take(m) {
            let (edge, raised) = (*slot & !RAISED, *slot & RAISED != 0);
            let normal = match (raised, is_vertex) {
                (true, _) => 1.0,
                (false, true) => self.least[contact],
                (false, false) => 0.0,
            };
            if normal > 0.0 {
                wrench += self.point(contact, edge as usize, z) * normal;
                total += normal;
                count += 1;
                *slot = if is_vertex { *slot } else { edge };
            } else {
                *slot = UNUSED;
            }
        }
        let costs = match (is_vertex, self.objective) {
            (false, objective) => objective.costs(count),
            (true, Objective::Sum) => [0.0; 2],
            (true, Objective::MaxThenSum) => [0.0, total],
            (true, Objective::Weighted(weight)) => [weight * total, 0.0],
        };
        slots[m] = if is_vertex { VERTEX } else { UNUSED };
        Column { wrench: self.widened(&wrench, is_vertex), costs, direction: SVector::zeros() }
    }
}

/// A contact's edge, marked where its share is the largest bound.
fn slot(edge: usize, raised: bool) -> u32 {
    edge as u32 | if raised { RAISED } else { 0 }
}

impl<const D: usize> Pricing<ROWS> for PreloadColumns<D> {
    fn furthest(&self, multiplier: &SVector<f64, ROWS>, discount: f64, slots: &mut [u32]) -> Column<ROWS> {
        let z = self.wrench_part(multiplier);
        let weight = discount * self.objective.weight();
        let sum = self.objective == Objective::Sum;
        let (mut rays, mut vertices) = (0.0, multiplier[self.rank]);
        let mut best = (f64::NEG_INFINITY, 0);
        for (contact, &least) in self.least.iter().enumerate() {
            let (value, edge) = self.support(contact, &z);
            let value = value - weight;
            let raised = value > 0.0 && !sum;
            rays += value.max(0.0);
            vertices += if raised { value } else { least * value };
            slots[contact] = slot(edge, raised);
            if value > best.0 {
                best = (value, contact);
            }
        }
        let single = sum || best.0 <= 0.0;
        let rays = if single { best.0 } else { rays } - discount;
        let is_vertex = vertices > rays;
        if single && !is_vertex {
            slots[best.1] |= RAISED;
        }
        let mut column = self.assemble(is_vertex, &z, slots);
        column.direction = *multiplier;
        column
    }

    fn tie_break(
        &self,
        multipliers: &[SVector<f64, ROWS>; 2],
        tolerance: f64,
        slots: &mut [u32],
    ) -> Option<Column<ROWS>> {
        if self.objective != Objective::MaxThenSum || !self.is_finite() {
            return None;
        }
        let z = multipliers.map(|z| self.wrench_part(&z));
        // Rays take part only where they are optimal for the objective; vertices always do.
        let on_rays = self.values(&z[0]).0 >= 1.0 - tolerance;
        let (mut rays, mut vertices) = (0.0, multipliers[1][self.rank]);
        for (contact, &least) in self.least.iter().enumerate() {
            let (value, edge, gain) = self.tied(contact, &z, tolerance);
            let raised = value > tolerance || (value >= -tolerance && gain > 0.0);
            rays += if raised { gain } else { 0.0 };
            vertices += if raised { gain } else { least * gain };
            slots[contact] = slot(edge, raised);
        }
        let is_vertex = !on_rays || vertices > rays;
        let column = self.assemble(is_vertex, &z[0], slots);
        (column.wrench.amax() > 0.0).then_some(column)
    }

    fn optimality(&self) -> f64 {
        self.threshold
    }
}

impl<const D: usize> PreloadColumns<D> {
    /// `h_i(z_1)`, and among the edges that attain it the one with the largest `w . z_2 - 1`, with that.
    pub(crate) fn tied(&self, contact: usize, z: &[SVector<f64, D>; 2], tolerance: f64) -> (f64, usize, f64) {
        let support = &self.contacts[contact];
        if !support.is_finite() {
            return (f64::NEG_INFINITY, 0, 0.0);
        }
        let (value, edge) = support.furthest(&z[0]);
        let (edge, gain) = best_tied(support, z, value - tolerance, edge);
        (value, edge, gain)
    }
}
