//! Products of cells, divided down to the leaves of their trees and discarded on the way.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::error::Result;
use crate::interrupt;
use crate::planning::product_bound::cells::{LEAF, POOL};
use crate::planning::product_bound::{MAX_GROUPS, ProductBound, deadline, is_late};
use crate::wrench_set::Criterion;

/// Directions between two looks at a bound.
const LANES: usize = 32;

/// Products that are divided side by side.
const ENOUGH_TASKS: usize = 4096;

/// Parts of the list of products: each counts what directions discard.
const MOST_PARTS: usize = 512;

/// Products between two looks at the clock.
const POLL: usize = 256;

/// What a part of the descent leaves.
#[derive(Default)]
struct Left {
    products: Vec<u32>,
    bounds: Vec<f32>,
    discarded: f32,
    merits: Vec<u32>,
}

impl<const D: usize> ProductBound<D> {
    /// Divides products down to cells without children, and drops those whose bound along the pool is at most `enough`.
    ///
    /// It stops after `seconds`, or as soon as `most` products are left. What was not divided by then stays as it is.
    pub fn descend(&mut self, enough: f64, most: usize, seconds: f64) -> Result<()> {
        let end = deadline(seconds);
        // Bounds are compared in single precision, and must not pass for less than they are.
        let enough =
            if f64::from(enough as f32) > enough { (enough as f32).next_down() } else { enough as f32 };
        loop {
            let divisible = |row| self.widest(self.product(row)).is_some();
            let narrow = self.bounds.len() < ENOUGH_TASKS && (0..self.bounds.len()).any(divisible);
            if !narrow || is_late(end) || interrupt::stopped() {
                self.pass(enough, most, end, true)?;
                break;
            }
            self.pass(enough, usize::MAX, end, false)?;
        }
        self.sort_directions(POOL);
        interrupt::check()
    }

    /// Divides all products once, or down to the leaves.
    fn pass(&mut self, enough: f32, most: usize, end: Option<std::time::Instant>, whole: bool) -> Result<()> {
        let (count, number) = (self.groups.len(), AtomicUsize::new(0));
        let interrupt = interrupt::current();
        let bound = &*self;
        let size = (self.bounds.len() / MOST_PARTS).max(if whole { 16 } else { 8 });
        let parts: Vec<Left> = self
            .products
            .par_chunks(size * count)
            .zip(self.bounds.par_chunks(size))
            .map(|(products, bounds)| {
                let work = || bound.part(products, bounds, enough, (most, &number), end, whole);
                interrupt::inherit(interrupt.as_ref(), work)
            })
            .collect();
        let total = parts.iter().map(|part| part.bounds.len()).sum();
        let mut products = crate::memory::room("products of cells", total * count)?;
        let mut bounds = crate::memory::room("products of cells", total)?;
        for part in parts {
            products.extend_from_slice(&part.products);
            bounds.extend_from_slice(&part.bounds);
            self.discarded = self.discarded.max(f64::from(part.discarded));
            for (merit, more) in self.merits.iter_mut().zip(part.merits) {
                *merit += f64::from(more);
            }
        }
        (self.products, self.bounds) = (products, bounds);
        Ok(())
    }

    fn part(
        &self,
        products: &[u32],
        bounds: &[f32],
        enough: f32,
        (most, number): (usize, &AtomicUsize),
        end: Option<std::time::Instant>,
        whole: bool,
    ) -> Left {
        let count = self.groups.len();
        let mut left =
            Left { discarded: f32::NEG_INFINITY, merits: vec![0; self.directions.len()], ..Left::default() };
        let mut stack: Vec<([u32; MAX_GROUPS], f32)> = Vec::new();
        let (mut looked, mut stop) = (0_usize, false);
        for (product, &bound) in products.chunks_exact(count).zip(bounds) {
            let mut cells = [0; MAX_GROUPS];
            cells[..count].copy_from_slice(product);
            stack.push((cells, bound));
            while let Some((cells, before)) = stack.pop() {
                let product = &cells[..count];
                looked += 1;
                if looked % POLL == 0 {
                    stop |= is_late(end) || interrupt::stopped();
                }
                stop |= number.load(Ordering::Relaxed) >= most;
                if stop {
                    left.keep(product, before, number);
                    continue;
                }
                let bound = self.scan(product, enough, before, &mut left);
                if bound <= enough {
                    left.discarded = left.discarded.max(bound);
                    continue;
                }
                let Some((group, child)) = self.widest(product) else {
                    left.keep(product, bound, number);
                    continue;
                };
                for cell in [child, child + 1] {
                    let mut half = cells;
                    half[group] = cell;
                    if self.is_needless(&half[..count]) {
                        continue;
                    }
                    if whole {
                        stack.push((half, bound));
                    } else {
                        left.keep(&half[..count], bound, number);
                    }
                }
            }
        }
        left
    }

    /// The group whose cell has most leaves, and the first child of that cell.
    fn widest(&self, product: &[u32]) -> Option<(usize, u32)> {
        let leaves = |group: usize, cell: u32| {
            let [first, last] = self.groups[group].ranks[cell as usize];
            last - first
        };
        let divisible = product.iter().enumerate().filter_map(|(group, &cell)| {
            let child = self.groups[group].tree.children[cell as usize];
            (child != LEAF).then(|| (leaves(group, cell), group, child))
        });
        divisible.max_by_key(|(leaves, ..)| *leaves).map(|(_, group, child)| (group, child))
    }

    /// The least bound of a product along the pool, or the first that is at most `enough`.
    fn scan(&self, product: &[u32], enough: f32, before: f32, left: &mut Left) -> f32 {
        let mut least = before;
        for at in (0..self.directions.len()).step_by(LANES) {
            let mut reach = [f32::NEG_INFINITY; LANES];
            for (group, (cell, member)) in product.iter().zip(&self.groups).enumerate() {
                let Some(row) =
                    member.table.get(*cell as usize * POOL + at..).and_then(|row| row.first_chunk::<LANES>())
                else {
                    return least;
                };
                for (reach, other) in reach.iter_mut().zip(row) {
                    *reach = match self.criterion {
                        _ if group == 0 => *other,
                        Criterion::Max => *reach + other,
                        Criterion::Sum => reach.max(*other),
                    };
                }
            }
            if self.center.is_some() {
                for (reach, shift) in reach.iter_mut().zip(&self.shifts[at..]) {
                    *reach = reach.max(0.0) + shift;
                }
            }
            let shortest = reach.iter().fold(f32::INFINITY, |least, &reach| least.min(reach));
            least = least.min(shortest);
            if least <= enough {
                if let Some(place) = reach.iter().position(|&reach| reach <= enough)
                    && let Some(merit) = left.merits.get_mut(at + place)
                {
                    *merit += 1;
                }
                return least;
            }
        }
        least
    }
}

impl Left {
    fn keep(&mut self, product: &[u32], bound: f32, number: &AtomicUsize) {
        self.products.extend_from_slice(product);
        self.bounds.push(bound);
        number.fetch_add(1, Ordering::Relaxed);
    }
}
