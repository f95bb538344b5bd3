//! What the columns of the force distribution program cost, and how the best of them is asked for.
//!
//! Both objectives are one linear program, `min sum_j c_j alpha_j` subject to `sum_j p_j alpha_j = -w_ext`,
//! `alpha >= 0` (Eqs. 24 and 26), whose columns `p_j` are the points of a wrench set. For the maximum there
//! are `prod(l_i + 1) - 1` of them, but the column with the best reduced cost is one support query: contact
//! by contact the best extreme force, left out where it would not help.

use nalgebra::SVector;

use crate::tolerances::{ROUNDED_COST, ROUNDED_GAIN, TIED_COST, TIED_GAIN};
use crate::wrench_set::Criterion;

/// Marks a contact that a column does not use.
pub(crate) const UNUSED: u32 = u32::MAX;

/// A point of the wrench set with its two costs: the objective's, and the number of contacts that breaks
/// ties of the maximum.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column<const R: usize> {
    pub(crate) wrench: SVector<f64, R>,
    pub(crate) costs: [f64; 2],
    /// Where it was priced, for columns that are not made of listed edges.
    pub(crate) direction: SVector<f64, R>,
}

/// Where the simplex finds its columns.
pub(crate) trait Pricing<const R: usize> {
    /// The column that maximises `p . z - discount c`; writes which edge of each contact it uses.
    ///
    /// `discount` is 1 for reduced costs, and 0 in the first phase, where columns are free.
    fn furthest(&self, z: &SVector<f64, R>, discount: f64, edges: &mut [u32]) -> Column<R>;

    /// Among columns whose first reduced cost vanishes (to `tolerance`), the one that maximises the second,
    /// or `None` where the second cost does not exist.
    fn tie_break(
        &self,
        multipliers: &[SVector<f64, R>; 2],
        tolerance: f64,
        edges: &mut [u32],
    ) -> Option<Column<R>>;

    /// Reduced costs below this are no improvement.
    fn optimality(&self) -> f64;
}

/// Columns of this reduced cost or less optimise the objective, as far as multipliers of this size tell.
pub(crate) fn tied_cost<const R: usize>(z: &SVector<f64, R>) -> f64 {
    TIED_COST.max(ROUNDED_COST * z.lp_norm(1))
}

/// Tied columns that gain less than this are no improvement of the tie-break.
pub(crate) fn tied_gain<const R: usize>(z: &SVector<f64, R>) -> f64 {
    TIED_GAIN.max(ROUNDED_GAIN * z.lp_norm(1))
}

/// What a column costs and how contacts combine to one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Objective {
    /// One contact a column, cost 1: the sum of normalised normal forces.
    Sum,
    /// Any contacts, cost 1, ties broken by their number: the maximum, then the sum.
    MaxThenSum,
    /// Any k contacts, cost `1 + weight k`: the maximum plus `weight` times the sum.
    Weighted(f64),
}

impl Objective {
    pub(crate) fn new(criterion: Criterion, weight: f64) -> Self {
        match criterion {
            Criterion::Sum => Self::Sum,
            Criterion::Max if weight > 0.0 => Self::Weighted(weight),
            Criterion::Max => Self::MaxThenSum,
        }
    }

    /// What each contact adds to the cost of a column.
    pub(crate) fn weight(self) -> f64 {
        if let Self::Weighted(weight) = self { weight } else { 0.0 }
    }

    /// The value of the objective from normalised normal forces.
    pub(crate) fn value(self, largest: f64, sum: f64) -> f64 {
        match self {
            Self::Sum => sum,
            Self::MaxThenSum => largest,
            Self::Weighted(weight) => largest + weight * sum,
        }
    }

    /// The support function of the columns, from how far each contact alone reaches beyond its weight.
    pub(crate) fn support(self, values: impl Iterator<Item = f64>) -> f64 {
        match self {
            Self::Sum => values.fold(0.0, f64::max),
            _ => values.map(|h| h.max(0.0)).sum(),
        }
    }

    /// How much too far a multiplier reaches, from how far each contact alone does: divided by this, it prices one
    /// column at its cost and none above. With a weight that is the root of `sum_i max(0, h_i / r - weight) = 1`.
    pub(crate) fn reach(self, values: impl Iterator<Item = f64> + Clone) -> f64 {
        let Self::Weighted(weight) = self else { return self.support(values) };
        let mut reach = 0.0;
        loop {
            // Newton's method from below; contacts only leave, so it ends.
            let pressing = values.clone().filter(|h| *h > weight * reach);
            let (sum, count) = pressing.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
            let next = sum / (1.0 + weight * count);
            if next.is_nan() || next <= reach {
                return reach;
            }
            reach = next;
        }
    }

    /// The cost of a column that uses one contact: what is small beside it is nothing.
    pub(crate) fn unit(self) -> f64 {
        1.0 + self.weight()
    }

    pub(crate) fn costs(self, contacts: usize) -> [f64; 2] {
        match self {
            Self::Sum => [1.0, 0.0],
            Self::MaxThenSum => [1.0, contacts as f64],
            Self::Weighted(weight) => [1.0 + weight * contacts as f64, 0.0],
        }
    }
}
