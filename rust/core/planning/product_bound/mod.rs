//! How good can a grasp be whose contacts have parameters of their own? Bounds of products of cells.
//!
//! For any unit `z`, `epsilon <= p(z)`. If the contacts fall into groups k with parameters of their own,
//! `p(z) = sum_k p_k(z)` (for the union: the largest `p_k`). The bound of a product of cells is therefore the sum (or
//! the largest) of one number for each cell: `p_k(z)` at its best corner, plus the cell's slack. These numbers are
//! computed once for each cell and each direction of a pool; products of cells are then discarded by additions.
//!
//! | file | holds |
//! |---|---|
//! | [`cells`] | the tree of cells of one group, and their supports along the pool |
//! | [`descent`] | products of cells, divided and discarded |
//! | [`exact`] | the bound of one product along the directions that are worst for it |
//! | [`mixture`] | the best mixture of directions for one product |
//! | [`triangles`] | triangles with one frame each, divided until their bounds are low enough |
//!
//! The wrenches of a contact with a constant frame are affine in its position. On a triangle of a mesh with face
//! normals the largest support therefore stands at a corner, and the slack is zero.

pub(crate) mod cells;
pub(crate) mod descent;
pub(crate) mod exact;
pub(crate) mod mixture;
pub(crate) mod triangles;

use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::grasp::Wrench;
use crate::planning::product_bound::cells::{CellTree, ForceSet, Group, LEAF, POOL, Piece, rounded_up};
use crate::wrench_set::Criterion;

/// Directions of less merit are dropped, ...
const FORGOTTEN: f64 = 0.03;

/// ... but so many are kept.
const LEAST_POOL: usize = 128;

/// The norm of a unit direction may be off by this.
const UNIT: f64 = 1e-9;

/// Groups of contacts at most.
pub(crate) const MAX_GROUPS: usize = 8;

/// Products of cells that may hold a better grasp than the best one known.
///
/// ```
/// use graspforce::{CellTree, ContactForce, ContactMap, Criterion, ForceSet, ProductBound, Wrench};
///
/// // Two fingers without friction on the line: each pushes along x, one from each side.
/// let push = |x: f64| {
///     let mut map = ContactMap::<3>::zeros();
///     map[(0, 0)] = x;
///     let leaf = u32::MAX;
///     CellTree { children: vec![leaf], corner_starts: vec![0, 1], corners: vec![0], slacks: vec![0.0],
///                maps: vec![map], positions: vec![] }
/// };
/// let normal = ForceSet::Finite(vec![ContactForce::new(1.0, 0.0, 0.0, 0.0)]);
/// let groups = vec![vec![normal.clone()], vec![normal]];
/// let mut bound = ProductBound::new(Criterion::Max, None, groups)?;
/// bound.plant(0, push(1.0))?;
/// bound.plant(1, push(-1.0))?;
/// bound.learn(&[Wrench::<3>::y()])?;
/// bound.descend(0.5, 1000, 1.0)?;
/// assert!(bound.is_empty() && bound.top() == 0.0);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug)]
pub struct ProductBound<const D: usize> {
    criterion: Criterion,
    /// The external wrench, where the norm is Euclidean.
    center: Option<Wrench<D>>,
    groups: Vec<Group<D>>,
    directions: Vec<Wrench<D>>,
    /// `z . center` of each direction, rounded up.
    shifts: Vec<f32>,
    /// Products that each direction discarded; recent ones count more.
    merits: Vec<f64>,
    /// The cell of each group, product by product.
    products: Vec<u32>,
    bounds: Vec<f32>,
    /// Parts of products whose triangles were divided.
    pieces: Vec<Piece<D>>,
    /// The largest bound of what was discarded.
    discarded: f64,
    /// Contacts at least this far apart from each other are not asked for.
    max_distance: f64,
    /// Whether the groups have the same cells, so that the order of contacts does not matter.
    interchangeable: bool,
}

