//! The forces on an optimal face as a linear map of the wrench (Eqs. 4 and 11).
//!
//! The unknowns are the common level `s` of the saturated contacts and the coefficients `lambda_ih` of the
//! active extreme forces; of each saturated contact one coefficient follows from the others. Usually there
//! are exactly as many unknowns as equations, and the forces are unique. Otherwise the least-squares level
//! chooses among them.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use crate::force::least_norm::face_program::{Balance, Chosen, FaceProgram};
use crate::force::linear_cones::cone_interior::Interior;
use crate::force::linear_cones::critical_region::CriticalRegion;
use crate::force::linear_cones::optimal_face::{ContactStatus, OptimalFace};
use crate::force::simplex::columns::ImplicitColumns;
use crate::force::simplex::primal::Simplex;
use crate::grasp::contact::ContactForce;
use crate::linalg::dense::invert;
use crate::tolerances::{DEPENDENT, ROUNDED_FORCES, UNMOVED};

/// What turns coefficients into forces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extremes<'a> {
    /// Extreme forces of all contacts.
    pub(crate) forces: &'a [ContactForce],
    /// Which components of a contact force exist.
    pub(crate) components: &'static [usize],
    /// Largest force of each contact at a share of one, where limits are far apart; else empty.
    pub(crate) strengths: &'a [f64],
    /// The cones whose interior is described by facets.
    pub(crate) interiors: &'a [Option<Interior>],
}

/// The unique forces on a face, if its unknowns are independent: coefficients of each active extreme force, in
/// the face's order, and of the common level.
///
/// `rank` rows of the equilibrated wrenches are not zero.
pub(crate) fn unique_forces<const R: usize>(
    face: &OptimalFace,
    columns: &ImplicitColumns<R>,
    rank: usize,
    coefficients: &mut Vec<SVector<f64, R>>,
) -> Option<SVector<f64, R>> {
    let mut matrix = unknowns(face, columns, rank)?;
    // Columns of unit size, so that a weak contact's unknowns are as independent as a strong one's.
    let sizes = SVector::<f64, R>::from_fn(|k, _| matrix.column(k).amax());
    if sizes.iter().any(|size| size.is_nan() || *size <= 0.0) {
        return None;
    }
    for (mut column, size) in matrix.column_iter_mut().zip(sizes.iter()) {
        column /= *size;
    }
    let inverse = invert(&matrix, DEPENDENT)?;
    let error = SMatrix::<f64, R, R>::identity() - matrix * inverse;
    let inverse = if error.amax() > ROUNDED_FORCES { inverse + inverse * error } else { inverse };
    coefficients.clear();
    let mut next = 0;
    let mut take = || {
        next += 1;
        inverse.row(next - 1).transpose() / sizes[next - 1]
    };
    let level = if face.limited { take() } else { SVector::zeros() };
    for (contact, status) in face.statuses.iter().enumerate() {
        let count = face.edges(contact).len();
        if *status == ContactStatus::Saturated {
            let first = coefficients.len();
            coefficients.push(level);
            for _ in 1..count {
                let coefficient = take();
                coefficients[first] -= coefficient;
                coefficients.push(coefficient);
            }
        } else {
            for _ in 0..count {
                coefficients.push(take());
            }
        }
    }
    Some(level)
}

/// The forces that the third level selects at the wrench that the simplex just balanced.
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

/// The forces of least norm on a face as a linear map of the wrench. `limits` are the `f_i^U`. `None` if nothing is left
/// to choose, or if rounding prevents it.
pub(crate) fn least_norm_forces<const R: usize>(
    face: &OptimalFace,
    columns: &ImplicitColumns<R>,
    simplex: &Simplex<R>,
    extremes: Extremes<'_>,
    limits: &[f64],
) -> Option<LeastSquaresLaw<R>> {
    let Extremes { forces, components, interiors, .. } = extremes;
    let program = FaceProgram { face, components, interiors, limits, least: &[], level: None };
    let at = DVector::from_column_slice(simplex.target.as_slice());
    let balance = Balance { right: DMatrix::identity(R, R), at };
    let chosen = program.solve(&balance, |i, edge| (columns.wrench(i, edge), forces[edge as usize]))?;
    let Chosen::LeastNorm(least) = chosen else { return None };
    let row = |matrix: &DMatrix<f64>, k: usize| SVector::<f64, R>::from_fn(|j, _| matrix[(k, j)]);
    let count = face.all_edges().count();
    let coefficients: Vec<_> = (0..count).map(|k| row(&least.solution, k)).collect();
    let mut unspanned = SMatrix::<f64, R, R>::identity();
    for ((i, edge), coefficient) in face.all_edges().zip(&coefficients) {
        unspanned -= columns.wrench(i, edge) * coefficient.transpose();
    }
    let rows = unspanned.row_iter().map(|row| row.transpose());
    Some(LeastSquaresLaw {
        level: if face.limited { row(&least.solution, count) } else { SVector::zeros() },
        multipliers: (0..least.multipliers.nrows()).map(|k| row(&least.multipliers, k)).collect(),
        equations: rows.filter(|rest| rest.amax() > UNMOVED).collect(),
        coefficients,
    })
}

