//! Least squares beside a high price of what stays unbalanced, in numbers of 32 digits.
//!
//! Where a wrench lies beyond all that contacts exert, the multiplier grows with the price. The points that are projected
//! then lie far outside the cones, and their roundings outweigh the forces.

use nalgebra::SVector;

use crate::error::Result;
use crate::force::certificate::{Certificate, ContactForces};
use crate::force::squares::dual::DualPoint;
use crate::force::squares::newton::minimise;
use crate::force::squares::program::SquaresProgram;
use crate::grasp::Wrench;
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;

/// Newton's method goes on from a point whose gradient is below this, relative to its terms.
const NEAR_SOLUTION: f64 = 1e-3;

/// Prices of the residual up to the reciprocal of this, beside the forces, are easy for Newton's method; and the factor by
/// which contacts become lighter from there.
const WELL_CONDITIONED_PRICE: f64 = 1e-3;
const WEIGHT_FACTOR: f64 = 30.0;

impl<const D: usize> SquaresProgram<D> {
    /// Goes on from a point in numbers of 32 digits: beside a high price of the residual doubles lose the forces.
    #[cold]
    pub(crate) fn solve_in_32_digits(
        &self,
        b: &Wrench<D>,
        target: &Wrench<D>,
        from: &DualPoint<D>,
        steps: usize,
        forces: &mut ContactForces,
    ) -> Result<(Certificate<D>, Wrench<D>)> {
        if from.gradient.norm() <= NEAR_SOLUTION * from.size {
            let ContactForces { forces: f, shares, .. } = &mut *forces;
            let start = self.dual.at(&from.y.map(DoubleDouble::from), target, f, shares);
            let (point, more) = minimise(&self.dual, target, start, f, shares);
            let answer = self.certify(b, &point, steps + more, forces);
            if answer.is_ok() {
                return answer;
            }
        }
        self.solve_by_lighter_contacts(b, target, steps, forces)
    }

    /// The same from heavier contacts to their own weights: beside a high price the function is steep, and Newton's steps
    /// along it are short. While no contact changes its face, the multiplier is a linear function of the weights.
    fn solve_by_lighter_contacts(
        &self,
        b: &Wrench<D>,
        target: &Wrench<D>,
        mut steps: usize,
        forces: &mut ContactForces,
    ) -> Result<(Certificate<D>, Wrench<D>)> {
        let mut dual = self.dual.clone();
        let least = self.dual.slack.map_or(1.0, |slack| slack.diagonal().min());
        let mut heavier = (WELL_CONDITIONED_PRICE / least.max(f64::MIN_POSITIVE)).max(1.0);
        let mut y = SVector::repeat(DoubleDouble::ZERO);
        let mut further = None;
        loop {
            for (contact, own) in dual.contacts.iter_mut().zip(&self.dual.contacts) {
                contact.weight = own.weight * heavier;
            }
            let ContactForces { forces: f, shares, .. } = &mut *forces;
            let mut start = dual.at(&y, target, f, shares);
            if let Some(further) = further {
                let ahead = dual.at(&further, target, f, shares);
                start = if ahead.value < start.value { ahead } else { start };
            }
            let (point, more) = minimise(&dual, target, start, f, shares);
            steps += more;
            if heavier == 1.0 || interrupt::stopped() {
                return self.certify(b, &point, steps, forces);
            }
            // The weights fell by `WEIGHT_FACTOR - 1` times these, and fall by `heavier - lighter`.
            let lighter = (heavier / WEIGHT_FACTOR).max(1.0);
            let by = (heavier - lighter) / (heavier * (WEIGHT_FACTOR - 1.0));
            further =
                further.is_some().then(|| point.y + (point.y - y).map(|x| x.times(by))).or(Some(point.y));
            (y, heavier) = (point.y, lighter);
        }
    }
}
