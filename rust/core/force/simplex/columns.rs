//! Columns of the force distribution program, priced by the support oracle without listing them.

use std::ops::Range;

use nalgebra::SVector;

use crate::force::equilibration::Equilibration;
use crate::force::simplex::pricing::{Column, Objective, Pricing, UNUSED};
use crate::grasp::Grasp;
use crate::tolerances::OPTIMAL_COST;
use crate::wrench_set::contact_support::ContactSupport;

/// The wrench set of a grasp in equilibrated coordinates. A column names the extreme force that each contact uses; that of
/// a true cone follows from the direction in which the column was priced.
#[derive(Debug, Clone)]
pub(crate) struct ImplicitColumns<const R: usize> {
    pub(crate) objective: Objective,
    pub(crate) contacts: Vec<ContactSupport<R>>,
    /// Reduced costs below this are no improvement.
    threshold: f64,
}

impl<const R: usize> ImplicitColumns<R> {
    pub(crate) fn new(objective: Objective, contacts: Vec<ContactSupport<R>>) -> Self {
        Self { objective, contacts, threshold: OPTIMAL_COST * objective.unit() }
    }

    /// The same columns where the simplex may stop at a relative gap: true cones have columns without end.
    pub(crate) fn with_tolerance(&self, gap: f64) -> Self {
        Self { threshold: 0.5 * gap * self.objective.unit(), ..self.clone() }
    }

    /// Which extreme forces belong to each contact.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.contacts.iter().map(ContactSupport::range)
    }

    /// The number of extreme forces of all contacts.
    pub(crate) fn num_edges(&self) -> usize {
        self.ranges().map(|range| range.len()).sum()
    }

    /// The wrench of an extreme force of the contact.
    pub(crate) fn wrench(&self, contact: usize, edge: u32) -> SVector<f64, R> {
        self.contacts[contact].wrench(&SVector::zeros(), edge as usize)
    }

    /// How much too far a multiplier reaches.
    pub(crate) fn reach(&self, z: &SVector<f64, R>) -> f64 {
        self.objective.reach(self.contacts.iter().map(|contact| contact.value(z)))
    }
}

/// The contacts of a grasp in equilibrated coordinates.
pub(crate) fn equilibrated_contacts<const D: usize>(
    grasp: &Grasp<D>,
    equilibration: &Equilibration<D>,
) -> Vec<ContactSupport<D>> {
    let contact = |i| ContactSupport::of_contact(grasp, i, |wrench| equilibration.wrench(wrench));
    (0..grasp.num_contacts()).map(contact).collect()
}

/// Among a contact's extreme forces that reach at least `least` along the first multiplier the one that gains most in the
/// tie-break, with its gain; `otherwise` where none does.
pub(crate) fn best_tied<const R: usize>(
    contact: &ContactSupport<R>,
    z: &[SVector<f64, R>; 2],
    least: f64,
    otherwise: usize,
) -> (usize, f64) {
    let gain = |edge| contact.wrench(&z[0], edge).dot(&z[1]) - 1.0;
    let tied = contact.edges_reaching(&z[0], least).map(|edge| (edge, gain(edge)));
    tied.fold((otherwise, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best })
}

impl<const R: usize> Pricing<R> for ImplicitColumns<R> {
    fn furthest(&self, z: &SVector<f64, R>, discount: f64, edges: &mut [u32]) -> Column<R> {
        edges.fill(UNUSED);
        // Columns of the least sum use one contact.
        let sum = self.objective == Objective::Sum;
        let least = if sum { f64::INFINITY } else { discount * self.objective.weight() };
        let (mut wrench, mut count) = (SVector::zeros(), 0);
        let mut best = (f64::NEG_INFINITY, 0, 0);
        for (i, contact) in self.contacts.iter().enumerate() {
            let (value, edge) = contact.furthest(z);
            if value > least {
                wrench += contact.wrench(z, edge);
                edges[i] = edge as u32;
                count += 1;
            } else if value > best.0 {
                best = (value, i, edge);
            }
        }
        if count == 0 {
            let (_, i, edge) = best;
            edges[i] = edge as u32;
            (wrench, count) = (self.contacts[i].wrench(z, edge), 1);
        }
        Column { wrench, costs: self.objective.costs(count), direction: *z }
    }

    fn tie_break(&self, z: &[SVector<f64, R>; 2], tolerance: f64, edges: &mut [u32]) -> Option<Column<R>> {
        if self.objective != Objective::MaxThenSum || !self.contacts.iter().all(ContactSupport::is_finite) {
            return None;
        }
        edges.fill(UNUSED);
        let (mut wrench, mut count) = (SVector::zeros(), 0);
        for (contact, slot) in self.contacts.iter().zip(edges) {
            let (value, edge) = contact.furthest(&z[0]);
            if value < -tolerance {
                continue;
            }
            let (edge, gain) = best_tied(contact, z, value - tolerance, edge);
            if value > tolerance || gain > 0.0 {
                wrench += contact.wrench(&z[0], edge);
                *slot = edge as u32;
                count += 1;
            }
        }
        (count > 0).then(|| Column { wrench, costs: self.objective.costs(count), direction: z[0] })
    }

    fn optimality(&self) -> f64 {
        self.threshold
    }
}
