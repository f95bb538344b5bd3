//! The price of imbalance at which what is left over passes the feasibility tolerance.
//!
//! Objective plus price times what is left over is a line in the price for each basis. The least objective is their
//! lower envelope. Where the lines of a basis within the tolerance and of one beyond it cross, both are optimal, and so
//! is every mixture of them. No forces within the tolerance have a lesser objective than the mixture that leaves over
//! just the tolerance.

use crate::force::double_double::simplex::{DoubleDoubleSimplex, FIRST_PRICE, inner};
use crate::force::double_double::solution::Solution;
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{FEASIBILITY_TOLERANCE, LARGEST_OBJECTIVE};

/// Crossings that are computed at most; one for each basis between the two, and a handful is usual.
const MAX_CROSSINGS: usize = 60;

/// A basis is below the lines of two others by more than this share of theirs; less is rounding.
const SAME_LINE: f64 = 1e-15;

/// Solutions on both sides of the feasibility tolerance that are equally good at one price.
pub(crate) struct Tolerated {
    pub(crate) within: Solution,
    /// None where the lowest price already leaves less.
    beyond: Option<Solution>,
    price: f64,
}

impl DoubleDoubleSimplex<'_> {
    /// The last solution is within the tolerance. `None` where a solve does not end.
    pub(crate) fn tolerated(&mut self) -> Option<Tolerated> {
        let mut within = self.solution.clone();
        let mut price = FIRST_PRICE * self.columns.unit();
        if !self.minimise(Some(price)) {
            return None;
        }
        if self.solution.left_over() <= FEASIBILITY_TOLERANCE {
            return Some(Tolerated { within: self.solution.clone(), beyond: None, price });
        }
        let mut beyond = self.solution.clone();
        for _ in 0..MAX_CROSSINGS {
            let saved = beyond.left_over() - within.left_over();
            let crossing = (within.objective() - beyond.objective()).value() / saved;
            if !(crossing > price && crossing.is_finite()) {
                break;
            }
            if !self.minimise(Some(crossing)) {
                return None;
            }
            let value = |solution: &Solution| {
                solution.objective() + DoubleDouble::from(crossing).times(solution.left_over())
            };
            let line = value(&within);
            if value(&self.solution) >= line - line.times(SAME_LINE) {
                price = crossing;
                break;
            }
            if self.solution.left_over() > FEASIBILITY_TOLERANCE {
                (price, beyond) = (crossing, self.solution.clone());
            } else {
                within = self.solution.clone();
            }
        }
        if !self.minimise(Some(price)) {
            return None;
        }
        within.multiplier = self.solution.multiplier;
        Some(Tolerated { within, beyond: Some(beyond), price })
    }
}

impl Tolerated {
    /// The mixture that leaves over so much; `None` where both leave less, or more.
    pub(crate) fn mixture(&self, left: f64) -> Option<Solution> {
        let beyond = self.beyond.as_ref()?;
        let (most, least) = (beyond.left_over(), self.within.left_over());
        let share = (most - left) / (most - least);
        if !(0.0..=1.0).contains(&share) {
            return None;
        }
        let mut mixture = self.within.clone();
        mixture.levels.iter_mut().for_each(|level| *level = level.times(share));
        mixture.members.extend(beyond.members.iter().cloned());
        mixture.levels.extend(beyond.levels.iter().map(|level| level.times(1.0 - share)));
        Some(mixture)
    }
}

impl DoubleDoubleSimplex<'_> {
    /// Whether a multiplier shows that no forces of an objective up to [`LARGEST_OBJECTIVE`] come within the tolerance
    /// of the target. With `p(z) <= 1`, such forces reach along it by their objective at most.
    pub(crate) fn separates(&self, tolerated: &Tolerated) -> bool {
        // What lower bounds cost by themselves comes on top.
        let held: f64 = self.target[self.columns.dim..].iter().map(|x| x.value()).sum();
        let most = (LARGEST_OBJECTIVE + held) * self.columns.unit();
        let reach = inner(&tolerated.within.multiplier, &self.target).value();
        (reach - most) / tolerated.price > FEASIBILITY_TOLERANCE
    }
}
