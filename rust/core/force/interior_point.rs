//! Clarabel's interior-point method: `min x^T P x / 2 + q^T x` subject to `A x + s = b`, with slacks `s` in cones.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::interrupt;

/// A program as it is written down, variable by variable and row by row.
#[derive(Default)]
pub(crate) struct ConicProgram {
    /// The upper triangle of `P`.
    pub(crate) quadratic: Triplets,
    /// `q`.
    pub(crate) cost: Vec<f64>,
    /// `A`.
    pub(crate) constraints: Triplets,
    /// `b`.
    pub(crate) bounds: Vec<f64>,
    /// The cones of the slacks, in the order of the rows.
    pub(crate) cones: Vec<SupportedConeT<f64>>,
}

/// Row, column and value of the entries of a sparse matrix.
#[derive(Default)]
pub(crate) struct Triplets(Vec<usize>, Vec<usize>, Vec<f64>);

/// What the solver ended with, which is finite.
pub(crate) struct ConicSolution {
    pub(crate) x: Vec<f64>,
    /// The multipliers of the rows.
    pub(crate) z: Vec<f64>,
    /// Whether the solver calls it optimal.
    pub(crate) solved: bool,
}

impl ConicProgram {
    /// Adds a row with these columns and values of `A`.
    pub(crate) fn add_row(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, bound: f64) {
        let row = self.bounds.len();
        entries.into_iter().for_each(|(column, value)| self.constraints.push(row, column, value));
        self.bounds.push(bound);
    }

    /// Solves until gap and residuals are below `tolerance`.
    pub(crate) fn solve(self, tolerance: f64, max_iter: u32) -> Option<ConicSolution> {
        let Self { quadratic, cost, constraints, bounds, cones } = self;
        let settings = DefaultSettings {
            verbose: false,
            max_iter,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            ..DefaultSettings::default()
        };
        let (rows, columns) = (bounds.len(), cost.len());
        let (p, a) = (quadratic.matrix(columns, columns), constraints.matrix(rows, columns));
        let mut solver = DefaultSolver::new(&p, &cost, &a, &bounds, &cones, settings).ok()?;
        solver.set_termination_callback(|_: &_| interrupt::stopped());
        solver.solve();
        let solution = solver.solution;
        let solved = matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        let finite = solution.x.iter().chain(&solution.z).all(|value| value.is_finite());
        finite.then_some(ConicSolution { x: solution.x, z: solution.z, solved })
    }
}

impl Triplets {
    pub(crate) fn push(&mut self, row: usize, column: usize, value: f64) {
        self.0.push(row);
        self.1.push(column);
        self.2.push(value);
    }

    fn matrix(self, rows: usize, columns: usize) -> CscMatrix {
        CscMatrix::new_from_triplets(rows, columns, self.0, self.1, self.2)
    }
}
