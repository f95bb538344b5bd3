//! Whether forces balance their wrench (Eq. 11).

use crate::force::certificate::imbalance;
use crate::force::equilibration::units;
use crate::force::solution::Distribution;
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::tolerances::FEASIBILITY_TOLERANCE;

impl<const D: usize> Distribution<D> {
    /// Whether what the forces leave unbalanced is within the feasibility tolerance.
    ///
    /// `held` is the largest lower bound of the shares, zero without. `grasp` is the one that exerts the forces.
    pub fn balanced(&self, grasp: &Grasp<D>, held: f64) -> bool {
        let exerted: Wrench<D> = self.contact_wrenches(grasp).iter().sum();
        balances(grasp, &(exerted - self.residual), held, self.forces.iter().copied())
    }
}

/// Whether the forces of all contacts exert `b`, within the feasibility tolerance.
pub(crate) fn balances<const D: usize>(
    grasp: &Grasp<D>,
    b: &Wrench<D>,
    held: f64,
    forces: impl Iterator<Item = ContactForce> + Clone,
) -> bool {
    imbalance(b, &units(grasp), held, grasp.maps().iter().zip(forces)) <= FEASIBILITY_TOLERANCE
}
