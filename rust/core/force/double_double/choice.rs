//! The third level where doubles cannot tell the optimal face: least squares with equations in 32 digits.
//!
//! Multipliers in 32 digits tell which extreme forces may take part, and what each costs beyond the optimum (its
//! reduced cost). The forces of least `sum_i |f_i|^2 / f_i^U^2` balance the wrench exactly, and lose a small share of
//! the objective. Without that share they would follow reduced costs that are rounding.

use nalgebra::{DMatrix, DVector};

use crate::force::double_double::columns::{DoubleDoubleColumns, Vector, dot};
use crate::force::least_norm::face_program::forces_over_limits;
use crate::force::least_norm::solver::Solutions;
use crate::force::simplex::pricing::Objective;
use crate::linalg::double_double::DoubleDouble;
use crate::linalg::least_distance::Constraints;
use crate::linalg::orthonormal_equations::{Equation, orthonormal_equations};
use crate::tolerances::{CHOSEN_REST, DEPENDENT_EQUATION, LOST_OBJECTIVE, UNMOVED_BY_CHOICE};

/// Extreme forces beyond which the level is left out.
pub(crate) const MOST_EDGES: usize = 512;

/// What is known of the optimum, in units of its largest share.
pub(crate) struct Optimum<'a> {
    pub(crate) balanced: &'a Vector,
    pub(crate) multiplier: &'a Vector,
    pub(crate) sigma_max: f64,
    pub(crate) sigma_sum: f64,
    /// Lower bounds of the normalised normal forces; none where empty.
    pub(crate) least: &'a [DoubleDouble],
    /// The share of the objective that may be lost.
    pub(crate) lost: f64,
}

/// What a contact's total costs beside the optimum.
#[derive(Clone, Copy)]
struct TotalCost {
    /// Of each unit below the common level, and of each unit above the lower bound.
    below_level: f64,
    above_bound: f64,
}

/// Coefficients of extreme forces, then with a weight the common level, which is one without.
struct ChoiceProgram<'a> {
    columns: &'a DoubleDoubleColumns,
    optimum: &'a Optimum<'a>,
    /// Contact, edge and reduced cost of each coefficient.
    unknowns: Vec<(usize, usize, f64)>,
    totals: Vec<TotalCost>,
}

/// The coefficient of each extreme force that takes part: contact, edge, level.
pub(crate) fn least_squares_levels(
    columns: &DoubleDoubleColumns,
    components: &[usize],
    limits: &[f64],
    optimum: &Optimum<'_>,
) -> Option<Vec<(usize, usize, f64)>> {
    let program = ChoiceProgram::new(columns, optimum)?;
    let count = program.unknowns.len();
    if count == 0 || count > MOST_EDGES {
        return None;
    }
    let (matrix, right) =
        orthonormal_equations(program.equations()?, program.width(), DEPENDENT_EQUATION, CHOSEN_REST)?;
    let right = DMatrix::from_column_slice(right.len(), 1, right.as_slice());
    let forces: Option<Vec<_>> = program
        .unknowns
        .iter()
        .map(|&(contact, edge, _)| Some((contact, columns.listed(contact)?.1[edge])))
        .collect();
    let objective = forces_over_limits(forces?.into_iter(), program.width(), components, limits);
    let one = DVector::repeat(1, 1.0);
    let chosen = Solutions::new(matrix, right).least_norm(&objective, &program.constraints(), &one)?;
    let levels = program.unknowns.iter().zip(&chosen.solution);
    let positive = levels.filter(|(_, level)| **level > 0.0);
    Some(positive.map(|(&(contact, edge, _), level)| (contact, edge, *level)).collect())
}

impl<'a> ChoiceProgram<'a> {
    /// `None` where a contact lists no extreme forces.
    fn new(columns: &'a DoubleDoubleColumns, optimum: &'a Optimum<'a>) -> Option<Self> {
        let (mut unknowns, mut totals) = (Vec::new(), Vec::new());
        for contact in 0..columns.num_contacts() {
            let (wrenches, _) = columns.listed(contact)?;
            let reach: Vec<_> = wrenches.iter().map(|w| dot(w, optimum.multiplier)).collect();
            let best = reach.iter().copied().reduce(DoubleDouble::max)?;
            let bounded = optimum.least.get(contact).is_some_and(|bound| bound.value() > 0.0);
            // A contact with a lower bound takes part also where it gains less than it costs.
            let own = DoubleDouble::from(match columns.objective() {
                Objective::Sum => 1.0,
                _ => columns.weight(),
            });
            let needed = if bounded { best } else { best.max(own) };
            let sum = columns.objective() == Objective::Sum;
            totals.push(TotalCost {
                below_level: if sum { 0.0 } else { (best - own).max(DoubleDouble::ZERO).value() },
                above_bound: if bounded { (own - best).max(DoubleDouble::ZERO).value() } else { 0.0 },
            });
            let costs = reach.into_iter().map(|reach| (needed - reach).value()).enumerate();
            let taking_part = costs.filter(|(_, cost)| *cost <= LOST_OBJECTIVE);
            unknowns.extend(taking_part.map(|(edge, cost)| (contact, edge, cost)));
        }
        Some(Self { columns, optimum, unknowns, totals })
    }