impl<const D: usize> ProductBound<D> {
    /// Groups by the forces of their contacts. They have no cells yet.
    pub fn new(criterion: Criterion, center: Option<Wrench<D>>, groups: Vec<Vec<ForceSet>>) -> Result<Self> {
        if groups.is_empty() || groups.len() > MAX_GROUPS || groups.iter().any(Vec::is_empty) {
            let reason =
                format!("{} groups of contacts, expected 1 to {MAX_GROUPS}, none empty", groups.len());
            return Err(Error::input("forces", reason));
        }
        let mut bound = Self {
            criterion,
            center,
            groups: groups.into_iter().map(Group::new).collect(),
            directions: Vec::new(),
            shifts: vec![0.0; POOL],
            merits: Vec::new(),
            products: Vec::new(),
            bounds: Vec::new(),
            pieces: Vec::new(),
            discarded: f64::NEG_INFINITY,
            max_distance: f64::INFINITY,
            interchangeable: false,
        };
        bound.restart();
        Ok(bound)
    }

    /// Leaves out products two of whose contacts are everywhere further apart than `max_distance`. If all groups have the
    /// same cells and forces, each set of contacts is looked at in one order.
    pub fn restrict(&mut self, max_distance: f64, interchangeable: bool) {
        self.max_distance = max_distance;
        self.interchangeable = interchangeable && self.groups.windows(2).all(|g| g[0].forces == g[1].forces);
    }

    /// Gives a group these cells. Those that products refer to keep their numbers.
    pub fn plant(&mut self, group: usize, tree: CellTree<D>) -> Result<()> {
        if group >= self.groups.len() {
            let reason = format!("{group}, but there are {} groups of contacts", self.groups.len());
            return Err(Error::input("group", reason));
        }
        let (directions, criterion) = (self.directions.clone(), self.criterion);
        let used = self.products.iter().skip(group).step_by(self.groups.len()).max().copied().unwrap_or(0);
        if used as usize >= tree.children.len() {
            return Err(Error::input(
                "cells",
                format!("{} cells, but cell {used} is in use", tree.children.len()),
            ));
        }
        let group = &mut self.groups[group];
        group.plant(tree)?;
        group.learn(criterion, &directions, 0)
    }

    /// Adds unit directions to the pool, and returns how many were new. Those of least merit make room.
    pub fn learn(&mut self, directions: &[Wrench<D>]) -> Result<usize> {
        let mut new: Vec<Wrench<D>> = Vec::new();
        // Along a shorter vector the bound would be no bound.
        let is_unit = |z: &Wrench<D>| (z.norm() - 1.0).abs() <= UNIT;
        if let Some(row) = directions.iter().position(|z| !is_unit(z)) {
            let reason = format!("its norm is {}, expected 1", directions[row].norm());
            return Err(Error::InvalidInput { argument: "directions", row: Some(row), reason });
        }
        for z in directions.iter().take(POOL / 2) {
            let known = |other: &Wrench<D>| other.dot(z) >= 1.0 - 1e-9;
            if !self.directions.iter().any(known) && !new.iter().any(known) {
                new.push(*z);
            }
        }
        if self.directions.len() + new.len() > POOL {
            self.sort_directions(POOL - POOL / 4 - new.len() / 2);
        }
        let at = self.directions.len();
        for group in &mut self.groups {
            group.learn(self.criterion, &new, at)?;
        }
        for (place, z) in new.iter().enumerate() {
            self.shifts[at + place] = self.center.map_or(0.0, |center| rounded_up(center.dot(z)));
        }
        self.directions.extend_from_slice(&new);
        self.merits.resize(self.directions.len(), 1.0);
        Ok(new.len())
    }

    /// Starts again with the whole product of the groups. The directions learnt stay.
    pub fn restart(&mut self) {
        self.products = vec![0; self.groups.len()];
        self.bounds = vec![f32::INFINITY];
        self.pieces.clear();
        self.discarded = f64::NEG_INFINITY;
    }

    /// Puts the directions that discard most first, and keeps at most `count`.
    fn sort_directions(&mut self, count: usize) {
        let mut order: Vec<usize> = (0..self.directions.len()).collect();
        order.sort_by(|&a, &b| self.merits[b].total_cmp(&self.merits[a]));
        let useful = order.iter().take_while(|&&at| self.merits[at] > FORGOTTEN).count();
        order.truncate(count.min(useful.max(LEAST_POOL)));
        for group in &mut self.groups {
            group.keep_directions(&order);
        }
        self.directions = order.iter().map(|&at| self.directions[at]).collect();
        self.shifts = order.iter().map(|&at| self.shifts[at]).collect();
        self.shifts.resize(POOL, 0.0);
        self.merits = order.iter().map(|&at| 0.5 * self.merits[at]).collect();
    }

