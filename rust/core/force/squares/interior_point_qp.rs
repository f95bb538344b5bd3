//! The least squares by Clarabel's interior-point method: a start for Newton's method where its own ended without an
//! answer.

use clarabel::solver::SupportedConeT;
use nalgebra::SMatrix;

use crate::force::interior_point::ConicProgram;
use crate::force::squares::dual::{Dual, ForceSet};
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;

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
    let mut program = ConicProgram::default();
    program.bounds.extend((0..rows_of_balance).map(|k| b[k] / scale));
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
                program.constraints.push(k, start + j, wrench[k]);
            }
            program.cost.push(-weight * column.dot(&contact.reference) / scale);
            for (i, other) in columns.iter().enumerate().take(j + 1) {
                program.quadratic.push(start + i, start + j, weight * other.dot(column));
            }
        }
        let (normals, low, high) = match &contact.set {
            ForceSet::Cone(cone) => (start..start + 1, cone.low, cone.high),
            ForceSet::Finite(polytope) => {
                (start..start + columns.len()).for_each(|j| program.add_row([(j, -1.0)], 0.0));
                (start..start + columns.len(), polytope.low, polytope.high)
            }
            ForceSet::Zero => continue,
        };
        if high.is_finite() {
            program.add_row(normals.clone().map(|j| (j, 1.0)), high / scale);
        }
        if low > 0.0 {
            program.add_row(normals.map(|j| (j, -1.0)), -low / scale);
        }
    }
    if let Some(columns) = residual_columns {
        let start = program.cost.len();
        for j in 0..D {
            (0..D).for_each(|k| program.constraints.push(k, start + j, -columns[(k, j)]));
            program.cost.push(0.0);
            program.quadratic.push(start + j, start + j, 1.0 / heaviest);
        }
    }
    let inequalities = program.bounds.len() - rows_of_balance;
    program.cones =
        vec![SupportedConeT::ZeroConeT(rows_of_balance), SupportedConeT::NonnegativeConeT(inequalities)];
    for (start, axes, components) in second_order {
        for (j, axis) in axes.iter().enumerate().take(components) {
            program.add_row([(start + j, -1.0 / axis)], 0.0);
        }
        program.cones.push(SupportedConeT::SecondOrderConeT(components));
    }
    let z = program.solve(1e-13, 200)?.z;
    Some(Wrench::from_fn(|k, _| if k < rows_of_balance { -z[k] * scale * heaviest } else { 0.0 }))
}
