//! The simplex method in 32 digits, with a price on what stays unbalanced.
//!
//! Nearly degenerate grasps (feet whose heights differ by rounding, loads through the edge of their support) make
//! bases of columns that differ by a billionth. Therefore the imbalance `s` is a variable of each row, at a price:
//! `min c . alpha + price |s|_1` subject to `P alpha + s = b`. Multipliers are then no larger than the price. The price
//! starts low and rises until `s` is rounding. At the last price `s` may reach the feasibility tolerance. If that does
//! not suffice, the least possible `|s|_1` is computed. The multiplier that proves it is the witness of infeasibility.

use crate::force::double_double::columns::{DoubleDoubleColumns, Point, ROWS, Share, Vector};
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{
    CONE_SEPARATED, FEASIBILITY_TOLERANCE, LARGEST_OBJECTIVE, ROUNDED_BASIS, ROUNDED_WRENCH,
    SMALLEST_PIVOTS_32_DIGITS,
};

/// Pivots after which a solve gives up.
const MAX_PIVOTS: usize = 3000;

/// Pivots of one price after which ties in the ratio test are decided so that no cycle is possible.
const LEXICOGRAPHIC_AFTER: usize = 60;

/// Prices of what is left over, relative to a wrench and an objective of one.
const FIRST_PRICE: f64 = 1e3;
const LAST_PRICE: f64 = 1e9;
const HIGHEST_PRICE: f64 = 1e16;
const HIGHEST_PRICE_OF_CONES: f64 = 1e20;

/// The lowest price is known up to this factor.
const LOWERED_PRICE: f64 = 1.01;

/// The price of combinations that are not convex: no solution keeps them.
const CONVEXITY_PRICE: f64 = 1e25;

/// How a solve ended.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// Least forces for a wrench that differs from the given one by no more than the tolerance.
    Balanced,
    /// No forces come within the tolerance; the multiplier proves it.
    Infeasible(Vector),
    /// The pivot bound was reached, or an interrupt.
    Stalled,
}

/// What a row of the basis holds.
#[derive(Debug, Clone)]
enum Member {
    /// What is left over in a row, with its sign.
    Slack(usize, f64),
    Point(Point),
}

/// Basis, levels and multipliers.
#[derive(Debug)]
pub(crate) struct DoubleDoubleSimplex<'a> {
    columns: &'a DoubleDoubleColumns,
    target: Vector,
    smallest_pivot: f64,
    members: Vec<Member>,
    inverse: [Vector; ROWS],
    levels: Vector,
    pub(crate) multiplier: Vector,
    pub(crate) pivots: usize,
    /// The highest price at which more than the tolerance was left over, from the last price on, with its multiplier.
    separates: Option<(f64, Vector)>,
    /// The price of the last solution.
    price: f64,
}

fn inner(a: &Vector, b: &Vector) -> DoubleDouble {
    a.iter().zip(b).fold(DoubleDouble::ZERO, |sum, (a, b)| sum + *a * *b)
}

impl<'a> DoubleDoubleSimplex<'a> {
    /// `target` is scaled to a largest component of one.
    pub(crate) fn new(columns: &'a DoubleDoubleColumns, target: &[f64]) -> Self {
        let mut simplex = Self {
            columns,
            target: [DoubleDouble::ZERO; ROWS],
            smallest_pivot: 0.0,
            members: Vec::with_capacity(ROWS),
            inverse: [[DoubleDouble::ZERO; ROWS]; ROWS],
            levels: [DoubleDouble::ZERO; ROWS],
            multiplier: [DoubleDouble::ZERO; ROWS],
            pivots: 0,
            separates: None,
            price: FIRST_PRICE,
        };
        for (row, &level) in target.iter().enumerate().take(columns.rows()) {
            simplex.target[row] = DoubleDouble::from(level);
        }
        simplex
    }

