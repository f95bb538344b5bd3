//! How far along a horizontal direction may the centre of mass lie? A simplex with implicit columns.
//!
//! `max direction . place(w)` over the wrenches w of the contacts' set that fulfil the four equations of the [`Load`]. w is
//! a mixture of at most five points of the set: five equations, with the one that shares add up to 1. Whichever
//! multipliers y the basis has, one call of the support oracle bounds the answer from above,
//!
//! `direction . place(w) <= p(z) + y . demand` with `z . w = direction . place(w) - y . equations(w)`,
//!
//! and the mixture itself bounds it from below. The same basis is optimal, or nearly so, for the next direction.

use nalgebra::{SMatrix, SVector, Vector4};

use super::HorizontalPoint as Point;
use super::load::Load;
use super::newton::{Along, Newton, Optimum, join};
use crate::error::{Error, Result, Unmet};
use crate::grasp::Wrench;
use crate::interrupt;
use crate::tolerances::FEASIBILITY_TOLERANCE;
use crate::wrench_set::WrenchSet;

/// Equations: four of the load, one of the shares.
const ROWS: usize = 5;

/// Pivots of one direction; linearised cones take about five, true cones some dozens.
const MAX_PIVOTS: usize = 400;

/// Pivots between two inverses from nothing.
const REFACTORISE: usize = 40;

/// Balance that is off by this is rounded as well as it can be.
const ROUNDED_SHARES: f64 = 1e-13;

/// Refinements of the shares, each with an inverse from nothing.
const MAX_REFINEMENTS: usize = 3;

/// Entries below this share of a column's largest are rounding, and no pivots.
const LEAST_PIVOT: f64 = 1e-11;

/// Ratios that differ by less are equal, and decided by the next row of the lexicographic order.
const EQUAL_RATIOS: f64 = 1e-13;

/// Rounding of a support, relative to the longest wrench of the set.
const ROUNDED_SUPPORT: f64 = 1e-13;

type Square = SMatrix<f64, ROWS, ROWS>;
type Rows = SVector<f64, ROWS>;

/// A point of the wrench set, or an artificial one that only the first phase may use.
#[derive(Debug, Clone, Copy)]
struct Column {
    rows: Rows,
    place: Point,
    /// The direction that it lies furthest along; zero of the origin.
    along: Along,
    artificial: bool,
}

/// The furthest place along a direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Furthest {
    /// A place where the contacts hold the body.
    pub place: Point,
    /// No place lies further along the direction.
    pub bound: f64,
    /// What the limits of the forces contribute to the bound: with twice of them it is no more than this larger.
    pub reached: f64,
}

/// A basis of points of the wrench set, kept from one direction to the next.
pub(super) struct Simplex<'a> {
    set: &'a WrenchSet<6>,
    load: &'a Load,
    columns: [Column; ROWS],
    inverse: Square,
    shares: Rows,
    right: Rows,
    pivots: usize,
    /// The last place whose forces balance.
    place: Point,
    /// What a support is rounded by, in units of the weight.
    rounding: f64,
}

/// Whether contacts hold the body anywhere.
pub(super) enum Start<'a> {
    /// They do.
    Feasible(Box<Simplex<'a>>),
    /// They do not: along z, a direction of scaled wrenches, the set reaches less far than any load demands.
    Empty { z: Wrench<6>, reach: f64 },
}

