//! The dual simplex method with implicit columns: a warm start when the wrench has left a basis.
//!
//! A basis stays optimal in its multipliers while a level turns negative. Its row of the inverse gives the
//! direction e in which the multipliers may move; how far is where the support function of `z + t e` reaches
//! the columns' cost. That is the root of a convex piecewise-linear function, found by Newton's method from
//! the right, one support query a step.

use nalgebra::SVector;

use crate::force::simplex::pricing::{Column, Pricing};
use crate::force::simplex::primal::{Outcome, RightHandSide, Simplex};
use crate::tolerances::{NEGATIVE_LEVEL, ROUNDED_SUPPORT_VALUE, SMALLEST_PIVOT, UNREACHED};

/// Newton steps along one direction; each lands on another column, and three are usual.
const MAX_DUAL_STEPS: usize = 30;

impl<const R: usize> Simplex<R> {
    /// Re-optimises from the current basis within `cap` dual pivots. `None` asks for a cold start.
    pub(crate) fn warm(
        &mut self,
        pricing: &impl Pricing<R>,
        target: &RightHandSide<R>,
        cap: usize,
    ) -> Option<Outcome<R>> {
        self.pivots = 0;
        if self.basis.artificial[..target.rank].contains(&true) {
            return None;
        }
        self.target = target.wrench;
        self.levels = self.basis.levels(&target.wrench);
        let negative = self.levels.iter().filter(|level| **level < 0.0).count();
        if negative > cap {
            return None;
        }
        for _ in 0..=cap {
            let (row, level) = self.levels.argmin();
            if level >= -NEGATIVE_LEVEL * self.levels.amax() {
                return Some(self.optimise(pricing, target.rank));
            }
            if self.pivots == cap {
                break;
            }
            let e = -self.basis.inverse.row(row).transpose();
            // Nothing reaches along e: the wrench looks infeasible, which the first phase tells best.
            let column = self.entering_column(pricing, &e)?;
            let direction = self.basis.inverse * column.wrench;
            if direction[row] > -SMALLEST_PIVOT * direction.amax() {
                return None;
            }
            self.exchange(row, &column, &direction);
        }
        None
    }

    /// The column that the multipliers meet first along `e`, if they meet one and rounding allows to tell.
    fn entering_column(&mut self, pricing: &impl Pricing<R>, e: &SVector<f64, R>) -> Option<Column<R>> {
        let z = self.multipliers[0];
        let mut column = pricing.furthest(e, 0.0, &mut self.entering);
        let slope = column.wrench.dot(e);
        if slope <= UNREACHED * e.lp_norm(1) {
            return None;
        }
        let mut step = (column.costs[0] - column.wrench.dot(&z)) / slope;
        for _ in 0..MAX_DUAL_STEPS {
            let moved = z + e * step;
            let next = pricing.furthest(&moved, 1.0, &mut self.candidate);
            let excess = next.wrench.dot(&moved) - next.costs[0];
            let slope = next.wrench.dot(e);
            if excess <= pricing.optimality().max(ROUNDED_SUPPORT_VALUE * moved.lp_norm(1)) {
                return Some(column);
            }
            if slope <= 0.0 {
                return None;
            }
            step -= excess / slope;
            column = next;
            std::mem::swap(&mut self.entering, &mut self.candidate);
        }
        None
    }
}
