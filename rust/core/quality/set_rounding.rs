//! What rounding may have done to the wrench set of a query, put together from its contacts.

use crate::convex::rounding::{Rounding, along};
use crate::grasp::Wrench;
use crate::quality::query::QualityQuery;
use crate::wrench_set::Criterion;

/// What rounding has done to the union, or to the Minkowski sum, about a center or not.
pub(crate) struct SetRounding<'a, const D: usize> {
    pub(crate) query: &'a QualityQuery<'a, D>,
    pub(crate) criterion: Criterion,
}

impl<const D: usize> Rounding<D> for SetRounding<'_, D> {
    fn of_any_point(&self) -> Wrench<D> {
        let (contacts, center) = self.query.rounding();
        let all = match self.criterion {
            Criterion::Max => contacts.iter().sum(),
            Criterion::Sum => contacts.iter().fold(Wrench::zeros(), |all: Wrench<D>, lost| all.sup(lost)),
        };
        all + center
    }

    fn of_support(&self, z: &Wrench<D>) -> (f64, Wrench<D>) {
        let (contacts, center) = self.query.rounding();
        // The best contact, and the sum of those that push: as computed, and with what rounding may have taken.
        let (mut best, mut sum) =
            ((f64::NEG_INFINITY, f64::NEG_INFINITY, center), (0.0, 0.0, Wrench::zeros()));
        for (i, lost) in contacts.iter().enumerate() {
            let value = self.query.set.contact_value(i, z);
            let at_most = value + along(z, lost);
            best.1 = at_most.max(best.1);
            if value > best.0 {
                (best.0, best.2) = (value, lost);
            }
            if value > 0.0 {
                sum.0 += value;
                sum.2 += lost;
            }
            sum.1 += at_most.max(0.0);
        }
        let sums = self.criterion == Criterion::Max;
        let value = if sums && sum.0 > 0.0 { sum.0 } else { best.0 };
        let at_most = if sums && sum.1 > 0.0 { sum.1 } else { best.1 };
        let uncertain = if sums && sum.0 > 0.0 { sum.2 } else { *best.2 };
        if self.query.center.is_none() {
            return (at_most - value, uncertain);
        }
        // About a center, the origin belongs to the set.
        (at_most.max(0.0) - value.max(0.0) + along(z, center), uncertain + center)
    }
}

impl<const D: usize> QualityQuery<'_, D> {
    /// What rounding may have done to each component of the set's points.
    pub(crate) fn uncertain(&self) -> Wrench<D> {
        SetRounding { query: self, criterion: self.set.criterion() }.of_any_point()
    }
}
