//! Critical regions: where the optimal forces are one linear function of the wrench.
//!
//! On a face of optimal solutions the forces solve linear equations in `b = -w_ext`, so they are `F b`, and
//! they stay optimal as long as the normalised forces and multipliers that must not be negative, `K b`, are
//! not. Both matrices are built once for each face. A wrench that falls into a known region costs two small
//! matrix-vector products, whatever path led there.

use nalgebra::{SMatrix, SVector};

use crate::force::simplex::pricing::Objective;
use crate::grasp::REPRESENTABLE;
use crate::tolerances::{
    DEPENDENT, ILL_CONDITIONED, LARGE_FORCES, LOOSEST_GAP, RAY_GAP, RAY_WIDTH, ROUNDED_GAP, UNBALANCED_WRENCH,
};

/// How much larger than their sum terms may be for rounding to leave the loosest gap.
const MOST_CANCELLED: f64 = LOOSEST_GAP / ROUNDED_GAP;

/// How many rows are multiplied at a time.
const LANES: usize = 4;

/// Rows of a matrix with `R` columns, in blocks that fill vector registers.
#[derive(Debug, Default)]
pub(crate) struct Rows<const R: usize> {
    blocks: Vec<Block<R>>,
    count: usize,
}

impl<const R: usize> Clone for Rows<R> {
    /// Keeps the capacity, so that a clone does not allocate later either.
    fn clone(&self) -> Self {
        let mut blocks = Vec::with_capacity(self.blocks.capacity());
        blocks.extend_from_slice(&self.blocks);
        Self { blocks, count: self.count }
    }
}

#[derive(Debug, Clone, Copy)]
struct Block<const R: usize>([[f64; LANES]; R]);

impl<const R: usize> Block<R> {
    #[inline]
    fn times(&self, vector: &SVector<f64, R>) -> [f64; LANES] {
        let mut product = [0.0; LANES];
        for (column, x) in self.0.iter().zip(vector.iter()) {
            for lane in 0..LANES {
                product[lane] += column[lane] * x;
            }
        }
        product
    }
}

impl<const R: usize> Rows<R> {
    pub(crate) fn with_capacity(rows: usize) -> Self {
        Self { blocks: Vec::with_capacity(rows.div_ceil(LANES)), count: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        self.count = 0;
    }

    pub(crate) fn push(&mut self, row: &SVector<f64, R>) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.blocks.push(Block([[0.0; LANES]; R]));
        }
        if let Some(block) = self.blocks.last_mut() {
            for (column, x) in block.0.iter_mut().zip(row.iter()) {
                column[lane] = *x;
            }
        }
        self.count += 1;
    }

    fn row(&self, k: usize) -> SVector<f64, R> {
        let block = &self.blocks[k / LANES].0;
        SVector::from_fn(|column, _| block[column][k % LANES])
    }

    /// The product with `vector`, row by row; rows beyond the output's length are dropped.
    #[inline]
    pub(crate) fn multiply(&self, vector: &SVector<f64, R>, output: &mut [f64]) {
        for (block, rows) in self.blocks.iter().zip(output.chunks_mut(LANES)) {
            let product = block.times(vector);
            rows.copy_from_slice(&product[..rows.len()]);
        }
    }

    /// Whether every component of the product passes; NaN passes no comparison.
    #[inline]
    fn all(&self, vector: &SVector<f64, R>, passes: impl Fn(f64) -> bool) -> bool {
        let whole = |block: &Block<R>| block.times(vector).iter().fold(true, |all, x| all & passes(*x));
        self.blocks.iter().all(whole)
    }
}

/// Wrenches whose least forces are one linear map `F b` of `b = -w_ext`.
#[derive(Debug, Clone)]
pub(crate) struct CriticalRegion<const R: usize> {
    /// `K`: normalised forces, slacks and multipliers, none of which may be negative.
    pub(crate) conditions: Rows<R>,
    /// Forces, not divided by any limit, that may not be negative either: rows only where limits are far apart.
    pub(crate) pushes: Rows<R>,
    /// The largest force of each contact at a share of one, where limits are far apart; else empty.
    pub(crate) strengths: Vec<f64>,
    /// What must vanish where the forces do not span all wrenches.
    pub(crate) equations: Rows<R>,
    /// `F`: the components of each contact force that exist, contact by contact.
    pub(crate) forces: Rows<R>,
    /// The normalised normal force of each contact.
    pub(crate) shares: Rows<R>,
    /// What the forces minimise.
    pub(crate) objective: Objective,
    /// `z_b`: the objective is `z_b . b`.
    pub(crate) dual: SVector<f64, R>,
    /// `p(z_b)`, one up to rounding; the objective's lower bound is `z_b . b / p(z_b)`.
    pub(crate) reach: f64,
    /// The relative gap up to which the forces count as an answer.
    pub(crate) tolerance: f64,
    /// The relative gap that rounding of the multipliers explains; a larger one comes from edges that are optimal but for
    /// rounding of the wrenches.
    pub(crate) rounded_gap: f64,
    /// Whether the first two levels left no choice.
    pub(crate) unique: bool,
    /// Whether the reduced set could not give the answer.
    pub(crate) fell_back: bool,
    /// What makes forces and torques comparable when the equations are checked.
    pub(crate) units: SVector<f64, R>,
    /// Whether the forces are those of one basis, because rounding or noise hides other optimal ones.
    pub(crate) basic: bool,
    /// The wrench whose multiples are all of the region, where it is one ray.
    ray: Option<Box<Ray<R>>>,
}

