//! The third level where doubles cannot tell the optimal face: least squares with weighted rows.
//!
//! With the optimal objective known, the least `sum_i |f_i|^2 / f_i^U^2` is a nonnegative least-squares problem: balance
//! and objective are rows of a large weight (Lawson and Hanson, "Solving Least Squares Problems", chapters 22 and 23).
//! Rows that differ by a billionth count for nothing beside such a weight, so forces do not follow rounding of
//! positions. What the weighted rows leave is added to the right-hand side, and the problem solved again.

use nalgebra::{DMatrix, DVector};

use crate::force::double_double::columns::{DoubleDoubleColumns, ROWS};
use crate::force::least_norm::face_program::COEFFICIENT_WEIGHT;
use crate::force::simplex::pricing::Objective;
use crate::interrupt;
use crate::tolerances::LOST_OBJECTIVE;

/// How much more balance and objective weigh than the forces.
const WEIGHT: f64 = 1e5;

/// Rounds in which what is left over is corrected.
const ROUNDS: usize = 4;

/// Extreme forces beyond which the level is left out.
pub(crate) const MAX_UNKNOWNS: usize = 400;

/// Changes of extreme forces that take part before the level is given up.
const MAX_CHANGES: usize = 600;

/// What is known of the optimum, scaled like the right-hand side.
pub(crate) struct Optimum<'a> {
    pub(crate) target: &'a [f64; ROWS],
    pub(crate) multiplier: &'a [f64; ROWS],
    pub(crate) sigma_max: f64,
    pub(crate) sigma_sum: f64,
}

/// The coefficient of each extreme force that takes part: contact, edge, level.
pub(crate) fn least_squares_levels(
    columns: &DoubleDoubleColumns,
    components: &[usize],
    limits: &[f64],
    optimum: &Optimum<'_>,
) -> Option<Vec<(usize, usize, f64)>> {
    let contacts = columns.num_contacts();
    let mut unknowns = Vec::new();
    for contact in 0..contacts {
        let (wrenches, _) = columns.listed(contact)?;
        let reach = |w: &[f64; 6]| w.iter().zip(optimum.multiplier).map(|(w, z)| w * z).sum::<f64>();
        let best = wrenches.iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
        let needed = if columns.objective() == Objective::Sum { 1.0 } else { 0.0 };
        let least = best.max(needed) - LOST_OBJECTIVE;
        let taking_part = wrenches.iter().enumerate().filter(|(_, w)| reach(w) >= least);
        unknowns.extend(taking_part.map(|(edge, _)| (contact, edge)));
    }
    let n = unknowns.len();
    if n == 0 || n > MAX_UNKNOWNS {
        return None;
    }
    let size = optimum.sigma_max;
    let (dim, k) = (columns.dim, components.len());
    let bounded = columns.objective() != Objective::Sum;
    let weighted = matches!(columns.objective(), Objective::Weighted(_));
    // Unknowns: coefficients, then for the maximum what each contact stays below it, and with a weight the maximum.
    let slacks = if bounded { contacts } else { 0 };
    let total = n + slacks + usize::from(weighted);
    let heavy = dim + slacks + 1;
    let mut matrix = DMatrix::<f64>::zeros(heavy + k * contacts + n, total);
    let mut right = DVector::<f64>::zeros(matrix.nrows());
    for (j, &(contact, edge)) in unknowns.iter().enumerate() {
        let (wrenches, forces) = columns.listed(contact)?;
        for row in 0..dim {
            matrix[(row, j)] = WEIGHT * wrenches[edge][row];
        }
        if bounded {
            matrix[(dim + contact, j)] = WEIGHT;
        }
        matrix[(dim + slacks, j)] = WEIGHT;
        for (row, &component) in components.iter().enumerate() {
            matrix[(heavy + k * contact + row, j)] = forces[edge][component] / limits[contact];
        }
        matrix[(heavy + k * contacts + j, j)] = COEFFICIENT_WEIGHT;
    }
    for row in 0..dim {
        right[row] = WEIGHT * optimum.target[row] / size;
    }
    for contact in 0..slacks {
        matrix[(dim + contact, n + contact)] = WEIGHT;
        if weighted {
            matrix[(dim + contact, total - 1)] = -WEIGHT;
        } else {
            right[dim + contact] = WEIGHT;
        }
    }
    let mut sum = optimum.sigma_sum;
    if let Objective::Weighted(weight) = columns.objective() {
        let row = dim + slacks;
        matrix.row_mut(row).scale_mut(weight);
        matrix[(row, total - 1)] = WEIGHT;
        sum = optimum.sigma_max + weight * optimum.sigma_sum;
    }
    right[dim + slacks] = WEIGHT * sum / size;
    let mut passive = Vec::new();
    let mut solution = DVector::zeros(total);
    let mut corrected = right.clone();
    for _ in 0..ROUNDS {
        solution = nonnegative_least_squares(&matrix, &corrected, &mut passive)?;
        let rest = &right - &matrix * &solution;
        if rest.rows(0, heavy).amax() <= 1e-15 * WEIGHT {
            break;
        }
        let mut heavy_rows = corrected.rows_mut(0, heavy);
        heavy_rows += rest.rows(0, heavy);
    }
    let levels = unknowns.into_iter().zip(solution.iter()).filter(|(_, level)| **level > 0.0);
    Some(levels.map(|((contact, edge), level)| (contact, edge, level * size)).collect())
}

