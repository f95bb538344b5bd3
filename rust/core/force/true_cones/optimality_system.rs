//! One Newton step of the optimality conditions, by the null space of the conditions on the multiplier.
//!
//! With statuses given, the conditions are, in `z`, the level `s` and the free components `x`:
//!
//! ```text
//! H(z) dz + N dx = balance that is missing       N^T dz = conditions on z that are missing
//! ```
//!
//! Each column of `N` is the wrench of a free component. The last one is the wrench of all contacts at the level. `H`
//! is the curvature of the cones on which contacts slide, a sum of squares `t t^T`. A pivoted orthogonal factor of `N`
//! splits off what the conditions determine of `z`; the curvature determines the rest. Columns that depend on others
//! are forces that the conditions leave free: the step leaves them alone.
//!
//! Where the forces must exert `z` itself, the balance moves with it: the curvature is `H - 1`.

use nalgebra::SVector;

use crate::tolerances::{DEPENDENT, FREE_DIRECTION};

/// A component of the forces that is free, and its condition on the multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unknown {
    /// The level of the contacts at the maximum.
    Level,
    /// The share of a contact that slides.
    Share { contact: usize },
    /// A coordinate of a contact that sticks.
    Coordinate { contact: usize, k: usize },
}

/// The linear system at a point, and its factors.
#[derive(Debug, Clone)]
pub(crate) struct OptimalitySystem<const D: usize> {
    /// Which unknown each column belongs to.
    pub(crate) unknowns: Vec<Unknown>,
    /// What each condition on the multiplier misses.
    pub(crate) missing: Vec<f64>,
    /// Columns of `N`, rotated by the factorisation: the first `rank` rows are `R`.
    pub(crate) columns: Vec<SVector<f64, D>>,
    /// Columns in the order of pivots; beyond `rank` they depend on the others.
    pub(crate) order: Vec<usize>,
    pub(crate) rank: usize,
    /// Square roots of the terms of the curvature, rotated, too.
    curvature: Vec<SVector<f64, D>>,
    reflections: [SVector<f64, D>; 6],
    /// Pivoted Cholesky factor of the curvature in the null space.
    factor: [[f64; 6]; 6],
    pivots: [usize; 6],
    determined: usize,
    /// Whether the forces must exert the multiplier itself.
    exert_multiplier: bool,
    lengths: Vec<f64>,
    step: Vec<f64>,
}