    /// Starts from nothing; where small pivot elements wore the inverse out, it starts again without them.
    pub(crate) fn solve(&mut self) -> Outcome {
        for smallest_pivot in SMALLEST_PIVOTS_32_DIGITS {
            self.smallest_pivot = smallest_pivot;
            self.start();
            let outcome = self.solve_from_nothing();
            if self.is_accurate() || interrupt::stopped() {
                return outcome;
            }
        }
        Outcome::Stalled
    }

    /// The basis of slacks.
    fn start(&mut self) {
        self.members.clear();
        self.separates = None;
        self.inverse = [[DoubleDouble::ZERO; ROWS]; ROWS];
        for row in 0..self.columns.rows() {
            let level = self.target[row];
            let sign = if level < DoubleDouble::ZERO { -1.0 } else { 1.0 };
            self.members.push(Member::Slack(row, sign));
            self.inverse[row][row] = DoubleDouble::from(sign);
            self.levels[row] = level.abs();
        }
    }

    /// Whether the columns at their levels add up to the target, and none is negative: a pivot element of rounding makes
    /// a level of any size out of one of zero.
    fn is_accurate(&self) -> bool {
        let mut rest = self.target;
        for (member, level) in self.members.iter().zip(&self.levels) {
            match member {
                Member::Point(point) => {
                    rest.iter_mut().zip(&point.wrench).for_each(|(rest, w)| *rest -= *w * *level);
                }
                Member::Slack(row, sign) => rest[*row] -= level.times(*sign),
            }
        }
        let largest = self.levels.iter().fold(1.0_f64, |largest, level| largest.max(level.value().abs()));
        let rounded = ROUNDED_BASIS * largest;
        rest.iter().all(|rest| rest.value().abs() <= rounded)
            && self.levels.iter().all(|level| level.value() >= -rounded)
    }

    /// Raises the price until the answer is clear.
    fn solve_from_nothing(&mut self) -> Outcome {
        let mut price = FIRST_PRICE;
        loop {
            if !self.minimise(Some(price)) {
                return Outcome::Stalled;
            }
            let left = self.left_over();
            let highest = LAST_PRICE * self.objective().max(1.0);
            let last = price >= highest;
            if left <= if last { FEASIBILITY_TOLERANCE } else { ROUNDED_WRENCH } {
                return Outcome::Balanced;
            }
            if last {
                break;
            }
            price = (price * 1e3).min(highest);
        }
        self.separates = Some((price, self.multiplier));
        if self.columns.is_finite() {
            // A price bounds the forces; without one, edges that differ by rounding would balance by immense ones.
            return self.raise(price);
        }
        if !self.minimise(None) {
            return Outcome::Stalled;
        }
        if self.left_over() > FEASIBILITY_TOLERANCE {
            return Outcome::Infeasible(self.multiplier);
        }
        self.raise(price)
    }

    /// Raises the price until no more than the tolerance is left over, or until the multiplier is a witness: a wrench
    /// of unit size then reaches along it by no more than rounding.
    fn raise(&mut self, mut price: f64) -> Outcome {
        loop {
            if !self.minimise(Some(price)) {
                return Outcome::Stalled;
            }
            if self.left_over() <= FEASIBILITY_TOLERANCE {
                return Outcome::Balanced;
            }
            if self.columns.is_finite() {
                self.separates = Some((price, self.multiplier));
                if price >= HIGHEST_PRICE {
                    return Outcome::Infeasible(self.multiplier);
                }
            } else if price > HIGHEST_PRICE_OF_CONES {
                return Outcome::Balanced;
            }
            price *= 1e3;
        }
    }

    /// Lowers the price as far as no more than the tolerance is left over: the forces are then no larger than they need
    /// to be. `false` where no price left more, or where a solve did not end.
    pub(crate) fn lower_price(&mut self) -> bool {
        let Some((mut low, mut witness)) = self.separates else { return false };
        let mut high = self.price;
        while high > LOWERED_PRICE * low {
            let between = (low * high).sqrt();
            if !self.minimise(Some(between)) {
                return false;
            }
            if self.left_over() > FEASIBILITY_TOLERANCE {
                (low, witness) = (between, self.multiplier);
            } else {
                high = between;
            }
        }
        self.separates = Some((low, witness));
        self.minimise(Some(high)) && self.is_accurate()
    }