/// The forces of one basis, one of several optima perhaps: `alpha = B^-1 b`, added up over the columns (Eq. 31).
pub(crate) fn basis_forces<const R: usize>(
    face: &OptimalFace,
    simplex: &Simplex<R>,
    coefficients: &mut Vec<SVector<f64, R>>,
) -> SVector<f64, R> {
    coefficients.clear();
    let rows = || (0..R).filter(|&row| !simplex.basis.artificial[row]);
    let level = |row: usize| simplex.basis.inverse.row(row).transpose();
    for contact in 0..face.statuses.len() {
        for &edge in face.edges(contact) {
            let users = rows().filter(|&row| simplex.basis.edges(row)[contact] == edge);
            coefficients.push(users.map(level).sum());
        }
    }
    rows().map(level).sum()
}

/// How far the forces are from balancing the wrench that the simplex balanced.
pub(crate) fn unbalanced<const R: usize>(
    face: &OptimalFace,
    columns: &ImplicitColumns<R>,
    coefficients: &[SVector<f64, R>],
    target: &SVector<f64, R>,
) -> f64 {
    let forces = face.all_edges().zip(coefficients);
    let forces = forces.map(|((i, edge), c)| columns.wrench(i, edge) * c.dot(target));
    (forces.sum::<SVector<f64, R>>() - target).amax()
}

/// How far the forces' objective at the simplex's target is from the multipliers' (Eq. 26), relative.
pub(crate) fn duality_gap<const R: usize>(
    face: &OptimalFace,
    columns: &ImplicitColumns<R>,
    coefficients: &[SVector<f64, R>],
    simplex: &Simplex<R>,
) -> f64 {
    let (mut largest, mut sum, mut next) = (0.0_f64, 0.0, 0);
    for contact in 0..face.statuses.len() {
        let count = face.edges(contact).len();
        let normal: f64 = coefficients[next..next + count].iter().map(|c| c.dot(&simplex.target)).sum();
        next += count;
        largest = largest.max(normal);
        sum += normal;
    }
    let sigma = columns.objective.value(largest, sum);
    (1.0 - simplex.multipliers[0].dot(&simplex.target) / sigma).abs()
}

/// The columns of the unknowns, completed by unit vectors in the rows that are zero; `None` unless there are
/// as many unknowns as equations.
fn unknowns<const R: usize>(
    face: &OptimalFace,
    columns: &ImplicitColumns<R>,
    rank: usize,
) -> Option<SMatrix<f64, R, R>> {
    let mut matrix = SMatrix::<f64, R, R>::zeros();
    let mut count = usize::from(face.limited);
    for (contact, status) in face.statuses.iter().enumerate() {
        let edges = face.edges(contact);
        let wrench = |edge: u32| columns.wrench(contact, edge);
        let (reference, rest) = match (status, edges) {
            (ContactStatus::Idle, _) | (_, []) => continue,
            (ContactStatus::Saturated, [first, rest @ ..]) => (Some(wrench(*first)), rest),
            (ContactStatus::Free, all) => (None, all),
        };
        if let Some(reference) = reference {
            let sum = matrix.column(0) + reference;
            matrix.set_column(0, &sum);
        }
        for &edge in rest {
            if count >= rank {
                return None;
            }
            matrix.set_column(count, &(wrench(edge) - reference.unwrap_or_else(SVector::zeros)));
            count += 1;
        }
    }
    if count != rank {
        return None;
    }
    for k in rank..R {
        matrix[(k, k)] = 1.0;
    }
    Some(matrix)
}

/// Writes the forces into a region, in the coordinates of the caller's wrench: `map` takes `-w_ext` there to the
/// coordinates of the coefficients.
pub(crate) fn write_region<const R: usize>(
    region: &mut CriticalRegion<R>,
    face: &OptimalFace,
    coefficients: &[SVector<f64, R>],
    level: &SVector<f64, R>,
    map: &SMatrix<f64, R, R>,
    extremes: Extremes<'_>,
) {
    region.clear();
    let mut next = 0;
    let level = map.tr_mul(level);
    for (contact, status) in face.statuses.iter().enumerate() {
        let mut force = [SVector::<f64, R>::zeros(); 4];
        let mut normal = SVector::<f64, R>::zeros();
        let edges = face.edges(contact);
        let strength = extremes.strengths.get(contact);
        let first = next;
        for &edge in edges {
            let coefficient = map.tr_mul(&coefficients[next]);
            next += 1;
            // A contact with one active force presses as hard as that force is used: one condition for both.
            let implied = face.inside[contact] || (edges.len() == 1 && *status == ContactStatus::Saturated);
            if !implied {
                region.conditions.push(&coefficient);
            }
            if let (Some(strength), false) = (strength, face.inside[contact]) {
                region.pushes.push(&(coefficient * *strength));
            }
            normal += coefficient;
            for (row, component) in force.iter_mut().zip(extremes.forces[edge as usize].iter()) {
                *row += coefficient * *component;
            }
        }
        if let Some(interior) = extremes.interiors[contact].as_ref().filter(|_| face.inside[contact]) {
            let mut own = [SVector::<f64, R>::zeros(); 4];
            for (row, coefficient) in own.iter_mut().zip(&coefficients[first..next]) {
                *row = map.tr_mul(coefficient);
            }
            for facet in &interior.facets {
                let row = own[0] * facet[0] + own[1] * facet[1] + own[2] * facet[2] + own[3] * facet[3];
                region.conditions.push(&row);
                if let Some(strength) = strength {
                    region.pushes.push(&(row * *strength));
                }
            }
        }
        if face.limited && *status == ContactStatus::Free {
            region.conditions.push(&(level - normal));
        }
        for &component in extremes.components {
            region.forces.push(&force[component]);
        }
        region.shares.push(&normal);
    }
}
