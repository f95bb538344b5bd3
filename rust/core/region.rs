//! Critical regions: where the optimal forces are one linear function of the wrench.
//!
//! On a face of optimal solutions the forces solve linear equations in `b = -w_ext`, so they are `F b`, and
//! they stay optimal as long as the normalised forces and multipliers that must not be negative, `K b`, are
//! not. Both matrices are built once for each face. A wrench that falls into a known region costs two small
//! matrix-vector products, whatever path led there.

use nalgebra::SVector;

use crate::grasp::REPRESENTABLE;

/// How much of a wrench may be left unbalanced, relative to the whole: rounding of whoever computed it.
pub(crate) const UNBALANCED: f64 = 1e-10;

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

    /// The product with `vector`, row by row; rows beyond the output's length are dropped.
    #[inline]
    pub(crate) fn multiply(&self, vector: &SVector<f64, R>, output: &mut [f64]) {
        for (block, rows) in self.blocks.iter().zip(output.chunks_mut(LANES)) {
            let product = block.times(vector);
            rows.copy_from_slice(&product[..rows.len()]);
        }
    }

    /// Smallest and largest component of the product; zero takes part in both. Stops at the first block
    /// with a component below `floor`.
    #[inline]
    fn range(&self, vector: &SVector<f64, R>, floor: f64) -> (f64, f64) {
        let (mut low, mut high) = ([0.0_f64; LANES], [0.0_f64; LANES]);
        for block in &self.blocks {
            let product = block.times(vector);
            for lane in 0..LANES {
                low[lane] = if product[lane] < low[lane] { product[lane] } else { low[lane] };
                high[lane] = if product[lane] > high[lane] { product[lane] } else { high[lane] };
            }
            if low.iter().any(|x| *x < floor) {
                break;
            }
        }
        (low.iter().copied().fold(0.0, f64::min), high.iter().copied().fold(0.0, f64::max))
    }
}

/// A region of wrenches with one linear law of forces.
#[derive(Debug, Clone)]
pub(crate) struct Region<const R: usize> {
    /// `K`: normalised forces, slacks and multipliers, none of which may be negative.
    pub(crate) conditions: Rows<R>,
    /// What must vanish where the forces do not span all wrenches.
    pub(crate) equations: Rows<R>,
    /// `F`: the components of each contact force that exist, contact by contact.
    pub(crate) forces: Rows<R>,
    /// The normalised normal force of each contact.
    pub(crate) normals: Rows<R>,
    /// `z_b`: the objective is `z_b . b`.
    pub(crate) dual: SVector<f64, R>,
    /// `p(z_b)`, one up to rounding; the objective's lower bound is `z_b . b / p(z_b)`.
    pub(crate) reach: f64,
    /// Whether the first two levels left no choice.
    pub(crate) unique: bool,
    /// Whether the reduced set could not give the answer.
    pub(crate) fell_back: bool,
    /// What makes forces and torques comparable when the equations are checked.
    pub(crate) units: SVector<f64, R>,
}

impl<const R: usize> Region<R> {
    pub(crate) fn with_capacity(contacts: usize, edges: usize, force_dim: usize) -> Self {
        Self {
            conditions: Rows::with_capacity(2 * R + contacts + edges),
            equations: Rows::with_capacity(R),
            forces: Rows::with_capacity(force_dim * contacts),
            normals: Rows::with_capacity(contacts),
            dual: SVector::zeros(),
            reach: 1.0,
            unique: true,
            fell_back: false,
            units: SVector::repeat(1.0),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.conditions.clear();
        self.equations.clear();
        self.forces.clear();
        self.normals.clear();
    }

    /// Whether the law holds at `b`, up to `tolerance` relative to the largest normalised force.
    #[inline]
    pub(crate) fn contains(&self, b: &SVector<f64, R>, tolerance: f64) -> bool {
        let objective = self.dual.dot(b);
        let floor = -tolerance * objective;
        // Written so that NaN is outside, and so is what would make forces overflow.
        let inside = REPRESENTABLE.contains(&objective) && self.conditions.range(b, floor).0 >= floor;
        inside && (self.equations.count == 0 || self.balances(b))
    }

    /// Whether the law's forces at `b`, for which it was made, are forces at all: rounding may leave it none that push.
    pub(crate) fn pushes(&self, b: &SVector<f64, R>, tolerance: f64) -> bool {
        let objective = self.dual.dot(b);
        let floor = -tolerance * objective;
        objective > 0.0 && self.conditions.range(b, floor).0 >= floor
    }

    /// Whether the part of `b` outside the span of the forces is rounding.
    fn balances(&self, b: &SVector<f64, R>) -> bool {
        let (low, high) = self.equations.range(b, f64::NEG_INFINITY);
        high.max(-low) <= UNBALANCED * b.component_mul(&self.units).norm()
    }
}