    /// The multiplier below the lowest price, if no forces of an objective up to [`LARGEST_OBJECTIVE`] reach within the
    /// tolerance of the target along it. With `p(z) <= 1`, such forces reach by their objective at most.
    pub(crate) fn witness(&self) -> Option<Vector> {
        let (price, z) = self.separates?;
        let margin = (inner(&z, &self.target).value() - LARGEST_OBJECTIVE) / price;
        (margin > FEASIBILITY_TOLERANCE).then_some(z)
    }

    /// The objective of the forces, what is left over not counted.
    pub(crate) fn objective(&self) -> f64 {
        let cost = |(member, level): (&Member, &DoubleDouble)| match member {
            Member::Point(point) => (point.cost * *level).value(),
            Member::Slack(..) => 0.0,
        };
        self.members.iter().zip(&self.levels).map(cost).sum()
    }

    /// What is left over of the wrench, component by component added up.
    pub(crate) fn left_over(&self) -> f64 {
        let wrench = |row: usize| row < self.columns.dim;
        let slack = |(member, level): (&Member, &DoubleDouble)| match member {
            Member::Slack(row, _) if wrench(*row) => level.value().abs(),
            _ => 0.0,
        };
        self.members.iter().zip(&self.levels).map(slack).sum()
    }

    /// What is left over, row by row.
    pub(crate) fn slack(&self) -> [f64; ROWS] {
        let mut rest = [0.0; ROWS];
        for (member, level) in self.members.iter().zip(&self.levels) {
            if let Member::Slack(row, sign) = member {
                rest[*row] += sign * level.value();
            }
        }
        rest
    }

    /// The largest normalised normal force.
    pub(crate) fn largest_share(&self) -> DoubleDouble {
        let mut totals = vec![DoubleDouble::ZERO; self.columns.num_contacts()];
        for (member, level) in self.members.iter().zip(&self.levels) {
            if let Member::Point(point) = member {
                point.shares.iter().for_each(|share| totals[share.contact] += level.times(share.normal));
            }
        }
        totals.into_iter().fold(DoubleDouble::ZERO, DoubleDouble::max)
    }

    /// The forces of the basis: what each contact contributes, with the level of its column.
    pub(crate) fn shares(&self) -> impl Iterator<Item = (f64, &Share)> {
        self.members.iter().zip(&self.levels).flat_map(|(member, level)| {
            let shares = match member {
                Member::Point(point) => point.shares.as_slice(),
                Member::Slack(..) => &[],
            };
            shares.iter().map(|share| (level.value().max(0.0), share))
        })
    }

    fn cost(&self, member: &Member, price: Option<f64>) -> DoubleDouble {
        match (member, price) {
            (Member::Slack(row, _), Some(price)) => self.price(*row, price),
            (Member::Slack(..), None) => DoubleDouble::ONE,
            (Member::Point(point), Some(_)) => point.cost,
            (Member::Point(_), None) => DoubleDouble::ZERO,
        }
    }

    fn price(&self, row: usize, price: f64) -> DoubleDouble {
        DoubleDouble::from(if row < self.columns.dim { price } else { CONVEXITY_PRICE })
    }

