//! Small dense solves on the stack.
//!
//! nalgebra's decompositions of `SMatrix<f64, D, D>` need type-level bounds on `D` that would spread through
//! every public signature; these few lines keep `const D` the only parameter.

use nalgebra::{SMatrix, SVector};

use crate::grasp::{Wrench, unit};
use crate::linalg::real::Real;

/// The vector `y` with `y . v_k = 1` for all `D` vertices, by elimination with full pivoting; `None` where
/// the vertices do not span.
pub(crate) fn plane_through<const D: usize>(vertices: &[Wrench<D>; D]) -> Option<Wrench<D>> {
    solve(std::array::from_fn(|k| std::array::from_fn(|c| vertices[k][c])), [1.0; D])
}

/// Whether a ray from the origin passes through the simplex of `D` vertices; `None` where rounding leaves it open.
pub(crate) fn pierces<const D: usize>(ray: &Wrench<D>, vertices: &[Wrench<D>; D]) -> Option<bool> {
    let (ray, units) = (unit(ray), vertices.map(|vertex| unit(&vertex)));
    // A ray in the cone of unit vectors is a sum of them with shares that add up to 1 at least: a direction along which
    // all vertices reach further than the ray separates them.
    for axis in 0..D {
        let mut u = ray * -ray[axis];
        u[axis] += 1.0;
        let reach = units.map(|v| u.dot(&v));
        let beyond = u.dot(&ray).abs() + 32.0 * f64::EPSILON;
        if reach.iter().all(|reach| *reach > beyond) || reach.iter().all(|reach| *reach < -beyond) {
            return Some(false);
        }
    }
    // The shares by an approximate inverse `R` of the matrix `V` of vertices: with `|I - R V| <= e < 1` in the norm of the
    // largest row sum, they are right to within `e / (1 - e)` of the largest.
    let rows: [[f64; D]; D] = std::array::from_fn(|c| std::array::from_fn(|k| units[k][c]));
    let mut columns = [Wrench::<D>::zeros(); D];
    for (j, column) in columns.iter_mut().enumerate() {
        *column = solve(rows, std::array::from_fn(|c| f64::from(u8::from(c == j))))?;
    }
    let inverse = SMatrix::<f64, D, D>::from_fn(|k, c| columns[c][k]);
    let matrix = SMatrix::<f64, D, D>::from_fn(|c, k| units[k][c]);
    let row_sum = |m: &SMatrix<f64, D, D>| m.row_iter().map(|row| row.abs().sum()).fold(0.0, f64::max);
    let rounded = 32.0 * f64::EPSILON * row_sum(&inverse);
    let e = row_sum(&(inverse * matrix - SMatrix::identity())) + D as f64 * rounded;
    // Not less, rather than greater: a number that is none decides nothing.
    if e.partial_cmp(&0.5) != Some(std::cmp::Ordering::Less) {
        return None;
    }
    let shares = inverse * ray;
    let error = (shares.amax() + rounded) * e / (1.0 - e) + rounded;
    match shares.min() {
        least if least > error => Some(true),
        least if least < -error => Some(false),
        _ => None,
    }
}

fn solve<const D: usize>(mut rows: [[f64; D]; D], mut right: [f64; D]) -> Option<Wrench<D>> {
    let mut columns: [usize; D] = std::array::from_fn(|c| c);
    // Rows of very different length (a tiny simplex beside large wrenches) pivot fairly once scaled.
    for (row, right) in rows.iter_mut().zip(&mut right) {
        let scale = row.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
        if scale == 0.0 {
            return None;
        }
        *row = row.map(|x| x / scale);
        *right /= scale;
    }
    // So do columns: coordinates in which all vertices are small beside others.
    let scales: [f64; D] =
        std::array::from_fn(|c| rows.iter().fold(0.0_f64, |scale, row| scale.max(row[c].abs())));
    if scales.contains(&0.0) {
        return None;
    }
    for row in &mut rows {
        for (x, scale) in row.iter_mut().zip(&scales) {
            *x /= scale;
        }
    }
    for step in 0..D {
        let (r, c) = largest(&rows, step);
        if rows[r][c].abs() < 1e-14 {
            return None;
        }
        rows.swap(step, r);
        right.swap(step, r);
        for row in &mut rows {
            row.swap(step, c);
        }
        columns.swap(step, c);
        let pivot = rows[step];
        let pivot_right = right[step];
        for (row, right) in rows.iter_mut().zip(&mut right).skip(step + 1) {
            let factor = row[step] / pivot[step];
            for c in step + 1..D {
                row[c] -= factor * pivot[c];
            }
            *right -= factor * pivot_right;
        }
    }
    let mut y = Wrench::<D>::zeros();
    for step in (0..D).rev() {
        let known: f64 = (step + 1..D).map(|c| rows[step][c] * y[columns[c]]).sum();
        y[columns[step]] = (right[step] - known) / rows[step][step];
    }
    for (y, scale) in y.iter_mut().zip(&scales) {
        *y /= scale;
    }
    Some(y)
}

fn largest<const D: usize>(rows: &[[f64; D]; D], step: usize) -> (usize, usize) {
    let mut at = (step, step);
    for r in step..D {
        for c in step..D {
            if rows[r][c].abs() > rows[at.0][at.1].abs() {
                at = (r, c);
            }
        }
    }
    at
}

/// Gauss-Jordan elimination with row pivoting; `None` where no pivot exceeds `smallest`.
pub(crate) fn invert<const R: usize>(
    matrix: &SMatrix<f64, R, R>,
    smallest: f64,
) -> Option<SMatrix<f64, R, R>> {
    let mut a = *matrix;
    let mut inverse = SMatrix::<f64, R, R>::identity();
    for k in 0..R {
        let pivot = (k..R).fold(k, |best, i| if a[(i, k)].abs() > a[(best, k)].abs() { i } else { best });
        let scale = a[(pivot, k)];
        if !(scale.abs() > smallest && scale.is_finite()) {
            return None;
        }
        a.swap_rows(k, pivot);
        inverse.swap_rows(k, pivot);
        for j in 0..R {
            a[(k, j)] /= scale;
            inverse[(k, j)] /= scale;
        }
        for i in (0..R).filter(|&i| i != k) {
            let factor = a[(i, k)];
            if factor == 0.0 {
                continue;
            }
            for j in 0..R {
                a[(i, j)] -= factor * a[(k, j)];
                inverse[(i, j)] -= factor * inverse[(k, j)];
            }
        }
    }
    Some(inverse)
}

/// Solves with a definite matrix, of which the lower triangle is given and overwritten, by `L D L^T` with pivots of at least
/// `smallest`: `D` divisions.
#[inline]
pub(crate) fn solve_definite<const D: usize, R: Real>(
    matrix: &mut SMatrix<R, D, D>,
    right: &SVector<R, D>,
    smallest: f64,
) -> SVector<R, D> {
    let mut solved = *right;
    let mut inverse = [R::zero(); D];
    for k in 0..D {
        // Rounding may make a pivot negative.
        let pivot = matrix[(k, k)];
        inverse[k] = R::from(1.0) / if pivot.value() < smallest { R::from(smallest) } else { pivot };
        for c in k + 1..D {
            let by = matrix[(c, k)] * inverse[k];
            for r in c..D {
                let part = matrix[(r, k)] * by;
                matrix[(r, c)] -= part;
            }
            let part = by * solved[k];
            solved[c] -= part;
        }
    }
    for k in (0..D).rev() {
        let mut sum = solved[k];
        for r in k + 1..D {
            sum -= matrix[(r, k)] * solved[r];
        }
        solved[k] = sum * inverse[k];
    }
    solved
}
