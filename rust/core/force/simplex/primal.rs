//! The primal simplex method with implicit columns: a cold start for the linear programs of Eqs. 24 and 26.
//!
//! Three costs are minimised one after another, each with a multiplier vector of its own and so without any
//! large or small constants: how far the artificial columns are from zero, the objective, and the tie-break.
//! Every answer is a basic solution, hence nonnegative; the pseudoinverse of Eqs. 27 to 29 is not, wherever
//! more than `d` points of the set lie on one supporting hyperplane.

use std::cmp::Ordering;

use nalgebra::SVector;

use crate::force::simplex::basis::Basis;
use crate::force::simplex::pricing::{Column, Pricing, tied_cost};
use crate::interrupt;
use crate::tolerances::{
    LARGE_REFINEMENT, ROUNDED_LEVEL, SEPARATED, SMALLEST_GAIN, SMALLEST_PIVOT, TIED_COST, TIED_LEVELS,
    UNCERTAIN_GAIN, UNREACHED,
};

/// Pivots after which a solve ends without an answer: far more than any solve needs, so that no loop is unbounded.
pub(crate) const MAX_PIVOTS: usize = 1000;

/// Pivots after which rounding in the updated inverse is cleared.
const REFACTORISE_EVERY: usize = 50;

/// Pivots after which ties in the ratio test are decided so that no cycle is possible.
const LEXICOGRAPHIC_AFTER: usize = 100;

/// How often the objective may undo what the tie-break did, before ties are left as they are.
const MAX_REVERSALS: usize = 20;

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Outcome<const R: usize> {
    /// Optimal in every cost; levels and multipliers hold the answer.
    Optimal,
    /// No combination of columns reaches the right-hand side; this direction separates.
    Infeasible(SVector<f64, R>),
    /// The pivot bound was reached.
    Stalled,
}

/// The right-hand side `-w_ext` in equilibrated coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RightHandSide<const R: usize> {
    /// Scaled to a largest component of one; zero beyond `rank`.
    pub(crate) wrench: SVector<f64, R>,
    /// Rows beyond this are zero in every column.
    pub(crate) rank: usize,
    /// How far from balance each row alone still counts as balanced: rounding of whoever computed the wrench.
    pub(crate) tolerance: SVector<f64, R>,
}

/// A basis with its levels (`alpha` of Eq. 24) and multipliers (`z_b` of Eq. 26, and the tie-break's).
#[derive(Debug, Clone)]
pub(crate) struct Simplex<const R: usize> {
    pub(crate) basis: Basis<R>,
    pub(crate) levels: SVector<f64, R>,
    pub(crate) multipliers: [SVector<f64, R>; 2],
    pub(crate) pivots: usize,
    /// What the levels balance: the caller's right-hand side but for its rounding.
    pub(crate) target: SVector<f64, R>,
    pub(crate) entering: Vec<u32>,
    pub(crate) candidate: Vec<u32>,
}

impl<const R: usize> Simplex<R> {
    pub(crate) fn new(contacts: usize) -> Self {
        Self {
            basis: Basis::new(contacts),
            levels: SVector::zeros(),
            multipliers: [SVector::zeros(); 2],
            pivots: 0,
            target: SVector::zeros(),
            entering: vec![0; contacts],
            candidate: vec![0; contacts],
        }
    }

    /// Solves from artificial columns.
    pub(crate) fn cold(&mut self, pricing: &impl Pricing<R>, target: &RightHandSide<R>) -> Outcome<R> {
        let rank = target.rank;
        self.pivots = 0;
        self.target = target.wrench;
        self.basis.reset(&target.wrench);
        self.levels = target.wrench.abs();
        if let Err(outcome) = self.reach_feasibility(pricing, target) {
            return outcome;
        }
        self.drive_out_artificials(pricing, rank);
        self.optimise(pricing, rank)
    }

    /// Solves from a basis that was optimal for another right-hand side where that is at most `cap` dual pivots
    /// away, and from artificial columns where it is not.
    pub(crate) fn solve_from(
        &mut self,
        basis: &Basis<R>,
        pricing: &impl Pricing<R>,
        target: &RightHandSide<R>,
        cap: usize,
    ) -> Outcome<R> {
        self.restart(basis);
        if self.warm(pricing, target, cap) == Some(Outcome::Optimal) {
            return Outcome::Optimal;
        }
        let spent = self.pivots;
        let outcome = self.cold(pricing, target);
        self.pivots += spent;
        outcome
    }

    /// Takes up a basis that was optimal for another right-hand side.
    fn restart(&mut self, basis: &Basis<R>) {
        self.basis.copy_from(basis);
        self.refresh_multipliers();
    }