/// Lawson and Hanson's method from the unknowns in `passive`, which are left as they end.
fn nonnegative_least_squares(
    matrix: &DMatrix<f64>,
    right: &DVector<f64>,
    passive: &mut Vec<usize>,
) -> Option<DVector<f64>> {
    let mut x = DVector::<f64>::zeros(matrix.ncols());
    let noise = 1e-15 * WEIGHT * WEIGHT;
    let mut changes = 0;
    let mut entering = None;
    loop {
        // The inner loop: shrink until the least-squares solution over the passive unknowns is positive.
        while !passive.is_empty() {
            changes += 1;
            if changes > MAX_CHANGES || interrupt::stopped() {
                return None;
            }
            let free = solve_passive(matrix, right, passive)?;
            let negative = |k: &usize| free[*k] <= 0.0;
            let Some(first) = (0..passive.len()).filter(negative).min_by(|&a, &b| {
                let step = |k: usize| x[passive[k]] / (x[passive[k]] - free[k]);
                step(a).total_cmp(&step(b))
            }) else {
                x.fill(0.0);
                passive.iter().zip(free.iter()).for_each(|(&j, level)| x[j] = *level);
                break;
            };
            let step = (x[passive[first]] / (x[passive[first]] - free[first])).clamp(0.0, 1.0);
            for (k, &j) in passive.iter().enumerate() {
                x[j] += step * (free[k] - x[j]);
            }
            let leaving = passive.swap_remove(first);
            x[leaving] = 0.0;
            if entering == Some(leaving) {
                // Its gain was rounding.
                return Some(x);
            }
        }
        let gradient = matrix.tr_mul(&(right - matrix * &x));
        let best = (0..x.len())
            .filter(|j| !passive.contains(j))
            .max_by(|&a, &b| gradient[a].total_cmp(&gradient[b]));
        match best.filter(|&j| gradient[j] > noise.max(1e-9)) {
            Some(j) => {
                passive.push(j);
                entering = Some(j);
            }
            None => return Some(x),
        }
    }
}

fn solve_passive(matrix: &DMatrix<f64>, right: &DVector<f64>, passive: &[usize]) -> Option<DVector<f64>> {
    let columns = matrix.select_columns(passive);
    let rows: Vec<usize> =
        (0..columns.nrows()).filter(|&i| columns.row(i).iter().any(|x| *x != 0.0)).collect();
    if rows.len() < passive.len() {
        return None;
    }
    let qr = columns.select_rows(&rows).qr();
    let mut projected = qr.q().tr_mul(&right.select_rows(&rows));
    qr.r().solve_upper_triangular_mut(&mut projected).then_some(projected)
}
