//! The third level with lower bounds: among forces that are equally good, the least `sum_i |f_i|^2 / f_i^U^2`.
//!
//! Multipliers tell by complementary slackness how hard each contact presses in every optimal solution: at the
//! maximum, at its lower bound, or between. What is left is a small quadratic program, whose solution is
//! unique and so depends on the wrench alone.

use nalgebra::{DMatrix, DVector, SVector};

use crate::columns::Objective;
use crate::cone_columns::ConeContact;
use crate::least_squares::{COEFFICIENT_WEIGHT, MAX_UNKNOWNS, least_distance, orthonormal_split};
use crate::preload_columns::{PreloadColumns, ROWS};
use crate::simplex::{Simplex, TIE};

/// How far the solution may be from what it must satisfy, relative to the largest normalised force.
const UNSATISFIED: f64 = 1e-10;

/// How hard a contact presses in every optimal solution.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Press {
    Least,
    Between,
    Most,
}

/// An extreme force that optimal solutions may use, and how much of it this one does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Used {
    pub(crate) contact: usize,
    pub(crate) edge: usize,
    pub(crate) level: f64,
}

/// The bounds in the simplex's units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// The largest lower bound.
    pub(crate) least: f64,
    /// The largest normalised normal force.
    pub(crate) most: f64,
}

impl<const D: usize> PreloadColumns<D> {
    /// Solves the third level at an optimal simplex state; `used` holds the basic solution and is replaced.
    /// Returns whether there was nothing to choose, or `None` where rounding gets the better of it.
    pub(crate) fn settle(
        &self,
        simplex: &Simplex<ROWS>,
        bounds: Bounds,
        used: &mut Vec<Used>,
    ) -> Option<bool> {
        let (presses, face) = self.face(simplex, bounds, used)?;
        if face.len() > MAX_UNKNOWNS {
            return None;
        }
        let (equations, right) = self.equations(simplex, bounds, &presses, &face);
        let (range, null) = orthonormal_split(&equations);
        if null.ncols() == 0 {
            return Some(true);
        }
        let qr = (&equations * &range).qr();
        let particular = &range * qr.r().solve_upper_triangular(&qr.q().tr_mul(&right))?;
        let objective = self.forces(&face);
        let qr = (&objective * &null).qr();
        let spread = qr.r().solve_upper_triangular(&DMatrix::identity(null.ncols(), null.ncols()))?;
        let directions = &null * spread;
        let mut solution = &particular - &directions * qr.q().tr_mul(&(&objective * &particular));
        let (constraints, least) = self.constraints(bounds, &presses, &face);
        let gradients = &constraints * &directions;
        let distances = &least - &constraints * &solution;
        let active = least_distance(&gradients, &distances)?;
        if active.len() > null.ncols() {
            return None;
        }
        if !active.is_empty() {
            let planes = gradients.select_rows(&active).transpose().qr();
            let inner = planes.r().transpose().solve_lower_triangular(&distances.select_rows(&active))?;
            solution += &directions * (planes.q() * inner);
        }
        let tolerance = UNSATISFIED * bounds.most.max(1.0);
        let unbalanced = (&equations * &solution - right).amax();
        let violated = (least - constraints * &solution).max();
        if !(unbalanced <= tolerance && violated <= tolerance) {
            return None;
        }
        *used = face.into_iter().zip(solution.iter()).map(|(u, x)| Used { level: x.max(0.0), ..u }).collect();
        // Coefficients may be free where the force they make is not.
        let forces = self.limits_and_components(&null, &objective);
        Some(forces <= 1e-9)
    }

    /// How much the forces (the rows above the regularisation) move along the null space.
    fn limits_and_components(&self, null: &DMatrix<f64>, objective: &DMatrix<f64>) -> f64 {
        (objective.rows(0, 4 * self.contacts.len()) * null).amax()
    }

