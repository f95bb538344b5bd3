//! The third level: among forces that are equally good, the least `sum_i |f_i|^2 / f_i^U^2`.
//!
//! On a symmetric grasp the objective and its tie-break leave a polytope of forces. Its point of least norm is unique and
//! moves continuously with the wrench. The forces then depend on the wrench alone.
//!
//! The unknowns are the coefficients of the active extreme forces. A contact that may exert any force of its cone has at
//! most four of them. The common level of the saturated contacts is one more unknown: a weighted objective does not
//! determine it.

use nalgebra::{DMatrix, DVector, SVector};

use crate::force::least_norm::solver::{LeastNormSolution, Solutions};
use crate::force::linear_cones::cone_interior::Interior;
use crate::force::linear_cones::optimal_face::{ContactStatus, OptimalFace};
use crate::grasp::contact::ContactForce;
use crate::linalg::least_distance::Constraints;

/// Unknowns beyond which the level is left out: its cost grows with their cube.
const MAX_UNKNOWNS: usize = 768;

/// Weight of the coefficients beside the forces: it chooses among coefficients that make the same force, and
/// moves the forces by no more than its square.
const COEFFICIENT_WEIGHT: f64 = 1e-5;

/// A face of optimal forces with their bounds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FaceProgram<'a> {
    pub(crate) face: &'a OptimalFace,
    /// Which components of a contact force exist.
    pub(crate) components: &'a [usize],
    pub(crate) interiors: &'a [Option<Interior>],
    /// The `f_i^U`.
    pub(crate) limits: &'a [f64],
    /// Lower bounds of the normalised normal forces in units of the last parameter; none where empty.
    pub(crate) least: &'a [f64],
    /// The level of the saturated contacts in the same unit, where the multipliers determine it.
    pub(crate) level: Option<f64>,
}

/// Balance as a function of parameters, and their values.
#[derive(Debug, Clone)]
pub(crate) struct Balance {
    /// The balanced wrench: one column for each parameter.
    pub(crate) right: DMatrix<f64>,
    pub(crate) at: DVector<f64>,
}

/// What the third level did.
#[derive(Debug, Clone)]
pub(crate) enum Chosen {
    /// Nothing: balance determines the forces.
    Determined,
    /// Coefficients of the active extreme forces in the face's order, then the level, if the face is limited.
    LeastNorm(LeastNormSolution),
}

/// The matrix of the objective: forces over their limits, and a little of the unknowns themselves. `forces` are the contact
/// and the extreme force of each coefficient; they are the first of the `unknowns`.
pub(crate) fn forces_over_limits(
    forces: impl Iterator<Item = (usize, ContactForce)>,
    unknowns: usize,
    components: &[usize],
    limits: &[f64],
) -> DMatrix<f64> {
    let rows = components.len() * limits.len();
    let mut matrix = DMatrix::zeros(rows + unknowns, unknowns);
    matrix.view_mut((rows, 0), (unknowns, unknowns)).fill_diagonal(COEFFICIENT_WEIGHT);
    for (j, (contact, force)) in forces.enumerate() {
        for (row, &component) in components.iter().enumerate() {
            matrix[(components.len() * contact + row, j)] = force[component] / limits[contact];
        }
    }
    matrix
}

