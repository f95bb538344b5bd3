//! Least squares up to the feasibility tolerance, by a high price of the residual in 32 digits.
//!
//! Where a grasp acts along some directions by noise of its normals alone, exact balance needs multipliers without bound.
//! Forces beside a price are the least of all that leave no more, and exact for the wrench that they balance.

use crate::force::certificate::{Certificate, ContactForces};
use crate::force::nearest::by_price::{Cost, Pricing};
use crate::force::nearest::wrench_projection::WrenchProjection;
use crate::force::squares::program::SquaresProgram;
use crate::grasp::Wrench;
use crate::grasp::wrench_norm::Metric;
use crate::linalg::real::values;

impl<const D: usize> SquaresProgram<D> {
    /// Leaves the least forces at the first price at which they balance `b` but for the part `left`; `None` if none does.
    #[cold]
    pub(crate) fn solve_by_price(
        &self,
        b: &Wrench<D>,
        left: f64,
        forces: &mut ContactForces,
    ) -> Option<Certificate<D>> {
        let lever = self.units[0] / self.units[if D == 3 { 2 } else { 3 }];
        let least = |i: usize| self.least.get(i).copied().unwrap_or(0.0);
        let bounds: Vec<_> = (0..self.grasp.num_contacts()).map(|i| (least(i), 1.0)).collect();
        let metric = Metric::from_length_scale(lever);
        let projection = WrenchProjection::new(&self.grasp, metric, self.limits, &bounds);
        let balances = |forces: &ContactForces| self.missing(b, forces) <= left;
        let cost = Cost::of_squares(&self.dual);
        let mut pricing = Pricing::new(&self.grasp, &projection, cost, b, Some(&balances));
        let (point, weight) = pricing.search()?;
        if !balances(&point.forces) {
            return None;
        }
        let unit = self.dual.heaviest() / weight;
        let dual = pricing.dual.physical(&values(&point.proof)) * unit;
        *forces = point.forces;
        forces.unique = true;
        let (sigma, size) = self.objective(forces);
        let gap = if point.excess > 0.0 { point.excess * unit / size } else { 0.0 };
        Some(Certificate { sigma, dual, gap, pivots: pricing.steps, fell_back: true })
    }
}
