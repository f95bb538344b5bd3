//! Columns of the force distribution program with lower bounds on the normal forces.
//!
//! With normalised normal forces `c_i <= n_i <= c_max + t` the wrenches within reach are
//! `sum_i [c_i, c_max] H_i + t sum_i [0, 1] H_i`, where `H_i` is what contact i exerts at its limit: every
//! `n_i` splits into a part that holds and a part that presses on. Points of the first set, the *holding*
//! columns, are combined convexly (one more row), and cost nothing beyond `c_max`; points of the second, the
//! *pressing* columns, are those of the program without bounds. The furthest holding point is again a support
//! query: `sum_i max(c_i h_i, c_max h_i)`. For the sum, contacts hold with exactly `c_i` and press one by one.

use nalgebra::SVector;

use crate::force::linear_cones::cone_interior::Interior;
use crate::force::simplex::pricing::{Column, Objective, Pricing, UNUSED};
use crate::grasp::contact::ContactForce;
use crate::wrench_set::contact_support::ContactSupport;

/// Rows of the program: at most six of the wrench and the one that makes combinations convex.
pub(crate) const ROWS: usize = 7;

/// Marks a contact that holds at the largest of the lower bounds and not at its own.
const RAISED: u32 = 1 << 31;

/// In the slot behind the contacts: this column holds.
const HOLDS: u32 = 0;

/// The columns of a grasp with lower bounds, scaled so that the largest bound is one.
#[derive(Debug, Clone)]
pub(crate) struct PreloadColumns<const D: usize> {
    pub(crate) objective: Objective,
    pub(crate) contacts: Vec<ContactSupport<D>>,
    /// `c_i / c_max`.
    pub(crate) least: Vec<f64>,
    /// The number of each contact's first extreme force, counted over all contacts.
    pub(crate) starts: Vec<usize>,
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

    /// The support functions of the pressing and of the holding set, costs taken off.
    pub(crate) fn values(&self, z: &SVector<f64, D>) -> (f64, f64) {
        let weight = self.objective.weight();
        let (mut pressing, mut holding) = (0.0_f64, 0.0);
        for (contact, &least) in self.least.iter().enumerate() {
            let value = self.support(contact, z).0 - weight;
            if self.objective == Objective::Sum {
                pressing = pressing.max(value);
                holding += least * value;
            } else {
                pressing += value.max(0.0);
                holding += if value > 0.0 { value } else { least * value };
            }
        }
        (pressing, holding)
    }

    /// The forces that make up the column with these slots, for its level one.
    pub(crate) fn shares<'a>(&'a self, slots: &'a [u32]) -> impl Iterator<Item = Share> + 'a {
        let holds = slots[self.contacts.len()] == HOLDS;
        let contacts = slots[..self.contacts.len()].iter().enumerate();
        contacts.filter(|(_, slot)| **slot != UNUSED).map(move |(contact, slot)| Share {
            contact,
            edge: (slot & !RAISED) as usize,
            normal: if holds && slot & RAISED == 0 { self.least[contact] } else { 1.0 },
        })
    }

    /// The force of a contact at its limit, in a column that was priced at `z`.
    pub(crate) fn force(&self, share: &Share, z: &SVector<f64, D>) -> ContactForce {
        self.contacts[share.contact].force(z, share.edge)
    }

    /// `h_i(z)` and the edge that attains it; zero for a true cone.
    pub(crate) fn support(&self, contact: usize, z: &SVector<f64, D>) -> (f64, usize) {
        self.contacts[contact].furthest(z)
    }

    fn point(&self, contact: usize, edge: usize, z: &SVector<f64, D>) -> SVector<f64, D> {
        self.contacts[contact].wrench(z, edge)
    }

    fn widened(&self, wrench: &SVector<f64, D>, holds: bool) -> SVector<f64, ROWS> {
        SVector::from_fn(|k, _| match k {
            k if k < self.rank => wrench[k],
            k if k == self.rank && holds => 1.0,
            _ => 0.0,
        })
    }

    /// Builds the column whose slots hold each contact's edge, marked `RAISED` where the contact presses.
    fn assemble(&self, holds: bool, z: &SVector<f64, D>, slots: &mut [u32]) -> Column<ROWS> {
        let m = self.contacts.len();
        let (mut wrench, mut total, mut count) = (SVector::<f64, D>::zeros(), 0.0, 0);
        for (contact, slot) in slots.iter_mut().enumerate().take(m) {
            let (edge, raised) = (*slot & !RAISED, *slot & RAISED != 0);
            let normal = match (raised, holds) {
                (true, _) => 1.0,
                (false, true) => self.least[contact],
                (false, false) => 0.0,
            };
            if normal > 0.0 {
                wrench += self.point(contact, edge as usize, z) * normal;
                total += normal;
                count += 1;
                *slot = if holds { *slot } else { edge };
            } else {
                *slot = UNUSED;
            }
        }
        let costs = match (holds, self.objective) {
            (false, objective) => objective.costs(count),
            (true, Objective::Sum) => [0.0; 2],
            (true, Objective::MaxThenSum) => [0.0, total],
            (true, Objective::Weighted(weight)) => [weight * total, 0.0],
        };
        slots[m] = if holds { HOLDS } else { UNUSED };
        Column { wrench: self.widened(&wrench, holds), costs, direction: SVector::zeros() }
    }
}

/// A contact's edge, marked where the contact presses.
fn slot(edge: usize, raised: bool) -> u32 {
    edge as u32 | if raised { RAISED } else { 0 }
}

impl<const D: usize> Pricing<ROWS> for PreloadColumns<D> {
    fn furthest(&self, multiplier: &SVector<f64, ROWS>, discount: f64, slots: &mut [u32]) -> Column<ROWS> {
        let z = self.wrench_part(multiplier);
        let weight = discount * self.objective.weight();
        let sum = self.objective == Objective::Sum;
        let (mut pressing, mut holding) = (0.0, multiplier[self.rank]);
        let mut best = (f64::NEG_INFINITY, 0);
        for (contact, &least) in self.least.iter().enumerate() {
            let (value, edge) = self.support(contact, &z);
            let value = value - weight;
            let raised = value > 0.0 && !sum;
            pressing += value.max(0.0);
            holding += if raised { value } else { least * value };
            slots[contact] = slot(edge, raised);
            if value > best.0 {
                best = (value, contact);
            }
        }
        let single = sum || best.0 <= 0.0;
        let pressing = if single { best.0 } else { pressing } - discount;
        let holds = holding > pressing;
        if single && !holds {
            slots[best.1] |= RAISED;
        }
        let mut column = self.assemble(holds, &z, slots);
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
        // Pressing columns take part only where they are optimal for the objective; holding ones always are.
        let presses = self.values(&z[0]).0 >= 1.0 - tolerance;
        let (mut pressing, mut holding) = (0.0, multipliers[1][self.rank]);
        for (contact, &least) in self.least.iter().enumerate() {
            let (value, edge, gain) = self.tied(contact, &z, tolerance);
            let raised = value > tolerance || (value >= -tolerance && gain > 0.0);
            pressing += if raised { gain } else { 0.0 };
            holding += if raised { gain } else { least * gain };
            slots[contact] = slot(edge, raised);
        }
        let holds = !presses || holding > pressing;
        let column = self.assemble(holds, &z[0], slots);
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
        let (edge, gain) = support
            .edges_reaching(&z[0], value - tolerance)
            .map(|edge| (edge, support.wrench(&z[0], edge).dot(&z[1]) - 1.0))
            .fold((edge, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
        (value, edge, gain)
    }
}