impl FaceProgram<'_> {
    /// The forces of least norm that balance the wrench. `column` gives an extreme force and its wrench. `None` where
    /// rounding prevents it, or where there are too many unknowns.
    pub(crate) fn solve<const R: usize>(
        &self,
        balance: &Balance,
        column: impl Fn(usize, u32) -> (SVector<f64, R>, ContactForce),
    ) -> Option<Chosen> {
        if self.unknowns() > MAX_UNKNOWNS {
            return None;
        }
        let (equations, right) = self.equations(balance, &column);
        let solutions = Solutions::new(equations, right);
        if solutions.determined() {
            return Some(Chosen::Determined);
        }
        let (objective, constraints) = (self.objective(&column), self.constraints());
        solutions.least_norm(&objective, &constraints, &balance.at).map(Chosen::LeastNorm)
    }

    /// How far the forces themselves may move in the directions that the equations leave free.
    pub(crate) fn freedom<const R: usize>(
        &self,
        chosen: &LeastNormSolution,
        column: impl Fn(usize, u32) -> (SVector<f64, R>, ContactForce),
    ) -> f64 {
        let rows = self.components.len() * self.limits.len();
        (self.objective(column).rows(0, rows) * &chosen.null).amax()
    }

    fn unknowns(&self) -> usize {
        self.contacts().map(|(_, _, span)| span.end).last().unwrap_or(0) + usize::from(self.face.limited)
    }

    /// Each contact with its status and the range of its coefficients.
    fn contacts(&self) -> impl Iterator<Item = (usize, ContactStatus, std::ops::Range<usize>)> + '_ {
        let mut next = 0;
        self.face.statuses.iter().enumerate().map(move |(contact, status)| {
            let start = next;
            next += self.face.edges(contact).len();
            (contact, *status, start..next)
        })
    }

    fn lower_bound(&self, contact: usize) -> f64 {
        self.least.get(contact).copied().unwrap_or(0.0)
    }

    /// Balance, and the normal forces of contacts at the level or at their lower bound.
    fn equations<const R: usize>(
        &self,
        balance: &Balance,
        column: impl Fn(usize, u32) -> (SVector<f64, R>, ContactForce),
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let (n, last) = (self.unknowns(), balance.at.len() - 1);
        let fixed = |(_, status, span): &(usize, ContactStatus, std::ops::Range<usize>)| {
            *status == ContactStatus::Saturated || (*status == ContactStatus::Idle && !span.is_empty())
        };
        let count = R + self.contacts().filter(fixed).count() + usize::from(self.level.is_some());
        let mut matrix = DMatrix::zeros(count, n);
        let mut right = DMatrix::zeros(count, balance.at.len());
        right.rows_mut(0, R).copy_from(&balance.right);
        let mut row = R;
        for (contact, status, span) in self.contacts() {
            for (j, &edge) in span.clone().zip(self.face.edges(contact)) {
                matrix.view_mut((0, j), (R, 1)).copy_from(&column(contact, edge).0);
            }
            if fixed(&(contact, status, span.clone())) {
                matrix.view_mut((row, span.start), (1, span.len())).fill(1.0);
                match status {
                    ContactStatus::Saturated => matrix[(row, n - 1)] = -1.0,
                    _ => right[(row, last)] = self.lower_bound(contact),
                }
                row += 1;
            }
        }
        if let Some(level) = self.level {
            matrix[(row, n - 1)] = 1.0;
            right[(row, last)] = level;
        }
        (matrix, right)
    }

    /// Forces over their limits, and a little of the unknowns themselves.
    fn objective<const R: usize>(
        &self,
        column: impl Fn(usize, u32) -> (SVector<f64, R>, ContactForce),
    ) -> DMatrix<f64> {
        let edges = (0..self.face.statuses.len())
            .flat_map(|contact| self.face.edges(contact).iter().map(move |&edge| (contact, edge)));
        let forces = edges.map(|(contact, edge)| (contact, column(contact, edge).1));
        forces_over_limits(forces, self.unknowns(), self.components, self.limits)
    }

    /// What must not be negative: a coefficient, or for a force inside its cone its distance from a facet; and how far
    /// a free contact is from its bounds.
    fn constraints(&self) -> Constraints {
        let mut constraints = Constraints::new();
        let level = self.unknowns().wrapping_sub(1);
        for (contact, status, span) in self.contacts() {
            match self.interiors[contact].as_ref().filter(|_| self.face.inside[contact]) {
                Some(interior) => {
                    for facet in &interior.facets {
                        constraints.push(span.clone().zip(facet.iter().copied()), 0.0);
                    }
                }
                None => span.clone().for_each(|j| constraints.push([(j, 1.0)], 0.0)),
            }
            if status != ContactStatus::Free || span.is_empty() {
                continue;
            }
            if self.lower_bound(contact) > 0.0 {
                constraints.push(span.clone().map(|j| (j, 1.0)), self.lower_bound(contact));
            }
            if self.face.limited {
                constraints.push(span.map(|j| (j, -1.0)).chain([(level, 1.0)]), 0.0);
            }
        }
        let highest = self.least.iter().copied().fold(0.0, f64::max);
        if self.face.limited && self.level.is_none() && highest > 0.0 {
            constraints.push([(level, 1.0)], highest);
        }
        constraints
    }
}
