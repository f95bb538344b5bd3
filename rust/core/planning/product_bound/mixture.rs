//! Bounds by mixtures of directions: a matrix game between the corners of cells and the directions.
//!
//! For shares `y_k` of unit directions, `epsilon(c) <= min_k p(z_k; c) <= sum_k y_k p(z_k; c)`. Between the corners of a
//! cell a support is at most its interpolation, so that no grasp in a product of cells is better than
//!
//! `sum_g max_v sum_k y_k p_g(z_k; v)` over the corners v of each cell g.
//!
//! One direction alone has to be low at all corners. A mixture has to be low on average, which closes the bound faster
//! by one order of the cells' size. The best shares solve a linear program with one row for each corner. Its multipliers
//! are shares of the corners: the next direction is one along which these, together, reach least.

use nalgebra::DMatrix;

/// Pivots of one program at most; any shares give a bound.
const MAX_PIVOTS: usize = 60;

/// Reduced costs above this, relative to the bound, are none.
const REDUCED: f64 = 1e-10;

/// A variable of the program: the largest sum of a cell, what a corner falls short of it, or the share of a direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Variable {
    Largest(usize),
    Short(usize),
    Share(usize),
}

/// The best mixture of directions.
#[derive(Debug, Clone)]
pub(crate) struct Mixture {
    /// The cell of each corner.
    cell_of: Vec<usize>,
    /// Supports at the corners, direction by direction.
    columns: Vec<Vec<f64>>,
    basis: Vec<Variable>,
    inverse: DMatrix<f64>,
    levels: Vec<f64>,
}

impl Mixture {
    /// One direction, with its supports at the corners of cells of these sizes; `None` without corners.
    pub(crate) fn new(sizes: &[usize], first: Vec<f64>) -> Option<Self> {
        let cell_of: Vec<usize> =
            sizes.iter().enumerate().flat_map(|(g, &n)| std::iter::repeat_n(g, n)).collect();
        let rows = cell_of.len();
        let best = |cell: usize| {
            (0..rows).filter(|&row| cell_of[row] == cell).max_by(|&a, &b| first[a].total_cmp(&first[b]))
        };
        let tops: Vec<usize> = (0..sizes.len()).map(best).collect::<Option<_>>()?;
        let short = (0..rows).filter(|row| !tops.contains(row)).map(Variable::Short);
        let mut basis: Vec<Variable> = (0..sizes.len()).map(Variable::Largest).collect();
        basis.extend(short);
        basis.push(Variable::Share(0));
        let mut mixture =
            Self { cell_of, columns: vec![first], basis, inverse: DMatrix::zeros(0, 0), levels: Vec::new() };
        mixture.refactorise().then_some(mixture)
    }

    fn column(&self, variable: Variable) -> Vec<f64> {
        let rows = self.cell_of.len();
        let mut column = vec![0.0; rows + 1];
        match variable {
            Variable::Largest(cell) => {
                (0..rows).filter(|&row| self.cell_of[row] == cell).for_each(|row| column[row] = 1.0);
            }
            Variable::Short(row) => column[row] = -1.0,
            Variable::Share(at) => {
                (0..rows).for_each(|row| column[row] = -self.columns[at][row]);
                column[rows] = 1.0;
            }
        }
        column
    }

    fn refactorise(&mut self) -> bool {
        let size = self.basis.len();
        let columns: Vec<f64> = self.basis.iter().flat_map(|&variable| self.column(variable)).collect();
        let Some(inverse) = DMatrix::from_vec(size, size, columns).try_inverse() else { return false };
        self.levels = (0..size).map(|row| inverse[(row, size - 1)]).collect();
        self.inverse = inverse;
        true
    }

    /// Shares of the corners, none negative, of the sum 1 in each cell.
    pub(crate) fn corner_shares(&self) -> Vec<f64> {
        let mut shares: Vec<f64> =
            self.multipliers().iter().take(self.cell_of.len()).map(|x| x.max(0.0)).collect();
        for cell in 0..=self.cell_of.last().copied().unwrap_or(0) {
            let inside = |row: &usize| self.cell_of[*row] == cell;
            let total: f64 = (0..shares.len()).filter(inside).map(|row| shares[row]).sum();
            let count = (0..shares.len()).filter(inside).count() as f64;
            for row in (0..shares.len()).filter(inside) {
                shares[row] = if total > 0.0 { shares[row] / total } else { 1.0 / count };
            }
        }
        shares
    }