    /// How hard the contacts press, and the edges they may use.
    fn face(
        &self,
        simplex: &Simplex<ROWS>,
        bounds: Bounds,
        basic: &[Used],
    ) -> Option<(Vec<Press>, Vec<Used>)> {
        let z = simplex.multipliers.map(|z| self.wrench_part(&z));
        let first = 2.0 * TIE.max(2e-15 * z[0].lp_norm(1));
        let second = 10.0 * TIE.max(2e-15 * z[1].lp_norm(1));
        let threshold = if self.objective == Objective::Sum { 1.0 } else { self.objective.weight() };
        let (mut presses, mut face) = (Vec::new(), Vec::new());
        for (contact, forces) in self.contacts.iter().enumerate() {
            let ConeContact::Finite { wrenches, .. } = forces else { return None };
            let (value, _, gain) = self.tied(contact, &z, first);
            let ties = self.objective == Objective::MaxThenSum;
            let side = |x: f64, tolerance: f64| match x {
                x if x > tolerance => Press::Most,
                x if x < -tolerance => Press::Least,
                _ => Press::Between,
            };
            let mut press = side(value - threshold, first);
            if press == Press::Between && ties {
                press = side(gain, second);
            }
            // The solution at hand lies on the face whatever rounding says of its reduced costs.
            let own = || basic.iter().filter(|used| used.contact == contact);
            let normal: f64 = own().map(|used| used.level).sum();
            let lower = self.least[contact] * bounds.least;
            let off = |bound: f64| (normal - bound).abs() > 1e-9 * bounds.most;
            if (press == Press::Most && (self.objective == Objective::Sum || off(bounds.most)))
                || (press == Press::Least && off(lower))
            {
                press = Press::Between;
            }
            presses.push(press);
            if press == Press::Least && lower == 0.0 {
                continue;
            }
            let optimal = |w: &SVector<f64, D>| {
                w.dot(&z[0]) >= value - first && (!ties || w.dot(&z[1]) - 1.0 >= gain - second)
            };
            for (edge, wrench) in wrenches.iter().enumerate() {
                if optimal(wrench) || own().any(|used| used.edge == edge && used.level > 0.0) {
                    face.push(Used { contact, edge, level: 0.0 });
                }
            }
        }
        Some((presses, face))
    }

    /// Balance, and the normal forces of contacts at a bound.
    fn equations(
        &self,
        simplex: &Simplex<ROWS>,
        bounds: Bounds,
        presses: &[Press],
        face: &[Used],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let fixed: Vec<usize> = (0..presses.len()).filter(|&i| presses[i] != Press::Between).collect();
        let mut matrix = DMatrix::zeros(self.rank + fixed.len(), face.len());
        let mut right = DVector::zeros(self.rank + fixed.len());
        right.rows_mut(0, self.rank).copy_from(&simplex.target.rows(0, self.rank));
        for (row, &contact) in fixed.iter().enumerate() {
            right[self.rank + row] = match presses[contact] {
                Press::Most => bounds.most,
                _ => self.least[contact] * bounds.least,
            };
        }
        for (j, used) in face.iter().enumerate() {
            if let ConeContact::Finite { wrenches, .. } = &self.contacts[used.contact] {
                matrix.view_mut((0, j), (self.rank, 1)).copy_from(&wrenches[used.edge].rows(0, self.rank));
            }
            if let Some(row) = fixed.iter().position(|&contact| contact == used.contact) {
                matrix[(self.rank + row, j)] = 1.0;
            }
        }
        (matrix, right)
    }

    /// Forces over their limits, and a little of the coefficients themselves.
    fn forces(&self, face: &[Used]) -> DMatrix<f64> {
        let rows = 4 * self.contacts.len();
        let mut matrix = DMatrix::zeros(rows + face.len(), face.len());
        for (j, used) in face.iter().enumerate() {
            if let ConeContact::Finite { forces, .. } = &self.contacts[used.contact] {
                let force = forces[used.edge] / self.limits[used.contact];
                matrix.view_mut((4 * used.contact, j), (4, 1)).copy_from(&force);
            }
            matrix[(rows + j, j)] = COEFFICIENT_WEIGHT;
        }
        matrix
    }

    /// Coefficients that are not negative, and contacts between their bounds.
    fn constraints(&self, bounds: Bounds, presses: &[Press], face: &[Used]) -> (DMatrix<f64>, DVector<f64>) {
        let between: Vec<usize> = (0..presses.len()).filter(|&i| presses[i] == Press::Between).collect();
        let sides: &[f64] = if self.objective == Objective::Sum { &[1.0] } else { &[1.0, -1.0] };
        let n = face.len();
        let mut matrix = DMatrix::zeros(n + sides.len() * between.len(), n);
        let mut least = DVector::zeros(matrix.nrows());
        matrix.fill_diagonal(1.0);
        for (k, &contact) in between.iter().enumerate() {
            for (side, &sign) in sides.iter().enumerate() {
                let row = n + sides.len() * k + side;
                for (j, _) in face.iter().enumerate().filter(|(_, used)| used.contact == contact) {
                    matrix[(row, j)] = sign;
                }
                least[row] = if side == 0 { self.least[contact] * bounds.least } else { -bounds.most };
            }
        }
        (matrix, least)
    }
}
