//! The least squares by Clarabel's interior-point method: a start for Newton's method where its own ended without an
//! answer.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SupportedConeT};
use nalgebra::SMatrix;

use crate::force::squares::dual::{Dual, ForceSet};
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;
use crate::interrupt;

/// The multiplier of the balance in the coordinates of the dual. Whatever the solver ends with is the caller's to certify.
///
/// Variables are forces of cones, coefficients of extreme forces, and with a price `S = C^T C` of the residual `s` its image
/// `C s`. `residual_columns` is `T C^-1`.
pub(crate) fn multiplier<const D: usize>(
    dual: &Dual<D>,
    b: &Wrench<D>,
    scale: f64,
    residual_columns: Option<&SMatrix<f64, D, D>>,
) -> Option<Wrench<D>> {
    let rows_of_balance = if residual_columns.is_some() { D } else { dual.whitening.rank };
    let heaviest = dual.contacts.iter().map(|contact| contact.weight).fold(0.0, f64::max);
    let mut program = Program { next: rows_of_balance, ..Program::default() };
    program.bounds.resize(rows_of_balance, 0.0);
    for k in 0..rows_of_balance {
        program.bounds[k] = b[k] / scale;
    }
    let mut second_order = Vec::new();
    for contact in &dual.contacts {
        let weight = contact.weight / heaviest;
        let start = program.cost.len();
        let columns: Vec<ContactForce> = match &contact.set {
            ForceSet::Zero => continue,
            ForceSet::Cone(cone) => {
                let components = if cone.gamma > 0.0 { 4 } else { 3 };
                second_order.push((start, [1.0, cone.mu, cone.mu, cone.gamma], components));
                (0..components)
                    .map(|k| ContactForce::from_fn(|row, _| f64::from(u8::from(row == k))))
                    .collect()
            }
            ForceSet::Finite(polytope) => polytope.forces.clone(),
        };
        for (j, column) in columns.iter().enumerate() {
            let wrench = contact.wrench(column);
            for k in 0..rows_of_balance {
                program.push(k, start + j, wrench[k]);
            }
            program.cost.push(-weight * column.dot(&contact.reference) / scale);
            for (i, other) in columns.iter().enumerate().take(j + 1) {
                program.quadratic.push((start + i, start + j, weight * other.dot(column)));
            }
        }
        let (normals, low, high) = match &contact.set {
            ForceSet::Cone(cone) => (start..start + 1, cone.low, cone.high),
            ForceSet::Finite(polytope) => {
                (start..start + columns.len()).for_each(|j| program.inequality(j..j + 1, -1.0, 0.0));
                (start..start + columns.len(), polytope.low, polytope.high)
            }
            ForceSet::Zero => continue,
        };
        if high.is_finite() {
            program.inequality(normals.clone(), 1.0, high / scale);
        }
        if low > 0.0 {
            program.inequality(normals, -1.0, -low / scale);
        }
    }
    if let Some(columns) = residual_columns {
        let start = program.cost.len();
        for j in 0..D {
            (0..D).for_each(|k| program.push(k, start + j, -columns[(k, j)]));
            program.cost.push(0.0);
            program.quadratic.push((start + j, start + j, 1.0 / heaviest));
        }
    }
    let inequalities = program.next - rows_of_balance;
    let mut cones =
        vec![SupportedConeT::ZeroConeT(rows_of_balance), SupportedConeT::NonnegativeConeT(inequalities)];
    for (start, axes, components) in second_order {
        for (j, axis) in axes.iter().enumerate().take(components) {
            program.push(program.next, start + j, -1.0 / axis);
            program.bounds.push(0.0);
            program.next += 1;
        }
        cones.push(SupportedConeT::SecondOrderConeT(components));
    }
    let count = program.cost.len();
    let (rows, columns, values) = unzip(program.entries);
    let matrix = CscMatrix::new_from_triplets(program.next, count, rows, columns, values);
    let (rows, columns, values) = unzip(program.quadratic);
    let quadratic = CscMatrix::new_from_triplets(count, count, rows, columns, values);
    let settings = DefaultSettings {
        verbose: false,
        max_iter: 200,
        tol_gap_abs: 1e-13,
        tol_gap_rel: 1e-13,
        tol_feas: 1e-13,
        ..DefaultSettings::default()
    };
    let mut solver =
        DefaultSolver::new(&quadratic, &program.cost, &matrix, &program.bounds, &cones, settings).ok()?;
    solver.set_termination_callback(|_: &_| interrupt::stopped());
    solver.solve();
    let z = &solver.solution.z;
    if !z.iter().all(|value| value.is_finite()) {
        return None;
    }
    Some(Wrench::from_fn(|k, _| if k < rows_of_balance { -z[k] * scale * heaviest } else { 0.0 }))
}

/// Costs, nonzero entries of the constraints and their bounds; `next` is the first row that is not in use.
#[derive(Default)]
struct Program {
    quadratic: Vec<(usize, usize, f64)>,
    cost: Vec<f64>,
    entries: Vec<(usize, usize, f64)>,
    bounds: Vec<f64>,
    next: usize,
}

impl Program {
    fn push(&mut self, row: usize, column: usize, value: f64) {
        self.entries.push((row, column, value));
    }

    /// `sign` times the sum of these variables is at most `bound`.
    fn inequality(&mut self, variables: std::ops::Range<usize>, sign: f64, bound: f64) {
        variables.for_each(|j| self.push(self.next, j, sign));
        self.bounds.push(bound);
        self.next += 1;
    }
}

fn unzip(triplets: Vec<(usize, usize, f64)>) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
    let mut parts = (Vec::new(), Vec::new(), Vec::new());
    for (row, column, value) in triplets {
        parts.0.push(row);
        parts.1.push(column);
        parts.2.push(value);
    }
    parts
}
