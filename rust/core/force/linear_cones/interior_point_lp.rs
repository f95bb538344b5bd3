//! `z_b` of Eq. 26 by Clarabel's interior-point method: the online start of the enumerated method.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::interrupt;

/// Constraints `p_j . z <= c_j` in the first `rank` components of z.
pub(crate) struct HalfSpaces<I> {
    pub(crate) normals: I,
    pub(crate) rank: usize,
}

/// `z_b` of Eq. 26: maximises `target . z` over the half-spaces. `None` unless Clarabel reports a solution.
pub(crate) fn furthest_dual<'a>(
    target: &[f64],
    half_spaces: HalfSpaces<impl Iterator<Item = (&'a [f64], f64)> + Clone>,
) -> Option<Vec<f64>> {
    let HalfSpaces { normals, rank } = half_spaces;
    let bounds: Vec<f64> = normals.clone().map(|(_, bound)| bound).collect();
    let rows = bounds.len();
    let values = (0..rank).flat_map(|k| normals.clone().map(move |(p, _)| p[k])).collect();
    let starts = (0..=rank).map(|k| k * rows).collect();
    let indices = (0..rank).flat_map(|_| 0..rows).collect();
    let matrix = CscMatrix::new(rows, rank, starts, indices, values);
    let cost: Vec<f64> = target.iter().take(rank).map(|b| -b).collect();
    let cones = [SupportedConeT::NonnegativeConeT(rows)];
    let settings = DefaultSettings { verbose: false, max_iter: 100, ..DefaultSettings::default() };
    let quadratic = CscMatrix::zeros((rank, rank));
    let mut solver = DefaultSolver::new(&quadratic, &cost, &matrix, &bounds, &cones, settings).ok()?;
    solver.set_termination_callback(|_: &_| interrupt::stopped());
    solver.solve();
    matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved)
        .then(|| std::mem::take(&mut solver.solution.x))
}
