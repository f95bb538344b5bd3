//! Which of a contact's primitive wrenches lies furthest along a direction: the innermost question of all.
//!
//! Wrenches stand in blocks, component by component, so that a block fills vector registers.

use std::ops::Deref;

use nalgebra::SVector;

/// How many wrenches are measured at a time.
const LANES: usize = 4;

/// Some wrenches of one contact, component by component.
pub(crate) type EdgeBlock<const R: usize> = [[f64; LANES]; R];

/// All wrenches of one contact. A single block, as that of every planar contact, needs no memory of its own.
#[derive(Debug, Clone)]
pub(crate) enum EdgeBlocks<const R: usize> {
    One(EdgeBlock<R>),
    Many(Vec<EdgeBlock<R>>),
}

impl<const R: usize> Deref for EdgeBlocks<R> {
    type Target = [EdgeBlock<R>];

    #[inline]
    fn deref(&self) -> &[EdgeBlock<R>] {
        match self {
            Self::One(block) => std::slice::from_ref(block),
            Self::Many(blocks) => blocks,
        }
    }
}

/// The wrenches of one contact in blocks. The last repeats its first wrench, which never beats its own lower index.
pub(crate) fn edge_blocks<const R: usize>(
    mut wrenches: impl ExactSizeIterator<Item = SVector<f64, R>>,
) -> EdgeBlocks<R> {
    let count = wrenches.len().div_ceil(LANES);
    let mut blocks = std::iter::from_fn(|| next_block(&mut wrenches));
    if count == 1
        && let Some(block) = blocks.next()
    {
        return EdgeBlocks::One(block);
    }
    let mut many = Vec::with_capacity(count);
    many.extend(blocks);
    EdgeBlocks::Many(many)
}

fn next_block<const R: usize>(wrenches: &mut impl Iterator<Item = SVector<f64, R>>) -> Option<EdgeBlock<R>> {
    let first = wrenches.next()?;
    let mut block: EdgeBlock<R> = std::array::from_fn(|row| [first[row]; LANES]);
    for lane in 1..LANES {
        let Some(wrench) = wrenches.next() else { break };
        for (row, component) in block.iter_mut().zip(wrench.iter()) {
            row[lane] = *component;
        }
    }
    Some(block)
}

/// How far each wrench of a block reaches along `z`.
#[inline]
fn block_values<const R: usize>(block: &EdgeBlock<R>, z: &SVector<f64, R>) -> [f64; LANES] {
    let mut values = [0.0; LANES];
    for (row, component) in block.iter().zip(&z.data.0[0]) {
        for lane in 0..LANES {
            values[lane] += row[lane] * component;
        }
    }
    values
}

/// The largest; one that is no number counts for none. [`f64::max`] takes several instructions, this one each.
#[inline]
fn largest(values: [f64; LANES]) -> f64 {
    let larger = |a: f64, b: f64| if b > a { b } else { a };
    let [a, b, c, d] = values;
    larger(larger(a, b), larger(c, d))
}

/// How far the furthest wrench reaches along `z`.
#[inline]
pub(crate) fn furthest_value<const R: usize>(blocks: &[EdgeBlock<R>], z: &SVector<f64, R>) -> f64 {
    let mut best = [f64::NEG_INFINITY; LANES];
    for block in blocks {
        let values = block_values(block, z);
        for lane in 0..LANES {
            best[lane] = if values[lane] > best[lane] { values[lane] } else { best[lane] };
        }
    }
    largest(best)
}

/// How far the furthest wrench reaches along `z`, and its number. Among equals the lowest wins, so that the answer does
/// not depend on the lanes.
#[inline]
pub(crate) fn furthest_edge<const R: usize>(blocks: &[EdgeBlock<R>], z: &SVector<f64, R>) -> (f64, usize) {
    let mut best = [f64::NEG_INFINITY; LANES];
    let mut at = [0_u64; LANES];
    for (index, block) in (0_u64..).zip(blocks) {
        let values = block_values(block, z);
        for lane in 0..LANES {
            let better = values[lane] > best[lane];
            best[lane] = if better { values[lane] } else { best[lane] };
            at[lane] = if better { index } else { at[lane] };
        }
    }
    // Without branches: which lane wins is as good as random.
    let most = largest(best);
    let mut edge = u64::MAX;
    for (lane, (value, index)) in (0_u64..).zip(best.into_iter().zip(at)) {
        let candidate = if value >= most { index * LANES as u64 + lane } else { u64::MAX };
        edge = edge.min(candidate);
    }
    (most, edge as usize)
}

/// The numbers of those of `count` wrenches that reach at least `least` along `z`.
pub(crate) fn edges_reaching<const R: usize>(
    blocks: &[EdgeBlock<R>],
    count: usize,
    z: &SVector<f64, R>,
    least: f64,
) -> impl Iterator<Item = usize> {
    let reaching = move |(index, block): (usize, &EdgeBlock<R>)| {
        let values = block_values(block, z);
        // Most blocks hold none.
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lanes = if most >= least { LANES } else { 0 };
        (0..lanes).filter(move |&lane| values[lane] >= least).map(move |lane| index * LANES + lane)
    };
    blocks.iter().enumerate().flat_map(reaching).filter(move |&edge| edge < count)
}

/// How far the wrench of this number reaches along `z`, by the products of [`furthest_edge`].
#[inline]
pub(crate) fn edge_value<const R: usize>(blocks: &[EdgeBlock<R>], number: usize, z: &SVector<f64, R>) -> f64 {
    let (block, lane) = (&blocks[number / LANES], number % LANES);
    let mut value = 0.0;
    for (row, component) in block.iter().zip(z.iter()) {
        value += row[lane] * component;
    }
    value
}

/// The wrench of this number.
#[inline]
pub(crate) fn edge<const R: usize>(blocks: &[EdgeBlock<R>], number: usize) -> SVector<f64, R> {
    let block = &blocks[number / LANES];
    SVector::from_fn(|row, _| block[row][number % LANES])
}

/// The length of the longest wrench.
pub(crate) fn longest_edge<const R: usize>(blocks: &[EdgeBlock<R>]) -> f64 {
    let squares = blocks.iter().flat_map(|block| {
        (0..LANES).map(move |lane| block.iter().map(|row| row[lane] * row[lane]).sum::<f64>())
    });
    squares.fold(0.0, f64::max).sqrt()
}