    /// The first phase: minimise the sum of artificial levels.
    fn reach_feasibility(
        &mut self,
        pricing: &impl Pricing<R>,
        target: &RightHandSide<R>,
    ) -> Result<(), Outcome<R>> {
        let rank = target.rank;
        let mut costs = self.basis.infeasibility(rank);
        let mut z = self.basis.multipliers(&costs);
        let mut fresh = true;
        while self.pivots < MAX_PIVOTS && !interrupt::stopped() {
            let distance = costs.dot(&self.levels);
            if distance <= f64::EPSILON {
                return Ok(());
            }
            let column = pricing.furthest(&z, 0.0, &mut self.entering);
            let gain = column.wrench.dot(&z);
            let direction = self.basis.inverse * column.wrench;
            let row = self.leaving_row(&direction, 0);
            let exhausted = gain <= UNREACHED * z.lp_norm(1);
            if exhausted || row.is_none() {
                // What the multiplier separates is rounding where a target that close is not separated.
                if distance <= z.abs().component_mul(&target.tolerance).max() {
                    return Ok(());
                }
                if fresh {
                    // A direction in which the wrench differs by no more than rounding separates nothing, nor does one
                    // along which a column still reaches, though its pivot cannot be trusted.
                    let separated = exhausted && distance > SEPARATED * z.lp_norm(1);
                    return Err(if separated { Outcome::Infeasible(z) } else { Outcome::Stalled });
                }
                fresh = true;
                self.refactorise();
                z = self.basis.multipliers(&costs);
                continue;
            }
            let Some(row) = row else { continue };
            self.pivot(row, &column, &direction);
            costs = self.basis.infeasibility(rank);
            fresh = self.pivots.is_multiple_of(REFACTORISE_EVERY);
            z = if fresh {
                self.refactorise();
                self.basis.multipliers(&costs)
            } else {
                z - self.basis.inverse.row(row).transpose() * gain
            };
        }
        Err(Outcome::Stalled)
    }

    /// Replaces artificial columns left at level zero, so that they cannot grow while the objective falls.
    fn drive_out_artificials(&mut self, pricing: &impl Pricing<R>, rank: usize) {
        for row in 0..rank {
            if !self.basis.artificial[row] {
                continue;
            }
            // What is left is rounding of the caller's wrench; balancing what is not must not make other
            // levels negative later.
            self.target -= self.basis.columns.column(row) * self.levels[row];
            self.levels[row] = 0.0;
            let along = self.basis.inverse.row(row).transpose();
            let length = along.lp_norm(1);
            for z in [along, -along] {
                let column = pricing.furthest(&z, 0.0, &mut self.entering);
                if column.wrench.dot(&z) > SMALLEST_PIVOT * length {
                    let direction = self.basis.inverse * column.wrench;
                    self.pivot(row, &column, &direction);
                    break;
                }
            }
        }
    }

    /// The second phase: the objective, then the tie-break among its optimal columns.
    pub(crate) fn optimise(&mut self, pricing: &impl Pricing<R>, rank: usize) -> Outcome<R> {
        self.refactorise();
        self.refresh_multipliers();
        // Once ties are being broken, the objective's own threshold must not undo what its tolerance allowed.
        let mut threshold = pricing.optimality();
        let mut polished = true;
        let (mut followed, mut tied, mut reversals) = (0, false, 0);
        let first = self.pivots;
        while self.pivots < MAX_PIVOTS && !interrupt::stopped() {
            if self.pivots > first && (self.pivots - first).is_multiple_of(REFACTORISE_EVERY) {
                self.refactorise();
                self.refresh_multipliers();
            }
            let noise = self.multipliers[0].lp_norm(1);
            let mut column = pricing.furthest(&self.multipliers[0], 1.0, &mut self.entering);
            let gain = column.wrench.dot(&self.multipliers[0]) - column.costs[0];
            let improves = gain > threshold.max(SMALLEST_GAIN * noise);
            // Gains that may be rounding in the multipliers are followed, but not for ever.
            let uncertain = gain <= UNCERTAIN_GAIN * noise;
            followed += usize::from(improves && uncertain);
            if !improves || (uncertain && followed > 2 * R) {
                if !polished {
                    polished = true;
                    self.polish();
                    continue;
                }
                // Where rounding lets the two costs undo each other, ties are left as they are.
                if reversals > MAX_REVERSALS {
                    return Outcome::Optimal;
                }
                let tolerance = tied_cost(&self.multipliers[0]);
                let Some(better) = self.tie_break(pricing, tolerance) else { return Outcome::Optimal };
                (tied, column) = (true, better);
                threshold = threshold.max(2.0 * tolerance);
            } else if tied {
                tied = false;
                reversals += 1;
                threshold = if reversals > MAX_REVERSALS { pricing.optimality() } else { threshold };
            }
            let direction = self.basis.inverse * column.wrench;
            let Some(row) = self.leaving_row(&direction, rank) else { return Outcome::Stalled };
            self.exchange(row, &column, &direction);
            polished = false;
        }
        Outcome::Stalled
    }

