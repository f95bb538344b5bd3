//! Linear equations with orthonormal rows, computed in 32 digits.
//!
//! Rows that differ by a billionth determine nine digits less in doubles. Orthonormal rows of the same equations
//! determine all digits, and may be rounded.

use nalgebra::{DMatrix, DVector};

use crate::linalg::double_double::DoubleDouble;

/// One equation: its coefficients, then its right-hand side.
pub(crate) type Equation = Vec<DoubleDouble>;

/// The equations with orthonormal rows. Rows of a length below `smallest` are dependent on the others; `None` where one
/// of them contradicts the others by more than `largest_rest`.
pub(crate) fn orthonormal_equations(
    mut equations: Vec<Equation>,
    unknowns: usize,
    smallest: f64,
    largest_rest: f64,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let product = |a: &Equation, b: &Equation| {
        let terms = a.iter().zip(b).take(unknowns);
        terms.fold(DoubleDouble::ZERO, |sum, (a, b)| sum + *a * *b)
    };
    let mut chosen: Vec<Equation> = Vec::with_capacity(equations.len());
    while let Some((row, squared)) = equations
        .iter()
        .map(|row| product(row, row))
        .enumerate()
        .max_by(|a, b| a.1.value().total_cmp(&b.1.value()))
        .filter(|(_, squared)| squared.value() > smallest * smallest)
    {
        let length = squared.sqrt();
        let unit: Equation = equations.swap_remove(row).into_iter().map(|x| x / length).collect();
        for other in &mut equations {
            let share = product(other, &unit);
            other.iter_mut().zip(&unit).for_each(|(x, y)| *x -= share * *y);
        }
        chosen.push(unit);
    }
    let consistent = equations.iter().all(|rest| rest[unknowns].value().abs() <= largest_rest);
    consistent.then(|| {
        let matrix = DMatrix::from_fn(chosen.len(), unknowns, |i, j| chosen[i][j].value());
        (matrix, DVector::from_fn(chosen.len(), |i, _| chosen[i][unknowns].value()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_that_differ_by_a_billionth_keep_their_solution() {
        let solution = [0.3, -1.7, 2.9, 0.11];
        let noise = |i: usize, j: usize| 1e-9 * ((3 * i + 5 * j) as f64).sin();
        let row = |i: usize| -> Equation {
            let own: Vec<_> = (0..4).map(|j| DoubleDouble::from(1.0) + noise(i, j).into()).collect();
            let right = own.iter().zip(solution).fold(DoubleDouble::ZERO, |sum, (a, x)| sum + a.times(x));
            own.into_iter().chain([right]).collect()
        };
        let (matrix, right) = orthonormal_equations((0..3).map(row).collect(), 4, 1e-12, 1e-12).unwrap();
        assert_eq!(matrix.nrows(), 3);
        assert!((&matrix * matrix.transpose() - DMatrix::identity(3, 3)).amax() < 1e-15);
        assert!((matrix * DVector::from_column_slice(&solution) - right).amax() < 1e-15);
        let twice = vec![row(0), row(0)];
        assert_eq!(orthonormal_equations(twice, 4, 1e-12, 1e-12).unwrap().0.nrows(), 1);
        let mut against = row(0);
        against[4] += DoubleDouble::from(1e-3);
        assert!(orthonormal_equations(vec![row(0), against], 4, 1e-12, 1e-12).is_none());
    }
}
