//! What a multiplier proves of forces beside a high price of the residual, in 32 digits.
//!
//! Of the distance: no forces leave less of `b` than `(b . y - sum_i reach_i(y)) / |y|`. Of the objective: what forces and
//! multiplier miss of complementarity, contact by contact, and of their common residual.

use crate::force::certificate::{ContactForces, exact_rest};
use crate::force::nearest::by_price::{Cost, Point, Pricing};
use crate::force::nearest::vertices::Vector;
use crate::force::squares::dual::DualContact;
use crate::force::squares::projection::Force;
use crate::linalg::double_double::DoubleDouble;
use crate::linalg::real::{dot, values};

impl<const D: usize> Pricing<'_, D> {
    /// The forces at a multiplier, and what it proves.
    pub(super) fn point(&self, weight: f64, y: Vector<D>, forces: &ContactForces) -> Point<D> {
        let project = |contact: &DualContact<D>| {
            let pull = contact.pull(&y).map(|x| x.times(1.0 / contact.weight));
            contact.project(&(contact.reference.map(DoubleDouble::from) + pull)).force
        };
        let exact: Vec<_> = self.dual.contacts.iter().map(project).collect();
        self.proven(weight, y, exact, forces.clone())
    }

    /// What a multiplier proves of forces, which are given in 32 digits and rounded.
    pub(super) fn proven(
        &self,
        weight: f64,
        y: Vector<D>,
        exact: Vec<Force<DoubleDouble>>,
        forces: ContactForces,
    ) -> Point<D> {
        let maps = self.grasp.maps().iter().zip(forces.forces.iter().copied());
        let distance = self.projection.metric.norm(&exact_rest(self.b, maps));
        let (excess, capped, cost) = self.excess(weight, &y, &exact, &forces);
        let lower = self.lower(&y, &forces);
        let lower = if distance > 0.0 { lower.clamp(0.0, distance) } else { 0.0 };
        Point { y, proof: y, forces, exact, excess, cost, capped, distance, lower }
    }

    /// The share up to which a bound holds.
    fn top(&self, i: usize, largest: f64) -> f64 {
        let high = self.bounds[i].1;
        if high.is_finite() { high } else { self.projection.strongest(largest, self.size) }
    }

    /// No forces leave less of `b` than this.
    pub(super) fn lower(&self, y: &Vector<D>, forces: &ContactForces) -> f64 {
        let (largest, _) = forces.totals();
        let mut along = dot(&self.target.map(DoubleDouble::from), y);
        for (i, contact) in self.dual.contacts.iter().enumerate() {
            let reach = contact.furthest(&contact.pull(y)).times(contact.unit);
            let zero = DoubleDouble::ZERO;
            along -= reach.times(if reach > zero { self.top(i, largest) } else { self.bounds[i].0 });
        }
        let square = self.dual.slack.map_or(DoubleDouble::ZERO, |slack| {
            dot(
                &(0..D).fold(Vector::repeat(DoubleDouble::ZERO), |sum, c| {
                    sum + slack.column(c).map(|x| y[c].times(x))
                }),
                y,
            )
        });
        if square > DoubleDouble::ZERO { (along / square.sqrt()).value() } else { 0.0 }
    }

    /// How far the cost of the forces is above what `y` proves, over all forces and over those up to the cap, and the cost,
    /// all times the weight.
    pub(super) fn excess(
        &self,
        weight: f64,
        y: &Vector<D>,
        exact: &[Force<DoubleDouble>],
        forces: &ContactForces,
    ) -> (f64, f64, f64) {
        let mismatch = self.mismatch(y, exact);
        let Cost::Shares { of_sum, max } = self.cost else { return (mismatch, mismatch, 0.0) };
        let zero = DoubleDouble::ZERO;
        let (largest, sum) = forces.totals();
        let own = weight * (of_sum * sum + if max { largest } else { 0.0 });
        let least = self.bounds.iter().map(|(low, _)| *low).fold(0.0, f64::max);
        let (mut along, mut capped, mut most, mut most_at_least) = (zero, zero, zero, zero);
        for (i, (contact, force)) in self.dual.contacts.iter().zip(exact).enumerate() {
            let h = contact.pull(y);
            along += dot(&h, force) - DoubleDouble::from(weight * of_sum * forces.shares[i]);
            let gain = contact.furthest(&h).times(contact.unit) - DoubleDouble::from(weight * of_sum);
            let (low, top) = (self.bounds[i].0, self.top(i, largest));
            capped += gain.times(if gain > zero {
                contact.bounds().1.min(top * contact.unit) / contact.unit
            } else {
                low
            });
            most += gain.times(if gain > zero { top } else { low });
            most_at_least += gain.times(if gain > zero { least.min(top) } else { low });
        }
        let mut excess = most - along;
        if max {
            // At the largest cap, or at the smallest one.
            let top = (0..exact.len()).map(|i| self.top(i, largest)).fold(0.0, f64::max);
            let highest = most - DoubleDouble::from(weight).times(top);
            let lowest = most_at_least - DoubleDouble::from(weight).times(least);
            let reach = if highest > lowest { highest } else { lowest };
            excess = reach + DoubleDouble::from(weight).times(largest) - along;
        }
        (excess.value() + mismatch, (capped - along).value() + mismatch, own)
    }

    /// Half the square of what the residual is away from that of the multiplier.
    fn mismatch(&self, y: &Vector<D>, exact: &[Force<DoubleDouble>]) -> f64 {
        let mut rest = -self.target.map(DoubleDouble::from);
        for (contact, force) in self.dual.contacts.iter().zip(exact) {
            rest += contact.wrench(force);
        }
        if let Some(slack) = &self.dual.slack {
            (0..D).for_each(|c| rest += slack.column(c).map(|x| y[c].times(x)));
        }
        let rest = values(&rest).zip_map(&self.dual.whitening.map.diagonal(), |x, unit| x / unit);
        0.5 * self.projection.metric.norm(&rest).powi(2)
    }
}
