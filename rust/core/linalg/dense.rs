//! Small dense solves on the stack.
//!
//! nalgebra's decompositions of `SMatrix<f64, D, D>` need type-level bounds on `D` that would spread through
//! every public signature; these few lines keep `const D` the only parameter.

use crate::grasp::{Wrench, unit};

/// The vector `y` with `y . v_k = 1` for all `D` vertices, by elimination with full pivoting; `None` where
/// the vertices do not span.
pub(crate) fn plane_through<const D: usize>(vertices: &[Wrench<D>; D]) -> Option<Wrench<D>> {
    solve(std::array::from_fn(|k| std::array::from_fn(|c| vertices[k][c])), [1.0; D])
}

/// Whether a ray from the origin passes through the simplex of `D` vertices.
pub(crate) fn pierces<const D: usize>(ray: &Wrench<D>, vertices: &[Wrench<D>; D]) -> bool {
    let units = vertices.map(|vertex| unit(&vertex));
    let rows = std::array::from_fn(|c| std::array::from_fn(|k| units[k][c]));
    solve(rows, std::array::from_fn(|c| ray[c]))
        .is_some_and(|shares: Wrench<D>| shares.iter().all(|share| *share > 0.0))
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