/// A wrench with its forces, as they were certified.
#[derive(Debug, Clone)]
struct Ray<const R: usize> {
    b: SVector<f64, R>,
    forces: Vec<f64>,
    dual: SVector<f64, R>,
    gap: f64,
    /// Whether rounding of the forces of a multiple may leave too much over.
    large: bool,
}

impl<const R: usize> CriticalRegion<R> {
    pub(crate) fn with_capacity(
        objective: Objective,
        contacts: usize,
        edges: usize,
        force_dim: usize,
        strengths: &[f64],
    ) -> Self {
        let pushes = if strengths.is_empty() { 0 } else { R + contacts + edges };
        Self {
            conditions: Rows::with_capacity(2 * R + contacts + edges),
            pushes: Rows::with_capacity(pushes),
            strengths: strengths.to_vec(),
            equations: Rows::with_capacity(R),
            forces: Rows::with_capacity(force_dim * contacts),
            shares: Rows::with_capacity(contacts),
            objective,
            dual: SVector::zeros(),
            reach: 1.0,
            tolerance: 0.0,
            rounded_gap: 0.0,
            unique: true,
            fell_back: false,
            units: SVector::repeat(1.0),
            basic: false,
            ray: None,
        }
    }

    /// Becomes the ray of wrenches along `b`, on which forces grow in proportion: rows of the components of the forces,
    /// and the normalised normal forces. Any other wrench is outside.
    pub(crate) fn write_ray(
        &mut self,
        b: &SVector<f64, R>,
        forces: Vec<f64>,
        shares: &[f64],
        (dual, gap): (SVector<f64, R>, f64),
        units: &SVector<f64, R>,
    ) {
        self.clear();
        let largest = b.amax();
        let scaled = b / largest;
        let along = scaled / (largest * scaled.norm_squared());
        for force in &forces {
            self.forces.push(&(along * *force));
        }
        for share in shares {
            self.shares.push(&(along * *share));
        }
        for k in 0..R {
            let mut row = along * -b[k];
            row[k] += 1.0;
            self.equations.push(&(row * (units[k] * UNBALANCED_WRENCH / RAY_WIDTH)));
        }
        let (most, sum) = shares.iter().fold((0.0, 0.0), |(most, sum), n| (f64::max(most, *n), sum + n));
        self.dual = along * self.objective.value(most, sum);
        self.units = *units;
        (self.reach, self.tolerance, self.unique) = (1.0, RAY_GAP, false);
        let sum: f64 = forces.iter().map(|force| force.abs()).sum();
        let large = sum * units[0] > LARGE_FORCES * b.component_mul(units).amax();
        self.ray = Some(Box::new(Ray { b: *b, forces, dual, gap, large }));
    }

    /// Whether some wrench of unit size takes forces or an objective of [`ILL_CONDITIONED`] size: rounding of positions then
    /// decides between optimal forces, and so would the wrenches that were solved before.
    pub(crate) fn is_ill_conditioned(&self) -> bool {
        let mut steepest = SVector::<f64, R>::zeros();
        for block in &self.forces.blocks {
            for (most, row) in steepest.iter_mut().zip(&block.0) {
                *most = row.iter().fold(*most, |most, x| if x.abs() > most { x.abs() } else { most });
            }
        }
        let steepest = steepest.component_div(&self.units).max();
        steepest * self.units[0] > ILL_CONDITIONED
            || self.dual.component_div(&self.units).amax() > ILL_CONDITIONED
    }

    /// Whether the region is one ray, whose multipliers prove nothing of other wrenches.
    pub(crate) fn is_ray(&self) -> bool {
        self.ray.is_some()
    }

    /// The multipliers of the wrench, and the relative gap they prove.
    pub(crate) fn proof(&self, b: &SVector<f64, R>) -> (SVector<f64, R>, f64) {
        self.ray.as_ref().map_or_else(|| (self.dual, self.gap(b)), |ray| (ray.dual, ray.gap))
    }

