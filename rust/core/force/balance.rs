//! Whether forces balance their wrench (Eq. 11).

use crate::force::certificate::imbalance;
use crate::force::equilibration::units;
use crate::force::solution::Distribution;
use crate::grasp::{Grasp, Wrench};
use crate::tolerances::FEASIBILITY_TOLERANCE;

impl<const D: usize> Distribution<D> {
    /// Whether what the forces leave unbalanced is within the feasibility tolerance.
    ///
    /// `held` is the largest lower bound of the shares, zero without. `grasp` is the one that exerts the forces.
    pub fn balanced(&self, grasp: &Grasp<D>, held: f64) -> bool {
        let exerted: Wrench<D> = self.contact_wrenches(grasp).iter().sum();
        let contacts = grasp.maps().iter().zip(self.forces.iter().copied());
        imbalance(&(exerted - self.residual), &units(grasp), held, contacts) <= FEASIBILITY_TOLERANCE
    }
}
