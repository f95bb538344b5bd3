//! The third level: among forces that are equally good, the least `sum_i |f_i|^2 / f_i^U^2`.
//!
//! On a symmetric grasp the maximum and the sum leave a polytope of forces. Its point of least norm is unique,
//! so the forces depend on the wrench alone, and it moves continuously with the wrench. The program
//! `min |A x|^2` subject to `E x = [b; 0]`, `C x >= 0` is reduced to a least-distance problem by orthogonal
//! bases (Lawson and Hanson, "Solving Least Squares Problems", chapter 23) and solved by a dual method (Goldfarb and
//! Idnani, Mathematical Programming 27, 1983); with the active constraints known, the solution is again a linear law
//! of the wrench.

use nalgebra::{DMatrix, DVector, SVector};

use crate::columns::ImplicitColumns;
use crate::face::{Face, Role};
use crate::law::Extremes;
use crate::simplex::Simplex;

/// Unknowns beyond which the level is left out: its cost grows with their cube, and a tenth of a second is long.
pub(crate) const MAX_UNKNOWNS: usize = 768;

/// Relative size below which rows are dependent.
const DEPENDENT: f64 = 1e-11;

/// Relative size below which a gradient is rounding of the wrenches.
const UNMOVED: f64 = 1e-9;

/// Constraints may be violated by this, relative to the bounds and the solution.
const VIOLATED: f64 = 1e-12;

/// Laws steeper than this, relative to the steepest that balance needs, are rounding.
const STEEPEST: f64 = 1e6;

/// Weight of the coefficients beside the forces: it chooses among coefficients that make the same force, and
/// moves the forces by no more than its square.
pub(crate) const COEFFICIENT_WEIGHT: f64 = 1e-5;

/// The law that the third level selects at the wrench that the simplex just balanced.
#[derive(Debug, Clone)]
pub(crate) struct LeastSquaresLaw<const R: usize> {
    /// One row for each active extreme force in the face's order.
    pub(crate) coefficients: Vec<SVector<f64, R>>,
    /// The common level of the saturated contacts.
    pub(crate) level: SVector<f64, R>,
    /// Multipliers of the active constraints, which must stay nonnegative, too.
    pub(crate) multipliers: Vec<SVector<f64, R>>,
    /// What must vanish for the face to balance a wrench at all: it may span less than the grasp.
    pub(crate) equations: Vec<SVector<f64, R>>,
}

/// The program in the unknowns `x = [lambda, s]`.
struct Program {
    equations: DMatrix<f64>,
    objective: DMatrix<f64>,
    constraints: DMatrix<f64>,
}

