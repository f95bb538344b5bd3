//! The least squares of contact forces by Clarabel, in the forces themselves.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use graspforce::{ContactForce, Grasp, SquaresOptions, Wrench};

/// `min sum_i weight_i |f_i - reference_i|^2 / 2` with balance; with `price`, plus `price |residual|^2 / 2` instead.
/// Returns the forces and the objective; an error
/// where the solver finds the wrench infeasible (true), or stops short.
#[allow(clippy::too_many_lines, reason = "one program, row by row")]
pub fn least_squares<const D: usize>(
    grasp: &Grasp<D>,
    options: &SquaresOptions<D>,
    price: Option<f64>,
    external: &Wrench<D>,
) -> Result<(Vec<ContactForce>, f64), bool> {
    let m = grasp.num_contacts();
    let all = |values: &[f64], default: f64| match values {
        [] => vec![default; m],
        [one] => vec![*one; m],
        _ => values.to_vec(),
    };
    let weights = all(&options.weights, 1.0);
    let least = all(&options.min_normal, 0.0);
    let reference = |i: usize| options.reference.get(i).copied().unwrap_or_default();
    // Variables: coefficients of extreme forces, or the four components of a force; then the residual.
    let mut columns: Vec<Vec<ContactForce>> = Vec::new();
    for i in 0..m {
        columns.push(match grasp.edges(i) {
            Some(range) => {
                debug_assert!(!range.is_empty());
                edges_of(grasp, i)
            }
            None => (0..components(grasp, i))
                .map(|k| ContactForce::from_fn(|r, _| f64::from(u8::from(r == k))))
                .collect(),
        });
    }
    let starts: Vec<usize> =
        columns.iter().scan(0, |next, c| Some(std::mem::replace(next, *next + c.len()))).collect();
    let forces = columns.iter().map(Vec::len).sum::<usize>();
    let n = forces + if price.is_some() { D } else { 0 };
    let mut p = vec![vec![0.0; n]; n];
    let mut q = vec![0.0; n];
    let mut rows: Vec<Vec<f64>> = (0..D).map(|_| vec![0.0; n]).collect();
    let mut right: Vec<f64> = external.iter().map(|x| -x).collect();
    for i in 0..m {
        for (j, column) in columns[i].iter().enumerate() {
            let wrench = grasp.maps()[i] * column;
            (0..D).for_each(|k| rows[k][starts[i] + j] = wrench[k]);
            q[starts[i] + j] = -weights[i] * column.dot(&reference(i));
            for (l, other) in columns[i].iter().enumerate() {
                p[starts[i] + l][starts[i] + j] = weights[i] * other.dot(column);
            }
        }
    }
    if let Some(price) = price {
        for k in 0..D {
            rows[k][forces + k] = -1.0;
            p[forces + k][forces + k] = price;
        }
    }
    let mut inequalities = 0;
    let mut inequality = |rows: &mut Vec<Vec<f64>>, at: std::ops::Range<usize>, sign: f64, bound: f64| {
        rows.push((0..n).map(|j| if at.contains(&j) { sign } else { 0.0 }).collect());
        right.push(bound);
        inequalities += 1;
    };
    let mut cones = Vec::new();
    for i in 0..m {
        let contact = &grasp.contacts()[i];
        let (at, unit) = if grasp.edges(i).is_some() {
            let all = starts[i]..starts[i] + columns[i].len();
            all.clone().for_each(|j| inequality(&mut rows, j..j + 1, -1.0, 0.0));
            (all, 1.0)
        } else {
            (starts[i]..starts[i] + 1, contact.max_normal_force)
        };
        if options.limits {
            inequality(&mut rows, at.clone(), 1.0, unit);
        }
        if least[i] > 0.0 {
            inequality(&mut rows, at, -1.0, -unit * least[i]);
        }
    }
    for i in (0..m).filter(|&i| grasp.edges(i).is_none()) {
        let contact = &grasp.contacts()[i];
        let axes = [1.0, contact.friction, contact.friction, contact.torsion];
        for (k, axis) in axes.into_iter().enumerate().take(components(grasp, i)) {
            let mut row = vec![0.0; n];
            row[starts[i] + k] = -1.0 / axis;
            rows.push(row);
            right.push(0.0);
        }
        cones.push(SupportedConeT::SecondOrderConeT(components(grasp, i)));
    }
    let mut all = vec![SupportedConeT::ZeroConeT(D), SupportedConeT::NonnegativeConeT(inequalities)];
    all.extend(cones);
    for (k, row) in p.iter_mut().enumerate() {
        row[..k].fill(0.0);
    }
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-11,
        tol_gap_rel: 1e-11,
        tol_feas: 1e-11,
        ..DefaultSettings::default()
    };
    let (p, a) = (CscMatrix::from(&p), CscMatrix::from(&rows));
    let mut solver = DefaultSolver::new(&p, &q, &a, &right, &all, settings).unwrap();
    solver.solve();
    match solver.solution.status {
        SolverStatus::Solved => {}
        SolverStatus::PrimalInfeasible => return Err(true),
        _ => return Err(false),
    }
    let x = &solver.solution.x;
    let forces: Vec<ContactForce> =
        (0..m).map(|i| columns[i].iter().enumerate().map(|(j, c)| c * x[starts[i] + j]).sum()).collect();
    let constant: f64 = (0..m).map(|i| 0.5 * weights[i] * reference(i).norm_squared()).sum();
    Ok((forces, solver.solution.obj_val + constant))
}

/// Components of the force of a true cone.
fn components<const D: usize>(grasp: &Grasp<D>, i: usize) -> usize {
    if grasp.contacts()[i].torsion > 0.0 { 4 } else { 3 }
}

fn edges_of<const D: usize>(grasp: &Grasp<D>, i: usize) -> Vec<ContactForce> {
    // Grasps with true cones do not list all extreme forces: each contact alone does.
    let contact = grasp.contacts()[i].clone();
    Grasp::<D>::new(&[contact]).unwrap().extreme_forces().unwrap().to_vec()
}
