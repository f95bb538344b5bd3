//! The least norm over a polyhedron: `min |A x|^2` subject to `E x = D p`, `C x >= c p_k`, for parameters `p`.
//!
//! Orthogonal bases reduce it to a [least-distance](crate::linalg::least_distance) problem (Lawson and Hanson, "Solving
//! Least Squares Problems", chapter 23). Once the active constraints are known, the solution is a linear function of the
//! parameters.

use nalgebra::{DMatrix, DVector};

use crate::interrupt;
use crate::linalg::least_distance::{Constraints, least_distance};
use crate::tolerances::{DEPENDENT, UNSATISFIED};

/// Solutions steeper than this in their parameters, relative to the steepest that the equations need, are rounding.
const MAX_SENSITIVITY: f64 = 1e6;

/// Unknowns that solve `E x = D p`.
#[derive(Debug, Clone)]
pub(crate) struct Solutions {
    equations: DMatrix<f64>,
    right: DMatrix<f64>,
    /// Orthonormal directions in which the equations determine the unknowns, and in which they do not.
    range: DMatrix<f64>,
    null: DMatrix<f64>,
}

/// The solution as a function of the parameters, as long as its constraints and multipliers are not negative.
#[derive(Debug, Clone)]
pub(crate) struct LeastNormSolution {
    /// One row for each unknown, one column for each parameter.
    pub(crate) solution: DMatrix<f64>,
    /// Multipliers of the active constraints.
    pub(crate) multipliers: DMatrix<f64>,
    /// Orthonormal directions in which the equations leave the unknowns free.
    pub(crate) null: DMatrix<f64>,
}

impl Solutions {
    /// Solutions of the equations `E` with the right-hand side `D`, which has one column for each parameter.
    pub(crate) fn new(equations: DMatrix<f64>, right: DMatrix<f64>) -> Self {
        let (range, null) = orthonormal_split(&equations);
        Self { equations, right, range, null }
    }

    /// Whether the equations leave no choice.
    pub(crate) fn determined(&self) -> bool {
        self.null.ncols() == 0
    }

    /// The solution of least `|A x|` that keeps the constraints, at the parameters `at`. `None` where rounding
    /// prevents it, where it was interrupted, or where there is no choice.
    pub(crate) fn least_norm(
        self,
        objective: &DMatrix<f64>,
        constraints: &Constraints,
        at: &DVector<f64>,
    ) -> Option<LeastNormSolution> {
        let Self { equations, right, range, null } = self;
        if null.ncols() == 0 {
            return None;
        }
        let qr = (&equations * &range).qr();
        let particular = &range * qr.r().solve_upper_triangular(&qr.q().tr_mul(&right))?;
        let qr = (objective * &null).qr();
        let spread = qr.r().solve_upper_triangular(&DMatrix::identity(null.ncols(), null.ncols()))?;
        let directions = &null * spread;
        let unconstrained = &particular - &directions * (qr.q().tr_mul(&(objective * &particular)));
        let last = at[at.len() - 1];
        let active = least_distance(constraints, last, &(&unconstrained * at), &directions)?;
        let (solution, multipliers) = on_active(constraints, &active, &unconstrained, &directions)?;
        let accepted = satisfied(constraints, &solution, &multipliers, at)
            && (&equations * (&solution - &particular)).amax() <= UNSATISFIED
            && solution.amax() <= MAX_SENSITIVITY * particular.amax();
        accepted.then_some(LeastNormSolution { solution, multipliers, null })
    }
}

/// The solution with some constraints active, and their multipliers, without squaring the condition of the planes.
fn on_active(
    constraints: &Constraints,
    active: &[usize],
    unconstrained: &DMatrix<f64>,
    directions: &DMatrix<f64>,
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let parameters = unconstrained.ncols();
    if active.is_empty() {
        return Some((unconstrained.clone(), DMatrix::zeros(0, parameters)));
    }
    let normals: Vec<_> = active.iter().map(|&i| constraints.times(i, directions)).collect();
    let mut distances = DMatrix::zeros(active.len(), parameters);
    for (row, &i) in active.iter().enumerate() {
        distances.row_mut(row).tr_copy_from(&-constraints.times(i, unconstrained));
        distances[(row, parameters - 1)] += constraints.bounds[i];
    }
    let planes = DMatrix::from_columns(&normals).qr();
    let inner = planes.r().transpose().solve_lower_triangular(&distances)?;
    let solution = unconstrained + directions * (planes.q() * &inner);
    Some((solution, planes.r().solve_upper_triangular(&inner)?))
}

/// Whether constraints and multipliers are nonnegative at the parameters `at`, but for rounding.
fn satisfied(
    constraints: &Constraints,
    solution: &DMatrix<f64>,
    multipliers: &DMatrix<f64>,
    at: &DVector<f64>,
) -> bool {
    let x = solution * at;
    let tolerance = UNSATISFIED * at.amax().max(x.amax());
    let last = at[at.len() - 1];
    let excess = |i: usize| constraints.value(i, &x) - constraints.bounds[i] * last;
    (0..constraints.len()).all(|i| excess(i) >= -tolerance)
        && (multipliers * at).iter().all(|u| *u >= -tolerance)
}

/// Orthonormal bases of the row space of a matrix and of its complement.
fn orthonormal_split(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = matrix.ncols();
    let mut basis: Vec<DVector<f64>> = Vec::with_capacity(n);
    let lengths: Vec<f64> = matrix.row_iter().map(|row| row.norm()).collect();
    // Rows of unit length, so that a weak contact counts as much as a strong one.
    let rows = matrix.row_iter().zip(&lengths).filter(|(_, length)| **length > DEPENDENT);
    let rows: Vec<DVector<f64>> = rows.map(|(row, length)| row.transpose() / *length).collect();
    extend(&mut basis, rows, DEPENDENT);
    let rank = basis.len();
    let units = (0..n).map(|k| DVector::from_fn(n, |i, _| f64::from(u8::from(i == k)))).collect();
    extend(&mut basis, units, 1e-6);
    let side = |columns: &[DVector<f64>]| match columns {
        [] => DMatrix::zeros(n, 0),
        columns => DMatrix::from_columns(columns),
    };
    (side(&basis[..rank]), side(&basis[rank..]))
}

/// Extends an orthonormal basis by what is new in `candidates`, the most independent first.
fn extend(basis: &mut Vec<DVector<f64>>, mut candidates: Vec<DVector<f64>>, tolerance: f64) {
    let project = |vector: &mut DVector<f64>, basis: &[DVector<f64>]| {
        for axis in basis {
            let share = axis.dot(vector);
            vector.axpy(-share, axis, 1.0);
        }
    };
    for candidate in &mut candidates {
        project(candidate, basis);
    }
    while let Some((longest, length)) = candidates
        .iter()
        .map(DVector::norm)
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, length)| *length > tolerance && !interrupt::stopped())
    {
        let mut axis = candidates.swap_remove(longest) / length;
        project(&mut axis, basis);
        axis.normalize_mut();
        for candidate in &mut candidates {
            let share = axis.dot(candidate);
            candidate.axpy(-share, &axis, 1.0);
        }
        basis.push(axis);
    }
}