/// Solves the third level on a face. `limits` are the `f_i^U`. `None` if rounding gets the better of it.
pub(crate) fn least_squares_law<const R: usize>(
    face: &Face,
    columns: &ImplicitColumns<R>,
    simplex: &Simplex<R>,
    extremes: Extremes<'_>,
    limits: &[f64],
) -> Option<LeastSquaresLaw<R>> {
    let edges: Vec<(usize, u32)> = (0..face.roles.len())
        .flat_map(|contact| face.edges(contact).iter().map(move |&edge| (contact, edge)))
        .collect();
    if edges.len() > MAX_UNKNOWNS {
        return None;
    }
    let program = program(face, columns, extremes, limits, &edges);
    let (range, null) = orthonormal_split(&program.equations);
    let qr = (&program.equations * &range).qr();
    let pseudoinverse = qr.r().solve_upper_triangular(&qr.q().transpose())?;
    let particular = (&range * pseudoinverse).columns(0, R).into_owned();
    let target = DVector::from_column_slice(simplex.target.as_slice());

    if null.ncols() == 0 {
        return None;
    }
    let qr = (&program.objective * &null).qr();
    let spread = qr.r().solve_upper_triangular(&DMatrix::identity(null.ncols(), null.ncols()))?;
    let directions = &null * spread;
    let unconstrained = &particular - &directions * (qr.q().tr_mul(&(&program.objective * &particular)));
    let gradients = &program.constraints * &directions;
    let bounds = -(&program.constraints * &unconstrained);
    let active = least_distance(&gradients, &(&bounds * &target))?;

    if active.len() > null.ncols() {
        return None;
    }
    // The shortest t on the active planes and its multipliers, without squaring the condition of G.
    let (steps, multipliers) = if active.is_empty() {
        (DMatrix::zeros(null.ncols(), R), DMatrix::zeros(0, R))
    } else {
        let planes = gradients.select_rows(&active).transpose().qr();
        let inner = planes.r().transpose().solve_lower_triangular(&bounds.select_rows(&active))?;
        (planes.q() * &inner, planes.r().solve_upper_triangular(&inner)?)
    };
    let solution = &unconstrained + &directions * steps;
    let tolerance = 1e-10 * target.amax().max((&solution * &target).amax());
    let least = |rows: DMatrix<f64>| (rows * &target).iter().copied().fold(0.0, f64::min);
    let worst = least(&program.constraints * &solution).min(least(multipliers.clone()));
    let unbalanced = (&program.equations * (&solution - &particular)).amax();
    let steep = solution.amax() > STEEPEST * particular.amax();
    if steep || !(worst >= -tolerance && unbalanced <= 1e-10) {
        return None;
    }
    let unspanned = DMatrix::identity(R, R) - (&program.equations * &solution).rows(0, R);
    let row = |matrix: &DMatrix<f64>, k: usize| SVector::<f64, R>::from_fn(|j, _| matrix[(k, j)]);
    Some(LeastSquaresLaw {
        coefficients: (0..edges.len()).map(|k| row(&solution, k)).collect(),
        level: if face.limited { row(&solution, edges.len()) } else { SVector::zeros() },
        multipliers: (0..multipliers.nrows()).map(|k| row(&multipliers, k)).collect(),
        equations: (0..R).map(|k| row(&unspanned, k)).filter(|rest| rest.amax() > UNMOVED).collect(),
    })
}

fn program<const R: usize>(
    face: &Face,
    columns: &ImplicitColumns<R>,
    extremes: Extremes<'_>,
    limits: &[f64],
    edges: &[(usize, u32)],
) -> Program {
    let (n, k) = (edges.len() + usize::from(face.limited), extremes.components.len());
    let with_role = |role| face.roles.iter().enumerate().filter(move |(_, r)| **r == role).map(|(i, _)| i);
    let saturated: Vec<usize> = with_role(Role::Saturated).collect();
    let free: Vec<usize> = with_role(Role::Free).filter(|_| face.limited).collect();
    let mut equations = DMatrix::zeros(R + saturated.len(), n);
    let mut objective = DMatrix::zeros(k * limits.len() + edges.len(), n);
    let signs = signs(face, extremes, edges);
    let mut constraints = DMatrix::zeros(signs.len() + free.len(), n);
    for (row, weights) in signs.iter().enumerate() {
        for &(j, weight) in weights {
            constraints[(row, j)] = weight;
        }
    }
    for (j, &(contact, edge)) in edges.iter().enumerate() {
        equations.view_mut((0, j), (R, 1)).copy_from(&columns.wrenches[edge as usize]);
        for (row, &component) in extremes.components.iter().enumerate() {
            objective[(k * contact + row, j)] = extremes.forces[edge as usize][component] / limits[contact];
        }
        objective[(k * limits.len() + j, j)] = COEFFICIENT_WEIGHT;
        if let Some(row) = saturated.iter().position(|&i| i == contact) {
            equations[(R + row, j)] = 1.0;
        }
        if let Some(row) = free.iter().position(|&i| i == contact) {
            constraints[(signs.len() + row, j)] = -1.0;
        }
    }
    if face.limited {
        equations.view_mut((R, n - 1), (saturated.len(), 1)).fill(-1.0);
        constraints.view_mut((signs.len(), n - 1), (free.len(), 1)).fill(1.0);
    }
    Program { equations, objective, constraints }
}

/// What must not be negative: a coefficient, or for a force inside its cone its distance from a facet.
fn signs(face: &Face, extremes: Extremes<'_>, edges: &[(usize, u32)]) -> Vec<Vec<(usize, f64)>> {
    let mut signs = Vec::new();
    let mut j = 0;
    while let Some(&(contact, _)) = edges.get(j) {
        let interior = extremes.interiors[contact].as_ref().filter(|_| face.inside[contact]);
        if let Some(interior) = interior {
            signs.extend(interior.facets.iter().map(|facet| (j..).zip(facet.iter().copied()).collect()));
            j += 3;
        } else {
            signs.push(vec![(j, 1.0)]);
            j += 1;
        }
    }
    signs
}