    /// Optimal for this price; without one, what is left over alone is minimised. `false` if that cannot be reached.
    fn minimise(&mut self, price: Option<f64>) -> bool {
        let rows = self.columns.rows();
        let mut z = [DoubleDouble::ZERO; ROWS];
        for (row, member) in self.members.iter().enumerate() {
            let cost = self.cost(member, price);
            z.iter_mut().zip(&self.inverse[row]).for_each(|(z, x)| *z += cost * *x);
        }
        // A witness must separate up to rounding; an objective is the least up to its tolerance.
        self.price = price.unwrap_or(f64::INFINITY);
        let threshold =
            if price.is_some() { self.columns.threshold } else { self.columns.threshold.min(CONE_SEPARATED) };
        let first = self.pivots;
        while self.pivots < MAX_PIVOTS && !interrupt::stopped() {
            let Some((mut gain, point)) = self.columns.furthest(&z, price.is_some()) else { return false };
            let size = z.iter().map(|x| x.abs().value()).sum::<f64>();
            let mut entering = Member::Point(point);
            let mut beaten = gain <= DoubleDouble::from(threshold.max(1e-27 * size));
            for (row, multiplier) in z.iter().enumerate().take(rows) {
                let cost = self.cost(&Member::Slack(row, 1.0), price);
                let excess = multiplier.abs() - cost;
                if excess > DoubleDouble::from(1e-27 * size) && (beaten || excess > gain) {
                    let sign = if multiplier.value() < 0.0 { -1.0 } else { 1.0 };
                    (gain, entering, beaten) = (excess, Member::Slack(row, sign), false);
                }
            }
            if beaten {
                self.multiplier = z;
                return true;
            }
            let column = match &entering {
                Member::Point(point) => point.wrench,
                Member::Slack(row, sign) => {
                    let mut column = [DoubleDouble::ZERO; ROWS];
                    column[*row] = DoubleDouble::from(*sign);
                    column
                }
            };
            let mut direction = [DoubleDouble::ZERO; ROWS];
            direction.iter_mut().zip(&self.inverse).take(rows).for_each(|(x, row)| *x = inner(row, &column));
            let Some(row) = self.leaving_row(&direction, self.pivots - first > LEXICOGRAPHIC_AFTER) else {
                return false;
            };
            self.pivot(row, &direction);
            self.members[row] = entering;
            for (z, x) in z.iter_mut().zip(&self.inverse[row]) {
                *z -= gain * *x;
            }
        }
        false
    }

    /// The ratio test: the largest pivot element among ties, or the lexicographic rule.
    fn leaving_row(&self, direction: &Vector, lexicographic: bool) -> Option<usize> {
        let rows = self.columns.rows();
        let largest = direction.iter().fold(DoubleDouble::ZERO, |a, b| a.max(b.abs()));
        let smallest = largest.times(self.smallest_pivot);
        let mut best: Option<(usize, DoubleDouble)> = None;
        for row in (0..rows).filter(|&row| direction[row] > smallest) {
            let ratio = self.levels[row].max(DoubleDouble::ZERO) / direction[row];
            let better = match best {
                None => true,
                Some((other, least)) if ratio == least => {
                    if lexicographic {
                        self.precedes(row, other, direction)
                    } else {
                        direction[row] > direction[other]
                    }
                }
                Some((_, least)) => ratio < least,
            };
            if better {
                best = Some((row, ratio));
            }
        }
        best.map(|(row, _)| row)
    }

    fn precedes(&self, row: usize, other: usize, direction: &Vector) -> bool {
        let pairs = self.inverse[row].iter().zip(&self.inverse[other]);
        let first = pairs.map(|(a, b)| (*a / direction[row], *b / direction[other])).find(|(a, b)| a != b);
        first.is_some_and(|(a, b)| a < b)
    }

    fn pivot(&mut self, row: usize, direction: &Vector) {
        let rows = self.columns.rows();
        let leaving = self.inverse[row].map(|x| x / direction[row]);
        for other in (0..rows).filter(|&other| other != row) {
            for (x, y) in self.inverse[other].iter_mut().zip(&leaving) {
                *x -= direction[other] * *y;
            }
        }
        self.inverse[row] = leaving;
        // Levels afresh, so that they carry no history; what is zero but for rounding is zero.
        let levels = self.inverse.map(|x| inner(&x, &self.target));
        let largest = levels.iter().fold(DoubleDouble::ZERO, |a, b| a.max(b.abs()));
        let zero = largest.times(1e-28);
        self.levels = levels.map(|level| if level.abs() <= zero { DoubleDouble::ZERO } else { level });
        self.pivots += 1;
    }
}