impl<const D: usize> OptimalitySystem<D> {
    pub(crate) fn new(contacts: usize) -> Self {
        let most = 4 * contacts + 1;
        Self {
            unknowns: Vec::with_capacity(most),
            missing: Vec::with_capacity(most),
            columns: Vec::with_capacity(most),
            order: Vec::with_capacity(most),
            rank: 0,
            curvature: Vec::with_capacity(2 * contacts),
            reflections: [SVector::zeros(); 6],
            factor: [[0.0; 6]; 6],
            pivots: [0; 6],
            determined: 0,
            exert_multiplier: false,
            lengths: Vec::with_capacity(most),
            step: Vec::with_capacity(most),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.unknowns.clear();
        self.columns.clear();
        self.curvature.clear();
    }

    /// Adds a free component with its wrench.
    pub(crate) fn push(&mut self, unknown: Unknown, wrench: SVector<f64, D>) {
        self.unknowns.push(unknown);
        self.columns.push(wrench);
    }

    /// Adds `t t^T` to the curvature.
    pub(crate) fn bend(&mut self, t: SVector<f64, D>) {
        self.curvature.push(t);
    }

    /// How many independent directions of force the conditions leave free.
    pub(crate) fn free_directions(&self) -> usize {
        self.columns.len() - self.rank
    }

    /// Whether the curvature determines what the conditions leave of the multiplier: it is positive definite there.
    pub(crate) fn is_determined(&self) -> bool {
        self.rank + self.determined == D
    }

    /// Factorises the system that was pushed.
    pub(crate) fn factorise(&mut self, exert_multiplier: bool) {
        self.exert_multiplier = exert_multiplier;
        let Self { columns, order, curvature, reflections, lengths, .. } = self;
        let count = columns.len();
        order.clear();
        order.extend(0..count);
        lengths.clear();
        lengths.extend(columns.iter().map(SVector::norm_squared));
        self.rank = 0;
        while self.rank < D.min(count) {
            let row = self.rank;
            let mut best = (DEPENDENT * DEPENDENT, row);
            for (place, &j) in order.iter().enumerate().skip(row) {
                let rest = (row..D).map(|k| columns[j][k] * columns[j][k]).sum::<f64>();
                let share = rest / lengths[j].max(f64::MIN_POSITIVE);
                if share > best.0 * (1.0 + 1e-9) {
                    best = (share, place);
                }
            }
            if best.0 <= DEPENDENT * DEPENDENT {
                break;
            }
            order.swap(row, best.1);
            let mut mirror = columns[order[row]];
            (0..row).for_each(|k| mirror[k] = 0.0);
            mirror[row] += mirror.norm().copysign(mirror[row]);
            mirror *= (2.0 / mirror.norm_squared()).sqrt();
            for column in &order[row..] {
                reflect(&mirror, &mut columns[*column]);
            }
            for t in curvature.iter_mut() {
                reflect(&mirror, t);
            }
            reflections[row] = mirror;
            self.rank += 1;
        }
        self.factorise_curvature();
    }

    fn factorise_curvature(&mut self) {
        let (rank, size) = (self.rank, D - self.rank);
        let mut matrix = [[0.0; 6]; 6];
        for t in &self.curvature {
            for i in 0..size {
                for j in 0..=i {
                    matrix[i][j] += t[rank + i] * t[rank + j];
                }
            }
        }
        let own: [f64; 6] = std::array::from_fn(|i| matrix[i][i]);
        if self.exert_multiplier {
            (0..size).for_each(|i| matrix[i][i] -= 1.0);
        }
        for (i, pivot) in self.pivots.iter_mut().enumerate() {
            *pivot = i;
        }
        self.determined = 0;
        for step in 0..size {
            let share = |k: usize| {
                let i = self.pivots[k];
                if own[i] > 0.0 { matrix[i][i] / own[i] } else { 0.0 }
            };
            let Some(best) = (step..size).max_by(|&a, &b| share(a).total_cmp(&share(b))) else { break };
            if share(best) <= FREE_DIRECTION {
                break;
            }
            self.pivots.swap(step, best);
            let p = self.pivots[step];
            let root = matrix[p][p].sqrt();
            self.factor[step][step] = root;
            for k in step + 1..size {
                let i = self.pivots[k];
                let entry = if i > p { matrix[i][p] } else { matrix[p][i] };
                // Row `i` of the factor keeps its place when later pivots swap: it is stored by the row itself.
                matrix[i.max(p)][i.min(p)] = entry / root;
            }
            for k in step + 1..size {
                let i = self.pivots[k];
                let lower = matrix[i.max(p)][i.min(p)];
                for l in step + 1..=k {
                    let j = self.pivots[l];
                    matrix[i.max(j)][i.min(j)] -= lower * matrix[j.max(p)][j.min(p)];
                }
            }
            self.determined += 1;
        }
        for k in 0..self.determined {
            let i = self.pivots[k];
            for l in 0..k {
                let j = self.pivots[l];
                self.factor[k][l] = matrix[i.max(j)][i.min(j)];
            }
        }
    }

    /// The step of the multiplier for the missing balance; [`Self::step`] then gives the steps of the unknowns.
    pub(crate) fn solve(&mut self, missing_balance: &SVector<f64, D>) -> SVector<f64, D> {
        let rank = self.rank;
        let mut balance = *missing_balance;
        for mirror in &self.reflections[..rank] {
            reflect(mirror, &mut balance);
        }
        let mut dz = SVector::<f64, D>::zeros();
        for i in 0..rank {
            let column = &self.columns[self.order[i]];
            let known: f64 = (0..i).map(|k| column[k] * dz[k]).sum();
            dz[i] = (self.missing[self.order[i]] - known) / column[i];
        }
        let moved = if self.exert_multiplier { 1.0 } else { 0.0 };
        let mut bent = dz * -moved;
        for t in &self.curvature {
            bent += t * t.dot(&dz);
        }
        let mut inner = [0.0; 6];
        for k in 0..self.determined {
            let known: f64 = (0..k).map(|l| self.factor[k][l] * inner[l]).sum();
            let row = rank + self.pivots[k];
            inner[k] = (balance[row] - bent[row] - known) / self.factor[k][k];
        }
        for k in (0..self.determined).rev() {
            let known: f64 = (k + 1..self.determined).map(|l| self.factor[l][k] * inner[l]).sum();
            inner[k] = (inner[k] - known) / self.factor[k][k];
            dz[rank + self.pivots[k]] = inner[k];
        }
        balance += dz * moved;
        for t in &self.curvature {
            balance -= t * t.dot(&dz);
        }
        self.step.clear();
        self.step.resize(self.columns.len(), 0.0);
        for i in (0..rank).rev() {
            let known: f64 =
                (i + 1..rank).map(|k| self.columns[self.order[k]][i] * self.step[self.order[k]]).sum();
            self.step[self.order[i]] = (balance[i] - known) / self.columns[self.order[i]][i];
        }
        for mirror in self.reflections[..rank].iter().rev() {
            reflect(mirror, &mut dz);
        }
        dz
    }

    /// The steps of the unknowns in the last solve.
    pub(crate) fn step(&self) -> &[f64] {
        &self.step
    }

    /// The combination of columns that vanishes, with one of column `order[rank + which]`.
    pub(crate) fn null_vector(&self, which: usize, along: &mut Vec<f64>) {
        along.clear();
        along.resize(self.columns.len(), 0.0);
        let dependent = self.order[self.rank + which];
        along[dependent] = 1.0;
        for i in (0..self.rank).rev() {
            let known: f64 =
                (i + 1..self.rank).map(|k| self.columns[self.order[k]][i] * along[self.order[k]]).sum();
            let pivot = self.order[i];
            along[pivot] = -(self.columns[dependent][i] + known) / self.columns[pivot][i];
        }
    }
}

/// `x - m (m . x)` for a mirror of length `sqrt 2`.
#[inline]
fn reflect<const D: usize>(mirror: &SVector<f64, D>, x: &mut SVector<f64, D>) {
    let share = mirror.dot(x);
    x.axpy(-share, mirror, 1.0);
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::test_numbers::numbers;

    #[test]
    fn a_step_solves_the_conditions_and_leaves_dependent_forces_alone() {
        let mut next = numbers(1);
        for case in 0..500 {
            let (columns, dependent) = (1 + case % 6, case % 3);
            let mut system = OptimalitySystem::<6>::new(4);
            let mut wrenches: Vec<SVector<f64, 6>> =
                (0..columns).map(|_| SVector::from_fn(|_, _| next())).collect();
            let z = SVector::<f64, 6>::from_fn(|_, _| next());
            for _ in 0..dependent {
                let mixed = wrenches[..columns].iter().map(|w| w * next()).sum();
                wrenches.push(mixed);
            }
            system.missing = wrenches.iter().map(|w| w.dot(&z)).collect();
            for (contact, wrench) in wrenches.iter().enumerate() {
                system.push(Unknown::Share { contact }, *wrench);
            }
            let mut matrix = DMatrix::<f64>::zeros(6, 6);
            for _ in 0..6 - columns {
                let t = SVector::<f64, 6>::from_fn(|_, _| next());
                matrix += t * t.transpose();
                system.bend(t);
            }
            let balance = SVector::<f64, 6>::from_fn(|_, _| next());
            system.factorise(false);
            assert_eq!(system.free_directions(), dependent, "{case}");
            let dz = system.solve(&balance);
            let size = dz.amax().max(system.step().iter().fold(1.0, |most: f64, x| most.max(x.abs())));
            for (wrench, missing) in wrenches.iter().zip(&system.missing) {
                assert!((wrench.dot(&dz) - missing).abs() <= 1e-9 * size, "{case}");
            }
            let moved: DVector<f64> = matrix * DVector::from_column_slice(dz.as_slice());
            let forces: SVector<f64, 6> = wrenches.iter().zip(system.step()).map(|(w, x)| w * *x).sum();
            let rest = balance - forces - SVector::<f64, 6>::from_column_slice(moved.as_slice());
            assert!(rest.amax() <= 1e-8 * size, "{case} {:e} of {size:e}", rest.amax());
            let mut along = Vec::new();
            for which in 0..dependent {
                system.null_vector(which, &mut along);
                let nothing: SVector<f64, 6> = wrenches.iter().zip(&along).map(|(w, x)| w * *x).sum();
                let longest = along.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                assert!(nothing.amax() <= 1e-11 * longest, "{case}");
            }
        }
    }
}