    /// The column that improves the tie-break, if one does.
    fn tie_break(&mut self, pricing: &impl Pricing<R>, tolerance: f64) -> Option<Column<R>> {
        let column = pricing.tie_break(&self.multipliers, tolerance, &mut self.entering)?;
        let reach = column.wrench.dot(&self.multipliers[1]);
        let noise = UNREACHED * self.multipliers[1].lp_norm(1);
        (reach - column.costs[1] > TIED_COST.max(noise)).then_some(column)
    }

    /// The ratio test. Rows that are as close up to rounding leave the choice to the largest pivot element; a
    /// solve that takes suspiciously long decides lexicographically on the rows of the inverse instead, which
    /// excludes cycles. An artificial column before row `rank` leaves rather than change its level.
    fn leaving_row(&self, direction: &SVector<f64, R>, rank: usize) -> Option<usize> {
        let smallest = (SMALLEST_PIVOT * direction.amax()).max(f64::MIN_POSITIVE);
        if let Some(row) = (0..rank).find(|&r| self.basis.artificial[r] && direction[r].abs() > smallest) {
            return Some(row);
        }
        let ratio = |row: usize| self.levels[row].max(0.0) / direction[row];
        let rounding = TIED_LEVELS * self.levels.amax();
        let rows = || (0..R).filter(|&row| direction[row] > smallest);
        let bound = rows().map(|row| ratio(row) + rounding / direction[row]).fold(f64::INFINITY, f64::min);
        let near = rows().filter(|&row| ratio(row) <= bound);
        if self.pivots < LEXICOGRAPHIC_AFTER {
            return near.max_by(|&a, &b| direction[a].total_cmp(&direction[b]));
        }
        near.reduce(|best, row| {
            let closer = match ratio(row).total_cmp(&ratio(best)) {
                Ordering::Equal => self.precedes(row, best, direction[row], direction[best]),
                order => order == Ordering::Less,
            };
            if closer { row } else { best }
        })
    }

    fn precedes(&self, row: usize, other: usize, u: f64, v: f64) -> bool {
        let rows =
            self.basis.inverse.row(row).iter().zip(self.basis.inverse.row(other)).find_map(|(a, b)| {
                let (a, b) = (a / u, b / v);
                (a != b).then_some(a < b)
            });
        rows.unwrap_or(false)
    }

    /// A pivot that carries the multipliers of the objective and the tie-break along.
    pub(crate) fn exchange(&mut self, row: usize, column: &Column<R>, direction: &SVector<f64, R>) {
        let gains: [f64; 2] =
            std::array::from_fn(|k| column.wrench.dot(&self.multipliers[k]) - column.costs[k]);
        self.pivot(row, column, direction);
        for (z, gain) in self.multipliers.iter_mut().zip(gains) {
            *z -= self.basis.inverse.row(row).transpose() * gain;
        }
    }

    fn pivot(&mut self, row: usize, column: &Column<R>, direction: &SVector<f64, R>) {
        // Negative only against a negative element, in the dual method.
        let step = (self.levels[row] / direction[row]).max(0.0);
        self.levels -= direction * step;
        self.levels[row] = step;
        // Levels that are zero but for rounding are ties, and only exact ties are broken without cycling.
        let zero = ROUNDED_LEVEL * self.levels.amax();
        self.levels.apply(|level| {
            if level.abs() < zero {
                *level = 0.0;
            }
        });
        self.basis.replace(row, column, &self.entering, direction);
        self.pivots += 1;
    }

    pub(crate) fn refactorise(&mut self) {
        if self.basis.refactorise() {
            self.levels = self.basis.levels(&self.target);
        }
    }

    pub(crate) fn refresh_multipliers(&mut self) {
        self.multipliers = self.basis.costs.map(|costs| self.basis.multipliers(&costs));
    }

    /// Removes what pivoting left in levels and multipliers, by refinement where that suffices.
    fn polish(&mut self) {
        let before = self.multipliers[0];
        let refined = self.basis.refine(&before, &self.basis.costs[0]);
        if (refined - before).lp_norm(1) > LARGE_REFINEMENT * refined.lp_norm(1) {
            self.refactorise();
            self.refresh_multipliers();
            return;
        }
        self.multipliers = [refined, self.basis.refine(&self.multipliers[1], &self.basis.costs[1])];
        self.levels += self.basis.inverse * (self.target - self.basis.columns * self.levels);
    }
}