/// Orthonormal bases of the row space of a matrix and of its complement.
pub(crate) fn orthonormal_split(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
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
        .filter(|(_, length)| *length > tolerance)
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

/// Which constraints hold the shortest `t` with `G t >= h`, by Goldfarb and Idnani's dual method: the most violated
/// constraint joins, and those whose multiplier would turn negative on the way to it leave. The problem must be
/// feasible; `None` where rounding makes it look otherwise.
pub(crate) fn least_distance(gradients: &DMatrix<f64>, bounds: &DVector<f64>) -> Option<Vec<usize>> {
    let lengths: Vec<f64> = gradients.row_iter().map(|row| row.norm()).collect();
    // A constraint that the choice does not move has a gradient of rounding, however far others move.
    let smallest = UNMOVED * gradients.amax().max(1.0);
    let mut rows: Vec<usize> = (0..gradients.nrows()).filter(|&i| lengths[i] > smallest).collect();
    let normal = |i: usize| gradients.row(i).transpose() / lengths[i];
    let largest = bounds.amax();
    let mut t = DVector::<f64>::zeros(gradients.ncols());
    let (mut active, mut multipliers) = (Vec::<usize>::new(), Vec::<f64>::new());
    for _ in 0..3 * gradients.nrows() + 10 {
        let violation = |i: usize, t: &DVector<f64>| (bounds[i] - gradients.row(i).tr_dot(t)) / lengths[i];
        let rounding = |i: usize| VIOLATED * (largest / lengths[i] + t.norm());
        let violated =
            rows.iter().copied().filter(|i| !active.contains(i) && violation(*i, &t) > rounding(*i));
        let worst = violated.max_by(|&i, &j| violation(i, &t).total_cmp(&violation(j, &t)));
        let Some(worst) = worst else { return Some(active) };
        let before = (active.clone(), multipliers.clone());
        let mut gain = 0.0;
        let joins = loop {
            let (along, shares) =
                beyond(&active.iter().map(|&i| normal(i)).collect::<Vec<_>>(), normal(worst))?;
            let free = along.norm_squared();
            let full = if free > UNMOVED * UNMOVED { violation(worst, &t) / free } else { f64::INFINITY };
            let until = |k: usize| if shares[k] > 0.0 { multipliers[k] / shares[k] } else { f64::INFINITY };
            let first = (0..active.len()).min_by(|&j, &k| until(j).total_cmp(&until(k)));
            let step = first.map_or(full, |k| full.min(until(k)));
            if !step.is_finite() {
                break false;
            }
            if full.is_finite() {
                t += along * step;
            }
            multipliers.iter_mut().zip(shares.iter()).for_each(|(u, share)| *u -= step * share);
            gain += step;
            match first.filter(|_| step < full) {
                Some(k) => {
                    active.remove(k);
                    multipliers.remove(k);
                }
                None => break true,
            }
        };
        if joins {
            active.push(worst);
            multipliers.push(gain);
        } else if violation(worst, &t) <= UNMOVED * (largest / lengths[worst] + t.norm()) {
            // The active constraints imply it but for rounding; nothing has moved.
            (active, multipliers) = before;
            rows.retain(|&i| i != worst);
        } else {
            return None;
        }
    }
    None
}

/// What of a vector lies beyond the span of others, and the coefficients of what lies within.
fn beyond(others: &[DVector<f64>], vector: DVector<f64>) -> Option<(DVector<f64>, DVector<f64>)> {
    if others.is_empty() {
        return Some((vector, DVector::zeros(0)));
    }
    let qr = DMatrix::from_columns(others).qr();
    let q = qr.q();
    let within = q.tr_mul(&vector);
    let coefficients = qr.r().solve_upper_triangular(&within)?;
    Some((vector - q * within, coefficients))
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
            let active = least_distance(&gradients, &bounds).unwrap();
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
