//! What a basis says: columns at their levels, and what they leave over of the wrench.

use crate::force::double_double::columns::{Point, ROWS, Share, Vector};
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::ROUNDED_BASIS;

/// What a row of the basis holds.
#[derive(Debug, Clone)]
pub(crate) enum Member {
    /// What is left over in a row, with its sign.
    Slack(usize, f64),
    Point(Point),
}

/// Columns with their levels and the multipliers that prove them least.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub(crate) members: Vec<Member>,
    pub(crate) levels: Vec<DoubleDouble>,
    pub(crate) multiplier: Vector,
    /// Rows of the wrench.
    pub(crate) dim: usize,
}

impl Solution {
    fn entries(&self) -> impl Iterator<Item = (&Member, DoubleDouble)> {
        self.members.iter().zip(self.levels.iter().copied())
    }

    /// The objective of the forces, what is left over not counted.
    pub(crate) fn objective(&self) -> DoubleDouble {
        let cost = |(member, level): (&Member, DoubleDouble)| match member {
            Member::Point(point) => point.cost * level,
            Member::Slack(..) => DoubleDouble::ZERO,
        };
        self.entries().map(cost).fold(DoubleDouble::ZERO, |sum, cost| sum + cost)
    }

    /// What is left over of the wrench, component by component added up.
    pub(crate) fn left_over(&self) -> f64 {
        let slack = |(member, level): (&Member, DoubleDouble)| match member {
            Member::Slack(row, _) if *row < self.dim => level.value().abs(),
            _ => 0.0,
        };
        self.entries().map(slack).sum()
    }

    /// What is left over, row by row.
    pub(crate) fn slack(&self) -> [f64; ROWS] {
        let mut rest = [0.0; ROWS];
        for (member, level) in self.entries() {
            if let Member::Slack(row, sign) = member {
                rest[*row] += sign * level.value();
            }
        }
        rest
    }

    /// The largest normalised normal force of so many contacts.
    pub(crate) fn largest_share(&self, contacts: usize) -> DoubleDouble {
        let mut totals = vec![DoubleDouble::ZERO; contacts];
        for (member, level) in self.entries() {
            if let Member::Point(point) = member {
                point.shares.iter().for_each(|share| totals[share.contact] += level.times(share.normal));
            }
        }
        totals.into_iter().fold(DoubleDouble::ZERO, DoubleDouble::max)
    }

    /// What each contact contributes, with the level of its column.
    pub(crate) fn shares(&self) -> impl Iterator<Item = (f64, &Share)> {
        self.entries().flat_map(|(member, level)| {
            let shares = match member {
                Member::Point(point) => point.shares.as_slice(),
                Member::Slack(..) => &[],
            };
            shares.iter().map(move |share| (level.value().max(0.0), share))
        })
    }

    /// Whether the columns at their levels add up to the target, and none is negative: a pivot element of rounding makes
    /// a level of any size out of one of zero.
    pub(crate) fn is_accurate(&self, target: &Vector) -> bool {
        let mut rest = *target;
        for (member, level) in self.entries() {
            match member {
                Member::Point(point) => {
                    rest.iter_mut().zip(&point.wrench).for_each(|(rest, w)| *rest -= *w * level);
                }
                Member::Slack(row, sign) => rest[*row] -= level.times(*sign),
            }
        }
        let largest = self.levels.iter().fold(1.0_f64, |largest, level| largest.max(level.value().abs()));
        let rounded = ROUNDED_BASIS * largest;
        rest.iter().all(|rest| rest.value().abs() <= rounded)
            && self.levels.iter().all(|level| level.value() >= -rounded)
    }
}