    /// Drops the cells that no product uses, and returns those kept in each group, by their former numbers.
    pub fn compact(&mut self) -> Vec<Vec<u32>> {
        let count = self.groups.len();
        let mut all = Vec::with_capacity(count);
        for (number, group) in self.groups.iter_mut().enumerate() {
            let children = &group.tree.children;
            let mut used = vec![false; children.len()];
            for product in self.products.chunks_exact(count) {
                used[product[number] as usize] = true;
            }
            for cell in 0..children.len() {
                if used[cell] && children[cell] != LEAF {
                    used[children[cell] as usize] = true;
                    used[children[cell] as usize + 1] = true;
                }
            }
            let kept: Vec<u32> = (0..children.len() as u32).filter(|&cell| used[cell as usize]).collect();
            if kept.len() < children.len() {
                let mut place = vec![0; children.len()];
                for (at, &cell) in kept.iter().enumerate() {
                    place[cell as usize] = at as u32;
                }
                for product in self.products.chunks_exact_mut(count) {
                    product[number] = place[product[number] as usize];
                }
                group.keep_cells(&kept);
            }
            all.push(kept);
        }
        all
    }

    /// The number of products left.
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    /// The number of parts left of products whose triangles were divided.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty() && self.pieces.is_empty()
    }

    /// No grasp within the cells is better.
    pub fn top(&self) -> f64 {
        let products = self.bounds.iter().map(|&bound| f64::from(bound));
        products.chain(self.pieces.iter().map(|piece| piece.bound)).fold(self.discarded, f64::max)
    }

    /// The largest bound of what was discarded.
    pub fn discarded(&self) -> f64 {
        self.discarded
    }

    /// The bounds of products.
    pub fn bounds(&self) -> &[f32] {
        &self.bounds
    }

    /// The cells of a product.
    pub fn product(&self, row: usize) -> &[u32] {
        let count = self.groups.len();
        &self.products[row * count..(row + 1) * count]
    }

    /// The rows of the products with the largest bounds, in no order.
    pub fn worst(&self, count: usize) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..self.bounds.len()).collect();
        if count < rows.len() {
            rows.select_nth_unstable_by(count, |&a, &b| self.bounds[b].total_cmp(&self.bounds[a]));
            rows.truncate(count);
        }
        rows
    }

    /// Drops products whose bound is at most `enough`.
    fn drop_below(&mut self, enough: f64) {
        let count = self.groups.len();
        let mut kept = 0;
        for row in 0..self.bounds.len() {
            let bound = self.bounds[row];
            if f64::from(bound) <= enough {
                self.discarded = self.discarded.max(f64::from(bound));
                continue;
            }
            self.bounds[kept] = bound;
            self.products.copy_within(row * count..(row + 1) * count, kept * count);
            kept += 1;
        }
        self.bounds.truncate(kept);
        self.products.truncate(kept * count);
    }

    /// Whether a product repeats another one in a different order, or its contacts are too far apart.
    fn is_needless(&self, product: &[u32]) -> bool {
        let pairs = (0..product.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let cell = |group: usize| product[group] as usize;
        if self.interchangeable {
            let behind =
                |(a, b): (usize, usize)| self.groups[b].ranks[cell(b)][1] <= self.groups[a].ranks[cell(a)][0];
            if pairs.clone().any(behind) {
                return true;
            }
        }
        self.max_distance.is_finite()
            && pairs.clone().any(|(a, b)| {
                let (Some(one), Some(other)) =
                    (self.groups[a].extents.get(cell(a)), self.groups[b].extents.get(cell(b)))
                else {
                    return false;
                };
                let between = (one[0] - other[1]).sup(&(other[0] - one[1])).map(|x| x.max(0.0));
                between.norm() > self.max_distance
            })
    }
}

/// When so many seconds are over; `None` if that is never.
fn deadline(seconds: f64) -> Option<Instant> {
    Duration::try_from_secs_f64(seconds.max(0.0)).ok().and_then(|wait| Instant::now().checked_add(wait))
}

fn is_late(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|end| Instant::now() >= end)
}