    fn multipliers(&self) -> Vec<f64> {
        let size = self.basis.len();
        let largest = |row: &usize| matches!(self.basis[*row], Variable::Largest(_));
        (0..size).map(|at| (0..size).filter(largest).map(|row| self.inverse[(row, at)]).sum()).collect()
    }

    /// Shares of the directions, none negative, of the sum 1.
    pub(crate) fn shares(&self) -> Vec<f64> {
        let mut shares = vec![0.0; self.columns.len()];
        for (variable, level) in self.basis.iter().zip(&self.levels) {
            if let Variable::Share(at) = variable {
                shares[*at] = level.max(0.0);
            }
        }
        let total: f64 = shares.iter().sum();
        if total > 0.0 {
            for share in &mut shares {
                *share /= total;
            }
        } else if let Some(share) = shares.first_mut() {
            *share = 1.0;
        }
        shares
    }

    /// The bound that the shares prove.
    pub(crate) fn bound(&self) -> f64 {
        let shares = self.shares();
        let cells = self.cell_of.last().map_or(0, |cell| cell + 1);
        let mut largest = vec![f64::NEG_INFINITY; cells];
        for (row, &cell) in self.cell_of.iter().enumerate() {
            let sum: f64 =
                shares.iter().zip(&self.columns).filter(|(s, _)| **s > 0.0).map(|(s, c)| s * c[row]).sum();
            largest[cell] = largest[cell].max(sum);
        }
        largest.iter().sum()
    }

    /// Adds a direction by its supports at the corners, and finds the best shares.
    pub(crate) fn add(&mut self, column: Vec<f64>) {
        self.columns.push(column);
        for _ in 0..MAX_PIVOTS {
            let Some(entering) = self.entering() else { return };
            if !self.pivot(entering) {
                return;
            }
        }
    }

    fn entering(&self) -> Option<Variable> {
        let multipliers = self.multipliers();
        let (value, corners) = multipliers.split_last()?;
        let size = 1.0 + value.abs();
        let shares = self.columns.iter().enumerate().map(|(at, column)| {
            let reach: f64 = corners.iter().zip(column).map(|(share, reach)| share * reach).sum();
            (reach - value, Variable::Share(at))
        });
        let shorts = corners.iter().enumerate().map(|(row, share)| (share * size, Variable::Short(row)));
        let (cost, best) = shares
            .chain(shorts)
            .filter(|(_, variable)| !self.basis.contains(variable))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (cost < -REDUCED * size).then_some(best)
    }

    /// Brings a variable into the basis; false where none can leave.
    fn pivot(&mut self, entering: Variable) -> bool {
        let (size, column) = (self.basis.len(), self.column(entering));
        let step: Vec<f64> =
            (0..size).map(|row| (0..size).map(|at| self.inverse[(row, at)] * column[at]).sum()).collect();
        let most = step.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let bounded =
            |row: &usize| !matches!(self.basis[*row], Variable::Largest(_)) && step[*row] > 1e-11 * most;
        let ratio = |row: usize| self.levels[row].max(0.0) / step[row];
        let Some(leaving) = (0..size).filter(bounded).min_by(|&a, &b| ratio(a).total_cmp(&ratio(b))) else {
            return false;
        };
        let level = ratio(leaving);
        self.basis[leaving] = entering;
        for at in 0..size {
            self.inverse[(leaving, at)] /= step[leaving];
        }
        for row in (0..size).filter(|row| *row != leaving) {
            self.levels[row] -= level * step[row];
            for at in 0..size {
                self.inverse[(row, at)] -= step[row] * self.inverse[(leaving, at)];
            }
        }
        self.levels[leaving] = level;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mixing_two_directions_halves_what_each_leaves_open() {
        // Each direction is low at one end of the cell only.
        let mut mixture = Mixture::new(&[2], vec![0.0, 1.0]).unwrap();
        assert!((mixture.bound() - 1.0).abs() < 1e-12);
        mixture.add(vec![1.0, 0.0]);
        assert!((mixture.bound() - 0.5).abs() < 1e-12);
        assert!(mixture.corner_shares().iter().all(|share| (share - 0.5).abs() < 1e-12));
    }
}
