//! The least norm over a polyhedron: `min |A x|^2` subject to `E x = D p`, `C x >= c p_k`, for parameters `p`.
//!
//! Orthogonal bases reduce it to a least-distance problem (Lawson and Hanson, "Solving Least Squares Problems", chapter
//! 23). A dual method finds the active constraints (Goldfarb and Idnani, Mathematical Programming 27, 1983). With them
//! known, the solution is a linear function of the parameters.

use nalgebra::{DMatrix, DVector};

use crate::force::least_norm::active_planes::ActivePlanes;
use crate::interrupt;
use crate::tolerances::{DEPENDENT, UNMOVED, UNSATISFIED, VIOLATED};

/// Solutions steeper than this in their parameters, relative to the steepest that the equations need, are rounding.
const STEEPEST: f64 = 1e6;

/// Rows of `C` with their bounds, by their nonzero entries.
#[derive(Debug, Clone)]
pub(crate) struct Constraints {
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
    bounds: Vec<f64>,
    /// Gradients below this, relative to the largest, are rounding.
    smallest_gradient: f64,
}

impl Constraints {
    pub(crate) fn new() -> Self {
        Self::with_smallest_gradient(UNMOVED)
    }

    /// For equations that are better than doubles.
    pub(crate) fn with_smallest_gradient(smallest_gradient: f64) -> Self {
        Self { starts: vec![0], entries: Vec::new(), bounds: Vec::new(), smallest_gradient }
    }

    /// Appends `row . x >= bound p_k`, with the last parameter `p_k`.
    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = (usize, f64)>, bound: f64) {
        self.entries.extend(row);
        self.starts.push(self.entries.len());
        self.bounds.push(bound);
    }

    fn len(&self) -> usize {
        self.bounds.len()
    }

    fn row(&self, i: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[i]..self.starts[i + 1]]
    }

    fn value(&self, i: usize, x: &DVector<f64>) -> f64 {
        self.row(i).iter().map(|&(j, weight)| weight * x[j]).sum()
    }

    /// Row `i` times a matrix.
    fn times(&self, i: usize, matrix: &DMatrix<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(matrix.ncols());
        for &(j, weight) in self.row(i) {
            product.iter_mut().zip(matrix.row(j).iter()).for_each(|(sum, x)| *sum += weight * x);
        }
        product
    }
}

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
            && solution.amax() <= STEEPEST * particular.amax();
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

/// Which constraints hold the least `|t|` with `C (x + V t) >= c last`, by Goldfarb and Idnani's dual method: the most
/// violated constraint joins, and those whose multiplier would turn negative on the way to it leave. The problem must
/// be feasible; `None` where rounding makes it look otherwise, after `20 dim + 100` steps, or when interrupted.
fn least_distance(
    constraints: &Constraints,
    last: f64,
    x: &DVector<f64>,
    directions: &DMatrix<f64>,
) -> Option<Vec<usize>> {
    let dim = directions.ncols();
    let excess = |i: usize, x: &DVector<f64>| constraints.bounds[i] * last - constraints.value(i, x);
    let largest = (0..constraints.len()).map(|i| excess(i, x).abs()).fold(0.0, f64::max);
    // A constraint that the choice does not move has a gradient of rounding, however far others move.
    let smallest = constraints.smallest_gradient * directions.amax().max(1.0);
    // Lengths of the gradients, once they are asked for; zero for constraints that are left out.
    let mut lengths = vec![f64::NAN; constraints.len()];
    let mut planes = ActivePlanes::new();
    let (mut t, mut here) = (DVector::<f64>::zeros(dim), x.clone());
    for _ in 0..20 * dim + 100 {
        if interrupt::stopped() {
            return None;
        }
        let size = t.norm();
        let mut worst: Option<(usize, f64)> = None;
        for (i, length) in lengths.iter_mut().enumerate() {
            let excess = excess(i, &here);
            if excess <= VIOLATED * largest || planes.contains(i) {
                continue;
            }
            if length.is_nan() {
                let gradient = constraints.times(i, directions).norm();
                *length = if gradient > smallest { gradient } else { 0.0 };
            }
            let distance = excess / *length;
            let counts = *length > 0.0 && distance > VIOLATED * (largest / *length + size);
            if counts && worst.is_none_or(|(_, most)| distance > most) {
                worst = Some((i, distance));
            }
        }
        let Some((worst, mut distance)) = worst else { return Some(planes.into_active()) };
        let normal = constraints.times(worst, directions) / lengths[worst];
        let (before, mut gain) = (planes.clone(), 0.0);
        let joins = loop {
            let (along, coordinates) = planes.beyond(&normal);
            let shares = planes.shares(&coordinates)?;
            let free = along.norm_squared();
            let full = if free > UNMOVED * UNMOVED { distance / free } else { f64::INFINITY };
            let first = planes.first_to_leave(&shares);
            let step = first.map_or(full, |(_, until)| full.min(until));
            if !step.is_finite() {
                break false;
            }
            if full.is_finite() {
                t.axpy(step, &along, 1.0);
                distance -= step * free;
            }
            planes.ease(&shares, step);
            gain += step;
            if let Some((k, _)) = first.filter(|(_, until)| *until < full) {
                planes.leave(k);
            } else {
                planes.join(worst, gain, along, coordinates);
                break true;
            }
        };
        if joins {
            here = x + directions * &t;
        } else if distance <= UNMOVED * (largest / lengths[worst] + t.norm()) {
            // The active constraints imply it but for rounding; nothing has moved.
            planes = before;
            lengths[worst] = 0.0;
        } else {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cheap sequence of numbers between -1 and 1.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn the_shortest_vector_keeps_every_constraint_however_far_away_it_is() {
        let mut next = numbers();
        for case in 0..2000 {
            let (dim, rows) = (1 + case % 6, 1 + case % 11);
            // As steep as the coefficients that hardly count make them.
            let gradients = DMatrix::from_fn(rows, dim, |_, j| next() * if j % 2 == 0 { 1.0 } else { 1e5 });
            let inside = DVector::from_fn(dim, |_, _| next() * 1e5);
            let bounds = &gradients * &inside
                - DVector::from_fn(rows, |i, _| if i % 2 == 0 { 0.0 } else { next().abs() });
            let mut constraints = Constraints::new();
            for (row, bound) in gradients.row_iter().zip(bounds.iter()) {
                constraints.push(row.iter().copied().enumerate(), *bound);
            }
            let zero = DVector::zeros(dim);
            let active = least_distance(&constraints, 1.0, &zero, &DMatrix::identity(dim, dim)).unwrap();
            assert!(active.len() <= dim);
            let mut t = DVector::<f64>::zeros(dim);
            if !active.is_empty() {
                let planes = gradients.select_rows(&active).transpose().qr();
                let inner =
                    planes.r().transpose().solve_lower_triangular(&bounds.select_rows(&active)).unwrap();
                let multipliers = planes.r().solve_upper_triangular(&inner).unwrap();
                let scaled = multipliers.iter().zip(&active).map(|(u, &i)| u * gradients.row(i).norm());
                assert!(scaled.fold(0.0, f64::min) >= -1e-8 * t.norm().max(1.0), "{case}: {multipliers}");
                t = planes.q() * inner;
            }
            let violated = (&bounds - &gradients * &t).max();
            let size = gradients.amax() * t.norm().max(inside.norm());
            assert!(violated <= UNMOVED * size, "{case}: {violated:e} of {size:e}");
            assert!(t.norm() <= inside.norm() * (1.0 + 1e-9), "{case}");
        }
    }
}
