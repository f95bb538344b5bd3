//! One simplex basis: its columns, its inverse, and what replaces what.

use nalgebra::{SMatrix, SVector};

use crate::force::simplex::pricing::{Column, UNUSED};
use crate::linalg::dense::invert;

/// `R` columns that express every right-hand side, and the inverse of their matrix.
#[derive(Debug, Clone)]
pub(crate) struct Basis<const R: usize> {
    pub(crate) columns: SMatrix<f64, R, R>,
    pub(crate) inverse: SMatrix<f64, R, R>,
    pub(crate) costs: [SVector<f64, R>; 2],
    /// Where each column was priced.
    pub(crate) directions: SMatrix<f64, R, R>,
    /// Columns that are no points of the set: signed unit vectors of the first phase.
    pub(crate) artificial: [bool; R],
    edges: Vec<u32>,
    contacts: usize,
}

impl<const R: usize> Basis<R> {
    pub(crate) fn new(contacts: usize) -> Self {
        Self {
            columns: SMatrix::identity(),
            inverse: SMatrix::identity(),
            costs: [SVector::zeros(); 2],
            directions: SMatrix::zeros(),
            artificial: [true; R],
            edges: vec![UNUSED; R * contacts],
            contacts,
        }
    }

    /// Artificial columns that express `target` with nonnegative levels; `sign(0) = +1` keeps the rows
    /// `[level, inverse]` lexicographically positive, which the ratio test relies on.
    pub(crate) fn reset(&mut self, target: &SVector<f64, R>) {
        let signs = target.map(|x| if x < 0.0 { -1.0 } else { 1.0 });
        self.columns = SMatrix::from_diagonal(&signs);
        self.inverse = self.columns;
        self.costs = [SVector::zeros(); 2];
        self.artificial = [true; R];
        self.edges.fill(UNUSED);
    }

    /// Becomes a copy of another basis of the same grasp, without allocating.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.columns = other.columns;
        self.inverse = other.inverse;
        self.costs = other.costs;
        self.directions = other.directions;
        self.artificial = other.artificial;
        self.edges.copy_from_slice(&other.edges);
    }

    /// Which edge of each contact the column in `row` uses.
    pub(crate) fn edges(&self, row: usize) -> &[u32] {
        &self.edges[row * self.contacts..(row + 1) * self.contacts]
    }

    /// Replaces the column in `row`; `direction` is the new column in terms of the old basis.
    pub(crate) fn replace(
        &mut self,
        row: usize,
        column: &Column<R>,
        edges: &[u32],
        direction: &SVector<f64, R>,
    ) {
        let leaving = self.inverse.row(row) / direction[row];
        let mut others = *direction;
        others[row] = 0.0;
        self.inverse -= others * leaving;
        self.inverse.set_row(row, &leaving);
        self.columns.set_column(row, &column.wrench);
        self.directions.set_column(row, &column.direction);
        for (costs, cost) in self.costs.iter_mut().zip(column.costs) {
            costs[row] = cost;
        }
        self.artificial[row] = false;
        self.edges[row * self.contacts..(row + 1) * self.contacts].copy_from_slice(edges);
    }

    /// Inverts the columns afresh; `false`, and nothing changed, if they have become dependent.
    pub(crate) fn refactorise(&mut self) -> bool {
        match invert(&self.columns, 0.0) {
            Some(inverse) => {
                self.inverse = inverse;
                true
            }
            None => false,
        }
    }

    /// Levels with `columns * levels = target`, with one step of refinement.
    pub(crate) fn levels(&self, target: &SVector<f64, R>) -> SVector<f64, R> {
        let levels = self.inverse * target;
        levels + self.inverse * (target - self.columns * levels)
    }

    /// Multipliers with `columns^T z = costs`, with one step of refinement.
    pub(crate) fn multipliers(&self, costs: &SVector<f64, R>) -> SVector<f64, R> {
        let z = self.inverse.tr_mul(costs);
        z + self.inverse.tr_mul(&(costs - self.columns.tr_mul(&z)))
    }

    /// One step of iterative refinement of multipliers that were updated pivot by pivot.
    pub(crate) fn refine(&self, z: &SVector<f64, R>, costs: &SVector<f64, R>) -> SVector<f64, R> {
        z + self.inverse.tr_mul(&(costs - self.columns.tr_mul(z)))
    }

    /// First-phase costs: 1 for artificial columns among the first `rank` rows.
    pub(crate) fn infeasibility(&self, rank: usize) -> SVector<f64, R> {
        SVector::from_fn(|row, _| if self.artificial[row] && row < rank { 1.0 } else { 0.0 })
    }
}
