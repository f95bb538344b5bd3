//! The least distance to a polyhedron by a dual active-set method (Goldfarb and Idnani, Mathematical Programming 27, 1983).

use nalgebra::{DMatrix, DVector};

use crate::interrupt;
use crate::linalg::active_planes::ActivePlanes;
use crate::tolerances::{UNMOVED, VIOLATED};

/// Rows of `C` with their bounds, by their nonzero entries.
#[derive(Debug, Clone)]
pub(crate) struct Constraints {
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
    pub(crate) bounds: Vec<f64>,
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

    pub(crate) fn len(&self) -> usize {
        self.bounds.len()
    }

    fn row(&self, i: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[i]..self.starts[i + 1]]
    }

    pub(crate) fn value(&self, i: usize, x: &DVector<f64>) -> f64 {
        self.row(i).iter().map(|&(j, weight)| weight * x[j]).sum()
    }

    /// Row `i` times a matrix.
    pub(crate) fn times(&self, i: usize, matrix: &DMatrix<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(matrix.ncols());
        for &(j, weight) in self.row(i) {
            product.iter_mut().zip(matrix.row(j).iter()).for_each(|(sum, x)| *sum += weight * x);
        }
        product
    }
}

/// The active constraints of the least `|t|` with `C (x + V t) >= c last`.
///
/// The most violated constraint joins. Constraints whose multiplier would turn negative on the way to it leave. The
/// problem must be feasible. `None` where rounding makes it look otherwise, after `20 dim + 100` steps, or when
/// interrupted.
pub(crate) fn least_distance(
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
    use crate::test_numbers::numbers;

    #[test]
    fn the_shortest_vector_keeps_every_constraint_however_far_away_it_is() {
        let mut next = numbers(1);
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