impl<'a> Simplex<'a> {
    /// The first phase: a basis that fulfils the equations.
    pub(super) fn start(set: &'a WrenchSet<6>, load: &'a Load) -> Result<Start<'a>> {
        let column = |row: usize| {
            let mut rows = Rows::zeros();
            rows[row] = if row < 4 && load.demand[row] < 0.0 { -1.0 } else { 1.0 };
            // The last is the origin, at which no contact presses.
            Column { rows, place: Point::zeros(), along: Along::zeros(), artificial: row < 4 }
        };
        let columns: [Column; ROWS] = std::array::from_fn(column);
        let right = Rows::from_fn(|row, _| if row < 4 { load.demand[row] } else { 1.0 });
        let rounding = ROUNDED_SUPPORT * (1.0 + set.longest());
        let identity = Square::from_fn(|row, at| if row == at { columns[at].rows[row] } else { 0.0 });
        let shares = right.abs();
        let (inverse, place) = (identity, Point::zeros());
        let mut simplex = Self { set, load, columns, inverse, shares, right, pivots: 0, place, rounding };
        for _ in 0..MAX_PIVOTS {
            interrupt::check()?;
            let missing = simplex.missing();
            if missing <= rounding {
                break;
            }
            let costs = Rows::from_fn(|at, _| -f64::from(u8::from(simplex.columns[at].artificial)));
            let (z, y, entering, reach) = simplex.price(&Point::zeros(), &costs);
            // p(z) < z . w for every w that fulfils the equations.
            let short = -y.fixed_rows::<4>(0).dot(&load.demand) - reach;
            if short > FEASIBILITY_TOLERANCE.max(rounding) * z.amax().max(1.0) {
                return Ok(Start::Empty { z, reach });
            }
            if reach - y[4] <= rounding || !simplex.exchange(&entering) {
                break;
            }
        }
        let found = simplex.missing();
        if found > FEASIBILITY_TOLERANCE.max(rounding) {
            let unmet = Unmet::Balance { found, allowed: FEASIBILITY_TOLERANCE };
            let solver = "support region";
            return Err(Error::NotConverged { solver, iterations: simplex.pivots, unmet });
        }
        // The rest is within the tolerance of balance: what the contacts do exert is now demanded.
        for (column, share) in simplex.columns.iter().zip(simplex.shares.iter_mut()) {
            if column.artificial {
                simplex.right -= column.rows * *share;
                *share = 0.0;
            }
        }
        simplex.place = simplex.mixture(|column| column.place);
        Ok(Start::Feasible(Box::new(simplex)))
    }

    /// By how much places are rounded.
    pub(super) fn rounding(&self) -> f64 {
        self.rounding
    }

    /// What artificial points still carry.
    fn missing(&self) -> f64 {
        let each = self.columns.iter().zip(self.shares.iter());
        each.filter(|(column, _)| column.artificial).map(|(_, share)| share.abs()).sum()
    }

    /// The furthest place along a unit direction, to within `enough` or as near as rounding allows.
    pub(super) fn furthest(&mut self, direction: &Point, enough: f64) -> Result<Furthest> {
        let enough = enough.max(self.rounding);
        let (mut bound, mut reached) = (f64::INFINITY, 0.0);
        for pivot in 0..MAX_PIVOTS {
            if pivot % 32 == 31 {
                interrupt::check()?;
            }
            let costs = Rows::from_fn(|at, _| direction.dot(&self.columns[at].place));
            let (z, y, entering, reach) = self.price(direction, &costs);
            let demanded = self.right.fixed_rows::<4>(0).dot(&y.fixed_rows::<4>(0));
            if reach + demanded < bound {
                // Less what rounding of the set explains.
                let unexplained = (reach - self.rounding * z.amax()).max(0.0);
                (bound, reached) = (reach + demanded, unexplained);
            }
            if reach - y[4] <= enough || !self.exchange(&entering) {
                break;
            }
        }
        if self.settle() {
            self.place = self.mixture(|column| column.place);
        }
        let place = self.place;
        Ok(Furthest { place, bound: bound.max(direction.dot(&place)), reached })
    }

    /// Adds up columns by their shares.
    fn mixture<const R: usize>(&self, of: impl Fn(&Column) -> SVector<f64, R>) -> SVector<f64, R> {
        let each = self.columns.iter().zip(self.shares.iter());
        each.fold(SVector::zeros(), |sum, (column, share)| sum + of(column) * *share)
    }

    /// Takes from the shares what rounding of the pivots left unbalanced; false where that is too much.
    fn settle(&mut self) -> bool {
        let nothing_artificial = |simplex: &mut Self| {
            for (column, share) in simplex.columns.iter().zip(simplex.shares.iter_mut()) {
                *share = if column.artificial { 0.0 } else { share.max(0.0) };
            }
        };
        nothing_artificial(self);
        for _ in 0..MAX_REFINEMENTS {
            let unbalanced = self.right - self.mixture(|column| column.rows);
            if unbalanced.amax() <= ROUNDED_SHARES {
                return true;
            }
            if let Some(inverse) = self.inverted() {
                self.inverse = inverse;
            }
            self.shares += self.inverse * unbalanced;
            nothing_artificial(self);
        }
        (self.right - self.mixture(|column| column.rows)).amax() <= 0.1 * FEASIBILITY_TOLERANCE
    }

    /// Newton's method from the basis of the last direction asked for.
    pub(super) fn polish(
        &self,
        newton: &mut Newton,
        direction: &Point,
        enough: f64,
    ) -> Option<(Furthest, Optimum)> {
        let costs = Rows::from_fn(|at, _| direction.dot(&self.columns[at].place));
        let y = self.inverse.tr_mul(&costs);
        let mixture =
            self.columns.iter().zip(self.shares.iter()).map(|(column, share)| (column.along, *share));
        newton.polish(direction, -y.fixed_rows::<4>(0), mixture, enough.max(self.rounding))
    }

    /// What the contacts have to balance.
    pub(super) fn demand(&self) -> Vector4<f64> {
        self.right.fixed_rows::<4>(0).into_owned()
    }

    /// The direction of the multipliers y, they themselves, and the point of the set (or the origin) furthest along it.
    fn price(&self, direction: &Point, costs: &Rows) -> (Wrench<6>, Rows, Column, f64) {
        let mut y = self.inverse.tr_mul(costs);
        // Columns that nearly coincide cost the inverse its digits.
        let missed = Rows::from_fn(|at, _| costs[at] - self.columns[at].rows.dot(&y));
        y += self.inverse.tr_mul(&missed);
        let multipliers: Vector4<f64> = y.fixed_rows::<4>(0).into_owned();
        let z = self.load.covector(direction, &multipliers);
        let support = self.set.support(&z);
        let (reach, wrench) =
            if support.value > 0.0 { (support.value, support.wrench) } else { (0.0, Wrench::zeros()) };
        let equations = self.load.equations(&wrench);
        let rows = Rows::from_fn(|row, _| if row < 4 { equations[row] } else { 1.0 });
        let along = if reach > 0.0 { join(&-multipliers, direction) } else { Along::zeros() };
        (z, y, Column { rows, place: self.load.place(&wrench), along, artificial: false }, reach)
    }

    /// Takes a column into the basis; false where rounding leaves no row for it.
    fn exchange(&mut self, entering: &Column) -> bool {
        let step = self.inverse * entering.rows;
        let least = LEAST_PIVOT * step.amax();
        let mut leaving: Option<usize> = None;
        // An artificial point that carries nothing leaves first: it must not carry anything again.
        let idle = |at: usize| self.columns[at].artificial && self.shares[at] <= 0.0 && step[at].abs() > 1e-9;
        let first = (0..ROWS).filter(|at| idle(*at)).max_by(|a, b| step[*a].abs().total_cmp(&step[*b].abs()));
        if let Some(at) = first {
            leaving = Some(at);
        } else {
            for at in (0..ROWS).filter(|at| step[*at] > least) {
                leaving = match leaving {
                    Some(best) if !self.leaves_before(at, best, &step) => Some(best),
                    _ => Some(at),
                };
            }
        }
        let Some(row) = leaving else { return false };
        let share = self.shares[row] / step[row];
        self.columns[row] = *entering;
        let pivot_row = self.inverse.row(row) / step[row];
        for at in (0..ROWS).filter(|at| *at != row) {
            let rest = self.inverse.row(at) - pivot_row * step[at];
            self.inverse.set_row(at, &rest);
            self.shares[at] = (self.shares[at] - share * step[at]).max(0.0);
        }
        self.inverse.set_row(row, &pivot_row);
        self.shares[row] = share.max(0.0);
        self.pivots += 1;
        !self.pivots.is_multiple_of(REFACTORISE) || self.refactorise()
    }

    /// The lexicographic ratio test, which excludes cycles.
    fn leaves_before(&self, at: usize, best: usize, step: &Rows) -> bool {
        let ratio = |row: usize, entry: f64| entry / step[row];
        let shares = ratio(at, self.shares[at]) - ratio(best, self.shares[best]);
        if shares.abs() > EQUAL_RATIOS {
            return shares < 0.0;
        }
        for column in 0..ROWS {
            let [one, other] = [at, best].map(|row| ratio(row, self.inverse[(row, column)]));
            if (one - other).abs() > EQUAL_RATIOS * (one.abs() + other.abs()) {
                return one < other;
            }
        }
        false
    }

    fn inverted(&self) -> Option<Square> {
        Square::from_fn(|row, at| self.columns[at].rows[row]).try_inverse()
    }

    /// Inverts the basis afresh; false where rounding has made it singular.
    fn refactorise(&mut self) -> bool {
        let Some(inverse) = self.inverted() else { return false };
        let shares = inverse * self.right;
        if !shares.iter().all(|share| share.is_finite() && *share > -FEASIBILITY_TOLERANCE) {
            return false;
        }
        self.inverse = inverse;
        self.shares = shares.map(|share| share.max(0.0));
        true
    }
}
