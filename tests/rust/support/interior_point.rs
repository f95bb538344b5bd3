//! Least forces by Clarabel: a program over all edges at once, with a row for each contact.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use graspforce::{Criterion, Grasp, Wrench};

/// `min s` or `min sum lambda` with normalised normal forces of at least `bounds`, where there are any. `None` where
/// the solver stops short: the certificate of our own answer is the better witness then.
pub fn interior_point(
    grasp: &Grasp<6>,
    criterion: Criterion,
    bounds: &[f64],
    external: &Wrench<6>,
) -> Option<f64> {
    let wrenches = grasp.primitive_wrenches().unwrap();
    let (m, n) = (grasp.num_contacts(), wrenches.len());
    let mut rows: Vec<Vec<f64>> =
        (0..6).map(|k| wrenches.iter().map(|w| w[k]).chain([0.0]).collect()).collect();
    let mut right: Vec<f64> = external.iter().map(|x| -x).collect();
    for i in 0..m {
        let range = grasp.edges(i).unwrap();
        let row = |sign: f64, last: f64| -> Vec<f64> {
            (0..n).map(|j| if range.contains(&j) { sign } else { 0.0 }).chain([last]).collect()
        };
        rows.push(row(1.0, -1.0));
        right.push(0.0);
        if let Some(bound) = bounds.get(i) {
            rows.push(row(-1.0, 0.0));
            right.push(-bound);
        }
    }
    rows.extend((0..=n).map(|j| (0..=n).map(|k| if j == k { -1.0 } else { 0.0 }).collect()));
    right.resize(rows.len(), 0.0);
    let mut cost = vec![0.0; n + 1];
    match criterion {
        Criterion::Max => cost[n] = 1.0,
        Criterion::Sum => cost[..n].fill(1.0),
    }
    let cones = [SupportedConeT::ZeroConeT(6), SupportedConeT::NonnegativeConeT(rows.len() - 6)];
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-10,
        tol_gap_rel: 1e-10,
        tol_feas: 1e-10,
        ..DefaultSettings::default()
    };
    let (p, a) = (CscMatrix::zeros((n + 1, n + 1)), CscMatrix::from(&rows));
    let mut solver = DefaultSolver::new(&p, &cost, &a, &right, &cones, settings).unwrap();
    solver.solve();
    (solver.solution.status == SolverStatus::Solved).then_some(solver.solution.obj_val)
}