    /// Whether the maximum counts, and is not known.
    fn weighted(&self) -> bool {
        matches!(self.columns.objective(), Objective::Weighted(_))
    }

    fn width(&self) -> usize {
        self.unknowns.len() + usize::from(self.weighted())
    }

    fn coefficients(&self, contact: usize) -> impl Iterator<Item = usize> + '_ {
        self.unknowns.iter().enumerate().filter(move |(_, own)| own.0 == contact).map(|(j, _)| j)
    }

    fn bound(&self, contact: usize) -> DoubleDouble {
        self.optimum.least.get(contact).copied().unwrap_or(DoubleDouble::ZERO)
    }

    fn highest_bound(&self) -> f64 {
        self.optimum.least.iter().map(|bound| bound.value()).fold(0.0, f64::max)
    }

    /// Balance, and the totals that are too dear to leave their level or their bound.
    fn equations(&self) -> Option<Vec<Equation>> {
        let width = self.width();
        let mut equations = vec![vec![DoubleDouble::ZERO; width + 1]; self.columns.dim];
        for (j, &(contact, edge, _)) in self.unknowns.iter().enumerate() {
            let wrench = self.columns.listed(contact)?.0[edge];
            equations.iter_mut().zip(wrench).for_each(|(row, w)| row[j] = DoubleDouble::from(w));
        }
        equations.iter_mut().zip(self.optimum.balanced).for_each(|(row, b)| row[width] = *b);
        for (contact, cost) in self.totals.iter().enumerate() {
            let mut row = vec![DoubleDouble::ZERO; width + 1];
            self.coefficients(contact).for_each(|j| row[j] = DoubleDouble::ONE);
            if cost.below_level > LOST_OBJECTIVE {
                if self.weighted() {
                    row[width - 1] = -DoubleDouble::ONE;
                } else {
                    row[width] = DoubleDouble::ONE;
                }
            } else if cost.above_bound > LOST_OBJECTIVE {
                row[width] = self.bound(contact);
            } else {
                continue;
            }
            equations.push(row);
        }
        Some(equations)
    }

    /// Coefficients are not negative, totals keep their bounds, and the objective loses no more than its share.
    fn constraints(&self) -> Constraints {
        let mut constraints = Constraints::with_smallest_gradient(UNMOVED_BY_CHOICE);
        let (count, level) = (self.unknowns.len(), self.width() - 1);
        (0..count).for_each(|j| constraints.push([(j, 1.0)], 0.0));
        let lost = self.optimum.lost;
        let sum = self.columns.objective() == Objective::Sum;
        for contact in 0..self.totals.len() {
            let bound = self.bound(contact).value();
            if bound > 0.0 {
                constraints.push(self.coefficients(contact).map(|j| (j, 1.0)), bound);
            }
            if sum {
                continue;
            }
            let below = self.coefficients(contact).map(|j| (j, -1.0));
            if self.weighted() {
                constraints.push(below.chain([(level, 1.0)]), 0.0);
            } else {
                constraints.push(below, -(1.0 + lost));
            }
        }
        let highest = self.highest_bound();
        if self.weighted() && highest > 0.0 {
            constraints.push([(level, 1.0)], highest);
        }
        if self.columns.objective() == Objective::MaxThenSum {
            let sum = self.optimum.sigma_sum / self.optimum.sigma_max;
            constraints.push((0..count).map(|j| (j, -1.0)), -sum * (1.0 + lost));
        }
        self.push_loss(&mut constraints);
        constraints
    }

    /// What is lost of the objective: reduced costs times what they belong to.
    fn push_loss(&self, constraints: &mut Constraints) {
        let mut row: Vec<f64> = self.unknowns.iter().map(|unknown| unknown.2).collect();
        row.resize(self.width(), 0.0);
        let highest = self.highest_bound();
        // Where the largest lower bound keeps the level up, the level itself costs.
        let own = (1.0 - self.totals.iter().map(|cost| cost.below_level).sum::<f64>()).max(0.0);
        let mut at_level = if self.weighted() && highest > 0.0 { own } else { 0.0 };
        let mut fixed = -at_level * highest;
        for (contact, cost) in self.totals.iter().enumerate() {
            let cheap = |cost: f64| if cost > LOST_OBJECTIVE { 0.0 } else { cost };
            let (below, above) = (cheap(cost.below_level), cheap(cost.above_bound));
            self.coefficients(contact).for_each(|j| row[j] += above - below);
            at_level += below;
            fixed -= above * self.bound(contact).value();
        }
        if self.weighted() {
            row[self.unknowns.len()] += at_level;
        } else {
            fixed += at_level;
        }
        let Optimum { sigma_max, sigma_sum, lost, .. } = self.optimum;
        let largest = row.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let allowed = lost * self.columns.objective().value(1.0, sigma_sum / sigma_max);
        if largest > 0.0 {
            let scaled = row.into_iter().enumerate().map(|(j, x)| (j, -x / largest));
            constraints.push(scaled, (fixed - allowed) / largest);
        }
    }
}