    /// Writes the components of the forces.
    #[inline]
    pub(crate) fn write(&self, b: &SVector<f64, R>, rows: &mut [f64]) {
        match &self.ray {
            // Rounded once more, large forces may leave too much over.
            Some(ray) if ray.b == *b => rows.copy_from_slice(&ray.forces),
            _ => self.forces.multiply(b, rows),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.conditions.clear();
        self.pushes.clear();
        self.equations.clear();
        self.forces.clear();
        self.shares.clear();
        self.ray = None;
        self.basic = false;
    }

    /// Whether the region holds the least forces at `b`: none negative by more than `inside`, relative to the objective
    /// and to the largest force, and the objective within the tolerance of its lower bound.
    #[inline]
    pub(crate) fn answers(&self, b: &SVector<f64, R>, inside: f64) -> bool {
        let objective = self.dual.dot(b);
        let floor = -inside * objective;
        // What would make forces overflow is outside, too.
        REPRESENTABLE.contains(&objective)
            && self.cancelled(b) <= MOST_CANCELLED * objective
            && self.conditions.all(b, |x| x >= floor)
            && self.gap(b) <= self.tolerance
            && (self.pushes.count == 0 || self.pushes(b, inside))
            && (self.equations.count == 0 || self.balances(b))
            && self.ray.as_ref().is_none_or(|ray| !ray.large || ray.b == *b)
    }

    /// What the forces leave over of a wrench of unit size in the region, at most: `maps` turn `components` of the forces
    /// of each contact into wrenches.
    pub(crate) fn left_over(&self, maps: &[SMatrix<f64, R, 4>], components: &[usize]) -> f64 {
        let mut rest = -SMatrix::<f64, R, R>::identity();
        let columns = maps.iter().flat_map(|map| components.iter().map(|&component| map.column(component)));
        for (k, column) in columns.enumerate() {
            rest += column * self.forces.row(k).transpose();
        }
        for (mut column, unit) in rest.column_iter_mut().zip(&self.units) {
            column.component_mul_assign(&(self.units * unit.recip()));
        }
        // Wrenches of the region have nothing along its equations.
        let mut axes: [SVector<f64, R>; R] = [SVector::zeros(); R];
        for k in 0..self.equations.count.min(R) {
            let mut axis = self.equations.row(k).component_div(&self.units);
            let length = axis.norm();
            for earlier in &axes[..k] {
                axis -= earlier * earlier.dot(&axis);
            }
            if axis.norm() > DEPENDENT * length {
                axes[k] = axis.normalize();
                let along = rest * axes[k];
                rest -= along * axes[k].transpose();
            }
        }
        rest.abs().sum()
    }

    /// Whether no share and no force is negative by more than `inside`; multipliers need not be written yet.
    pub(crate) fn nonnegative(&self, b: &SVector<f64, R>, inside: f64) -> bool {
        let (largest, sum) = self.totals(b);
        let floor = -inside * self.objective.value(largest, sum);
        self.conditions.all(b, |x| x >= floor) && self.pushes(b, inside)
    }

    /// Whether no force is negative by more than `inside`, relative to the largest force. A share of a strong contact
    /// that is nothing beside the share of a weak one may be more than all its force.
    fn pushes(&self, b: &SVector<f64, R>, inside: f64) -> bool {
        let mut largest: f64 = 0.0;
        for (block, strengths) in self.shares.blocks.iter().zip(self.strengths.chunks(LANES)) {
            let forces = block.times(b).into_iter().zip(strengths).map(|(share, strength)| share * strength);
            largest = forces.fold(largest, f64::max);
        }
        self.pushes.all(b, |x| x >= -inside * largest)
    }

    /// Largest normalised normal force at `b`, and their sum.
    #[inline]
    pub(crate) fn totals(&self, b: &SVector<f64, R>) -> (f64, f64) {
        let (mut largest, mut sum) = ([0.0_f64; LANES], [0.0; LANES]);
        for block in &self.shares.blocks {
            let product = block.times(b);
            for lane in 0..LANES {
                largest[lane] = if product[lane] > largest[lane] { product[lane] } else { largest[lane] };
                sum[lane] += product[lane];
            }
        }
        (largest.iter().copied().fold(0.0, f64::max), sum.iter().sum())
    }

    /// Relative distance at `b` between the objective of the forces and what the multiplier proves.
    #[inline]
    pub(crate) fn gap(&self, b: &SVector<f64, R>) -> f64 {
        let (largest, sum) = self.totals(b);
        (1.0 - self.dual.dot(b) / (self.reach * self.objective.value(largest, sum))).abs()
    }

    /// The size of the terms that add up to the objective: what they cancel is lost to rounding.
    #[inline]
    pub(crate) fn cancelled(&self, b: &SVector<f64, R>) -> f64 {
        self.dual.component_mul(b).abs().sum()
    }

    /// Whether the part of `b` outside the span of the forces is rounding.
    fn balances(&self, b: &SVector<f64, R>) -> bool {
        let largest = UNBALANCED_WRENCH * b.component_mul(&self.units).norm();
        // A wrench whose length overflows would pass with anything.
        largest.is_finite() && self.equations.all(b, |x| x.abs() <= largest)
    }
}
