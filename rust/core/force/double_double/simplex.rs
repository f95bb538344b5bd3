//! The simplex method in 32 digits, with a price on what stays unbalanced.
//!
//! Nearly degenerate grasps (feet whose heights differ by rounding, loads through the edge of their support) make
//! bases of columns that differ by a billionth. Therefore the imbalance `s` is a variable of each row, at a price:
//! `min c . alpha + price |s|_1` subject to `P alpha + s = b`. Multipliers are then no larger than the price. The price
//! starts low and rises until `s` is rounding. At the last price `s` may reach the feasibility tolerance. If that does
//! not suffice, the least possible `|s|_1` is computed. The multiplier that proves it is the witness of infeasibility.

use crate::force::double_double::columns::{DoubleDoubleColumns, ROWS, Vector};
use crate::force::double_double::solution::{Member, Solution};
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{CONE_SEPARATED, FEASIBILITY_TOLERANCE, ROUNDED_WRENCH, SMALLEST_PIVOTS_32_DIGITS};

/// Pivots after which a solve ends without an answer.
const MAX_PIVOTS: usize = 3000;

/// Pivots of one price after which ties in the ratio test are decided so that no cycle is possible.
const LEXICOGRAPHIC_AFTER: usize = 60;

/// Prices of what is left over, relative to a wrench of unit size and the cost of one contact.
pub(crate) const FIRST_PRICE: f64 = 1e3;
const LAST_PRICE: f64 = 1e9;
const HIGHEST_PRICE: f64 = 1e16;
const HIGHEST_PRICE_OF_CONES: f64 = 1e20;

/// The price of combinations that are not convex: no solution keeps them.
const CONVEXITY_PRICE: f64 = 1e25;

/// How a solve ended.
#[derive(Debug)]
pub(crate) enum Outcome {
    /// Least forces for a wrench that differs from the given one by no more than the tolerance.
    Balanced,
    /// No forces come within the tolerance; the multiplier proves it.
    Infeasible,
    /// The pivot bound was reached, or an interrupt.
    Stalled,
}

/// Basis, levels and multipliers.
#[derive(Debug)]
pub(crate) struct DoubleDoubleSimplex<'a> {
    pub(crate) columns: &'a DoubleDoubleColumns,
    pub(crate) target: Vector,
    smallest_pivot: f64,
    pub(crate) solution: Solution,
    inverse: [Vector; ROWS],
    pub(crate) pivots: usize,
}

pub(crate) fn inner(a: &Vector, b: &Vector) -> DoubleDouble {
    a.iter().zip(b).fold(DoubleDouble::ZERO, |sum, (a, b)| sum + *a * *b)
}

impl<'a> DoubleDoubleSimplex<'a> {
    /// `target` is scaled to a largest component of one.
    pub(crate) fn new(columns: &'a DoubleDoubleColumns, target: &[f64]) -> Self {
        let mut simplex = Self {
            columns,
            target: [DoubleDouble::ZERO; ROWS],
            smallest_pivot: 0.0,
            solution: Solution {
                members: Vec::with_capacity(ROWS),
                levels: vec![DoubleDouble::ZERO; columns.rows()],
                multiplier: [DoubleDouble::ZERO; ROWS],
                dim: columns.dim,
            },
            inverse: [[DoubleDouble::ZERO; ROWS]; ROWS],
            pivots: 0,
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
            if self.solution.is_accurate(&self.target) || interrupt::stopped() {
                return outcome;
            }
        }
        Outcome::Stalled
    }

    /// The basis of slacks.
    fn start(&mut self) {
        self.solution.members.clear();
        self.inverse = [[DoubleDouble::ZERO; ROWS]; ROWS];
        for row in 0..self.columns.rows() {
            let level = self.target[row];
            let sign = if level < DoubleDouble::ZERO { -1.0 } else { 1.0 };
            self.solution.members.push(Member::Slack(row, sign));
            self.inverse[row][row] = DoubleDouble::from(sign);
            self.solution.levels[row] = level.abs();
        }
    }

    /// Raises the price until the answer is clear.
    fn solve_from_nothing(&mut self) -> Outcome {
        let unit = self.columns.unit();
        let mut price = FIRST_PRICE * unit;
        let mut within = None;
        loop {
            let solved = self.minimise(Some(price));
            let left = self.solution.left_over();
            let highest = LAST_PRICE * self.solution.objective().value().max(unit);
            let last = price >= highest;
            let balanced = solved && left <= if last { FEASIBILITY_TOLERANCE } else { ROUNDED_WRENCH };
            if !solved || balanced {
                if let Some(known) = within
                    && !(balanced && self.solution.is_accurate(&self.target))
                {
                    // The forces of a lower price are optimal for a wrench within the tolerance.
                    (self.solution, self.inverse) = known;
                    return Outcome::Balanced;
                }
                return if balanced { Outcome::Balanced } else { Outcome::Stalled };
            }
            if last {
                break;
            }
            if left <= FEASIBILITY_TOLERANCE && self.solution.is_accurate(&self.target) {
                within = Some((self.solution.clone(), self.inverse));
            }
            price = (price * 1e3).min(highest);
        }
        if self.columns.is_finite() {
            // A price bounds the forces; without one, edges that differ by rounding would balance by immense ones.
            return self.raise(price);
        }
        if !self.minimise(None) {
            return Outcome::Stalled;
        }
        if self.solution.left_over() > FEASIBILITY_TOLERANCE {
            return Outcome::Infeasible;
        }
        self.raise(price)
    }

    /// Raises the price until no more than the tolerance is left over, or until the multiplier is a witness: a wrench
    /// of unit size then reaches along it by no more than rounding.
    fn raise(&mut self, mut price: f64) -> Outcome {
        let highest = if self.columns.is_finite() { HIGHEST_PRICE } else { HIGHEST_PRICE_OF_CONES };
        loop {
            if !self.minimise(Some(price)) {
                return Outcome::Stalled;
            }
            if self.solution.left_over() <= FEASIBILITY_TOLERANCE {
                return Outcome::Balanced;
            }
            if price >= highest * self.columns.unit() {
                return Outcome::Infeasible;
            }
            price *= 1e3;
        }
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
    pub(crate) fn minimise(&mut self, price: Option<f64>) -> bool {
        let rows = self.columns.rows();
        let mut z = [DoubleDouble::ZERO; ROWS];
        for (row, member) in self.solution.members.iter().enumerate() {
            let cost = self.cost(member, price);
            z.iter_mut().zip(&self.inverse[row]).for_each(|(z, x)| *z += cost * *x);
        }
        // A witness must separate up to rounding; an objective is the least up to its tolerance.
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
                self.solution.multiplier = z;
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
            self.solution.members[row] = entering;
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
            let ratio = self.solution.levels[row].max(DoubleDouble::ZERO) / direction[row];
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
        for (own, level) in self.solution.levels.iter_mut().zip(levels) {
            *own = if level.abs() <= zero { DoubleDouble::ZERO } else { level };
        }
        self.pivots += 1;
    }
}
