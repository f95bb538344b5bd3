//! Columns over true friction cones: the support query has a closed form, so columns are generated as they are
//! needed and none is ever listed.

use std::sync::Arc;

use nalgebra::SVector;

use crate::force::equilibration::Equilibration;
use crate::force::simplex::pricing::{Column, Objective, Pricing, UNUSED};
use crate::grasp::Grasp;
use crate::grasp::contact::ContactForce;
use crate::wrench_set::contact_support::ContactSupport;

/// Marks a contact that a column uses; which force follows from the column's direction.
const USED: u32 = 0;

/// The wrench set of a grasp with true cones.
#[derive(Debug, Clone)]
pub(crate) struct ConeColumns<const D: usize> {
    pub(crate) objective: Objective,
    pub(crate) contacts: Vec<ContactSupport<D>>,
    /// The extreme forces of the grasp.
    pub(crate) extreme_forces: Arc<Vec<ContactForce>>,
    threshold: f64,
}

impl<const D: usize> ConeColumns<D> {
    /// `tolerance` is the relative gap at which column generation may stop.
    pub(crate) fn new(
        grasp: &Grasp<D>,
        objective: Objective,
        equilibration: &Equilibration<D>,
        tolerance: f64,
    ) -> Self {
        let contacts = equilibrated_contacts(grasp, equilibration);
        let extreme_forces = Arc::clone(grasp.shared_forces());
        Self { objective, contacts, extreme_forces, threshold: 0.5 * tolerance * objective.unit() }
    }

    /// The same columns with another relative gap.
    pub(crate) fn with_tolerance(&self, tolerance: f64) -> Self {
        Self { threshold: 0.5 * tolerance * self.objective.unit(), ..self.clone() }
    }

    pub(crate) fn num_contacts(&self) -> usize {
        self.contacts.len()
    }

    /// How much too far a multiplier reaches.
    pub(crate) fn reach(&self, z: &SVector<f64, D>) -> f64 {
        self.objective.reach(self.contacts.iter().map(|contact| contact.value(z)))
    }

    /// The force that contact `i` exerts in a column that was priced at `z`.
    pub(crate) fn force(&self, contact: usize, z: &SVector<f64, D>) -> ContactForce {
        let contact = &self.contacts[contact];
        let edge = if contact.is_finite() { contact.furthest(z).1 } else { 0 };
        contact.force(z, edge, &self.extreme_forces)
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

impl<const D: usize> Pricing<D> for ConeColumns<D> {
    fn furthest(&self, z: &SVector<f64, D>, discount: f64, edges: &mut [u32]) -> Column<D> {
        edges.fill(UNUSED);
        let weight = discount * self.objective.weight();
        let mut wrench = SVector::zeros();
        let (mut count, mut best) = (0, (f64::NEG_INFINITY, 0, SVector::zeros()));
        for (i, contact) in self.contacts.iter().enumerate() {
            let (value, point) = contact.support(z);
            if value > best.0 {
                best = (value, i, point);
            }
            if value > weight && self.objective != Objective::Sum {
                wrench += point;
                edges[i] = USED;
                count += 1;
            }
        }
        if count == 0 {
            edges[best.1] = USED;
            (wrench, count) = (best.2, 1);
        }
        Column { wrench, costs: [self.objective.costs(count)[0], 0.0], direction: *z }
    }

    fn tie_break(&self, _: &[SVector<f64, D>; 2], _: f64, _: &mut [u32]) -> Option<Column<D>> {
        None
    }

    fn optimality(&self) -> f64 {
        self.threshold
    }
}
