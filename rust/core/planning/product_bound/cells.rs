//! Cells of the parameters of one group of contacts, and how far contacts within them reach.

use nalgebra::{Matrix4, Vector3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::grasp::contact::ContactForce;
use crate::grasp::{ContactMap, Wrench};
use crate::memory::filled;
use crate::wrench_set::Criterion;
use crate::wrench_set::cone::cone_slope;
use crate::wrench_set::contact_support::ContactSupport;

/// Directions of a pool: `p(z)` of each cell is kept for that many.
pub(crate) const POOL: usize = 1024;

/// In place of a cell's first child: it has none.
pub(crate) const LEAF: u32 = u32::MAX;

/// Sums of supports in single precision are rounded by less than this part of them.
const ROUNDED_SUM: f64 = 4e-7;

/// The forces of one contact, in its frame.
#[derive(Debug, Clone, PartialEq)]
pub enum ForceSet {
    /// The convex hull of zero and these forces.
    Finite(Vec<ContactForce>),
    /// The true cone of a normal force up to `limit`, with the friction coefficients `mu` and `gamma`.
    Cone {
        /// Limit of the normal force.
        limit: f64,
        /// Friction coefficient.
        mu: f64,
        /// Torsional friction coefficient in m.
        gamma: f64,
    },
}

impl ForceSet {
    fn support(&self) -> ContactSupport<4> {
        match self {
            Self::Finite(forces) => ContactSupport::finite(forces.iter().copied(), 0),
            Self::Cone { limit, mu, gamma } => {
                ContactSupport::cone(&Matrix4::identity(), *mu, *gamma, *limit)
            }
        }
    }
}

/// The cells of a group as a binary tree. Those without children have corners.
#[derive(Debug, Clone, Default)]
pub struct CellTree<const D: usize> {
    /// The first of a cell's two children, which are neighbours and come after it; `u32::MAX` if it has none.
    pub children: Vec<u32>,
    /// Where the corners of each cell start in `corners`, and where the last of them end.
    pub corner_starts: Vec<u32>,
    /// Numbers of vertices.
    pub corners: Vec<u32>,
    /// How far the supports within a cell exceed those at its corners.
    pub slacks: Vec<f64>,
    /// The contact maps of a vertex's contacts, vertex by vertex, where the norm of wrenches is Euclidean.
    pub maps: Vec<ContactMap<D>>,
    /// Where the vertices are, if each cell is a triangle with one contact and one frame; else none.
    pub positions: Vec<Vector3<f64>>,
}

impl<const D: usize> CellTree<D> {
    /// Refuses what is no tree of cells.
    pub(crate) fn check(&self, contacts: usize) -> Result<()> {
        let wrong = |reason: String| Err(Error::input("cells", reason));
        let count = self.children.len();
        let vertices = self.maps.len() / contacts.max(1);
        if count == 0 || self.slacks.len() != count || self.corner_starts.len() != count + 1 {
            return wrong(format!("{count} cells with {} slacks", self.slacks.len()));
        }
        if vertices * contacts != self.maps.len() || self.maps.iter().flatten().any(|x| !x.is_finite()) {
            return wrong(format!(
                "{} maps of {contacts} contacts are not finite or not whole",
                self.maps.len()
            ));
        }
        if self.corners.iter().any(|&corner| corner as usize >= vertices) {
            return wrong(format!("a corner is none of {vertices} vertices"));
        }
        if !(self.positions.is_empty() || self.positions.len() == vertices) {
            return wrong(format!("{} positions of {vertices} vertices", self.positions.len()));
        }
        let mut has_parent = vec![false; count];
        for cell in 0..count {
            let (first, last) = (self.corner_starts[cell], self.corner_starts[cell + 1]);
            let child = self.children[cell];
            let listed = first <= last && last as usize <= self.corners.len();
            let sound = listed
                && if child == LEAF {
                    first < last
                } else {
                    let [a, b] = [child as usize, (child as usize).saturating_add(1)];
                    a > cell
                        && b < count
                        && !std::mem::replace(&mut has_parent[a], true)
                        && !std::mem::replace(&mut has_parent[b], true)
                };
            if !sound || self.slacks[cell].is_nan() {
                return wrong(format!("cell {cell}: neither children nor corners, or no slack"));
            }
        }
        Ok(())
    }

    pub(crate) fn corners_of(&self, cell: u32) -> &[u32] {
        let cell = cell as usize;
        &self.corners[self.corner_starts[cell] as usize..self.corner_starts[cell + 1] as usize]
    }
}

/// A contact's place, and its map there.
pub(crate) type Corner<const D: usize> = (Vector3<f64>, ContactMap<D>);

/// A product of triangles.
#[derive(Debug, Clone)]
pub(crate) struct Piece<const D: usize> {
    pub(crate) triangles: Vec<[Corner<D>; 3]>,
    pub(crate) depth: usize,
    pub(crate) bound: f64,
    /// The directions that give this bound.
    pub(crate) directions: Vec<Wrench<D>>,
}

/// One group of contacts: its cells, and the supports of each of them along the pool.
#[derive(Debug, Clone)]
pub(crate) struct Group<const D: usize> {
    pub(crate) forces: Vec<ForceSet>,
    /// How far they reach along `G_i^T z`.
    pub(crate) supports: Vec<ContactSupport<4>>,
    pub(crate) tree: CellTree<D>,
    /// Least and largest coordinates of the contact, where positions are known.
    pub(crate) extents: Vec<[Vector3<f64>; 2]>,
    /// The range of each cell's leaves, counted from the left.
    pub(crate) ranks: Vec<[u32; 2]>,
    /// `POOL` supports for each cell, rounded up; infinite where no direction is.
    pub(crate) table: Vec<f32>,
}

/// No smaller single-precision number is as large, not even after a few additions.
pub(crate) fn rounded_up(x: f64) -> f32 {
    if !x.is_finite() {
        return x as f32;
    }
    let wider = x + ROUNDED_SUM * x.abs();
    let near = wider as f32;
    if f64::from(near) < wider { near.next_up() } else { near }
}

impl<const D: usize> Group<D> {
    pub(crate) fn new(forces: Vec<ForceSet>) -> Self {
        let supports = forces.iter().map(ForceSet::support).collect();
        let (tree, extents, ranks, table) = (CellTree::default(), Vec::new(), Vec::new(), Vec::new());
        Self { forces, supports, tree, extents, ranks, table }
    }

    /// Puts other cells in place of those there are.
    pub(crate) fn plant(&mut self, tree: CellTree<D>) -> Result<()> {
        tree.check(self.forces.len())?;
        let count = tree.children.len();
        self.table = filled("supports of cells", count.saturating_mul(POOL), f32::INFINITY)?;
        self.tree = tree;
        self.rank();
        self.measure();
        Ok(())
    }

    fn rank(&mut self) {
        let count = self.tree.children.len();
        let mut sizes = vec![1_u32; count];
        for cell in (0..count).rev() {
            let child = self.tree.children[cell];
            if child != LEAF {
                sizes[cell] = sizes[child as usize] + sizes[child as usize + 1];
            }
        }
        self.ranks = vec![[0, 0]; count];
        let mut ranked = vec![false; count];
        let mut next = 0;
        for cell in 0..count {
            if !ranked[cell] {
                self.ranks[cell] = [next, next + sizes[cell]];
                next += sizes[cell];
            }
            let child = self.tree.children[cell] as usize;
            if self.tree.children[cell] != LEAF {
                let [first, last] = self.ranks[cell];
                self.ranks[child] = [first, first + sizes[child]];
                self.ranks[child + 1] = [first + sizes[child], last];
                (ranked[child], ranked[child + 1]) = (true, true);
            }
        }
    }

    fn measure(&mut self) {
        self.extents.clear();
        if self.tree.positions.is_empty() {
            return;
        }
        let nowhere = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        self.extents.resize(self.tree.children.len(), nowhere);
        for cell in (0..self.tree.children.len()).rev() {
            let child = self.tree.children[cell];
            self.extents[cell] = if child == LEAF {
                let places =
                    self.tree.corners_of(cell as u32).iter().map(|&v| self.tree.positions[v as usize]);
                places.fold(nowhere, |[low, high], p| [low.inf(&p), high.sup(&p)])
            } else {
                let [a, b] = [self.extents[child as usize], self.extents[child as usize + 1]];
                [a[0].inf(&b[0]), a[1].sup(&b[1])]
            };
        }
    }

    /// How far the contacts at a vertex reach along `z`.
    pub(crate) fn reach(&self, criterion: Criterion, vertex: u32, z: &Wrench<D>) -> f64 {
        let contacts = self.forces.len();
        let maps = &self.tree.maps[vertex as usize * contacts..][..contacts];
        let reaches = self.supports.iter().zip(maps).map(|(forces, map)| forces.value(&map.tr_mul(z)));
        match criterion {
            Criterion::Max => reaches.map(|reach| reach.max(0.0)).sum(),
            Criterion::Sum => reaches.fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// How far they reach, and where.
    pub(crate) fn support(&self, criterion: Criterion, vertex: u32, z: &Wrench<D>) -> (f64, Wrench<D>) {
        let contacts = self.forces.len();
        let maps = &self.tree.maps[vertex as usize * contacts..][..contacts];
        furthest(criterion, self.supports.iter().zip(maps), z)
    }

    /// The corner of a cell at which contacts reach furthest along `z`, and how far.
    pub(crate) fn furthest_corner(&self, criterion: Criterion, cell: u32, z: &Wrench<D>) -> (f64, u32) {
        let reached = |&vertex: &u32| (self.reach(criterion, vertex, z), vertex);
        let corners = self.tree.corners_of(cell).iter().map(reached);
        corners.fold((f64::NEG_INFINITY, 0), |best, other| if other.0 > best.0 { other } else { best })
    }

    /// The length of the longest wrench at any corner.
    pub(crate) fn longest(&self) -> f64 {
        let contacts = self.forces.len();
        let lengths = self.tree.maps.iter().enumerate().map(|(at, map)| {
            let lengths = ContactForce::from_fn(|column, _| map.column(column).norm());
            match &self.forces[at % contacts] {
                ForceSet::Finite(forces) => forces.iter().map(|f| (map * f).norm()).fold(0.0, f64::max),
                ForceSet::Cone { limit, mu, gamma } => {
                    limit * (lengths[0] + cone_slope(&lengths, *mu, *gamma))
                }
            }
        });
        lengths.fold(0.0, f64::max)
    }

    /// Fills the table from place `at` of the pool on.
    pub(crate) fn learn(&mut self, criterion: Criterion, directions: &[Wrench<D>], at: usize) -> Result<()> {
        let (count, vertices) = (directions.len(), self.tree.maps.len() / self.forces.len());
        let mut reaches = filled("supports of vertices", vertices.saturating_mul(count), 0.0_f32)?;
        if count == 0 {
            return Ok(());
        }
        let group = &*self;
        reaches.par_chunks_mut(count).enumerate().with_min_len(16).for_each(|(vertex, reaches)| {
            for (reach, z) in reaches.iter_mut().zip(directions) {
                *reach = rounded_up(group.reach(criterion, vertex as u32, z));
            }
        });
        let mut table = std::mem::take(&mut self.table);
        let rows = table.par_chunks_mut(POOL).enumerate().with_min_len(16);
        rows.filter(|(cell, _)| self.tree.children[*cell] == LEAF).for_each(|(cell, row)| {
            let row = &mut row[at..at + count];
            row.fill(f32::NEG_INFINITY);
            for &vertex in self.tree.corners_of(cell as u32) {
                for (most, reach) in row.iter_mut().zip(&reaches[vertex as usize * count..]) {
                    *most = most.max(*reach);
                }
            }
            let slack = self.tree.slacks[cell];
            for most in row {
                *most = rounded_up(f64::from(*most) + slack);
            }
        });
        for cell in (0..self.tree.children.len()).rev() {
            let child = self.tree.children[cell] as usize;
            if self.tree.children[cell] != LEAF {
                let (before, after) = table.split_at_mut(child * POOL);
                let row = &mut before[cell * POOL + at..][..count];
                for (place, most) in row.iter_mut().enumerate() {
                    *most = after[at + place].max(after[POOL + at + place]);
                }
            }
        }
        self.table = table;
        Ok(())
    }

    /// Keeps these places of the pool, in this order.
    pub(crate) fn keep_directions(&mut self, order: &[usize]) {
        self.table.par_chunks_mut(POOL).for_each(|row| {
            let kept: Vec<f32> = order.iter().map(|&at| row[at]).collect();
            row.fill(f32::INFINITY);
            row[..kept.len()].copy_from_slice(&kept);
        });
    }

    /// Keeps these cells, in this order; a kept cell's children must be kept, side by side.
    pub(crate) fn keep_cells(&mut self, kept: &[u32]) {
        let mut place = vec![LEAF; self.tree.children.len()];
        for (at, &cell) in kept.iter().enumerate() {
            place[cell as usize] = at as u32;
        }
        let old = std::mem::take(&mut self.tree);
        let mut starts = vec![0];
        let mut corners = Vec::new();
        for &cell in kept {
            corners.extend_from_slice(old.corners_of(cell));
            starts.push(corners.len() as u32);
        }
        let of = |cell: u32| old.children[cell as usize];
        self.tree.children =
            kept.iter().map(|&cell| if of(cell) == LEAF { LEAF } else { place[of(cell) as usize] }).collect();
        self.tree.slacks = kept.iter().map(|&cell| old.slacks[cell as usize]).collect();
        (self.tree.corner_starts, self.tree.corners) = (starts, corners);
        (self.tree.maps, self.tree.positions) = (old.maps, old.positions);
        self.ranks = kept.iter().map(|&cell| self.ranks[cell as usize]).collect();
        if !self.extents.is_empty() {
            self.extents = kept.iter().map(|&cell| self.extents[cell as usize]).collect();
        }
        for (at, &cell) in kept.iter().enumerate() {
            self.table.copy_within(cell as usize * POOL..(cell as usize + 1) * POOL, at * POOL);
        }
        self.table.truncate(kept.len() * POOL);
        self.table.shrink_to_fit();
    }
}

/// How far these contacts reach along `z`, and by which wrench; zero where no contact reaches forward and forces add up.
pub(crate) fn furthest<'a, const D: usize>(
    criterion: Criterion,
    contacts: impl Iterator<Item = (&'a ContactSupport<4>, &'a ContactMap<D>)>,
    z: &Wrench<D>,
) -> (f64, Wrench<D>) {
    let least = if criterion == Criterion::Max { 0.0 } else { f64::NEG_INFINITY };
    let mut found = (least, Wrench::zeros());
    for (forces, map) in contacts {
        let h = map.tr_mul(z);
        let (reach, edge) = forces.furthest(&h);
        match criterion {
            Criterion::Max if reach > 0.0 => {
                found = (found.0 + reach, found.1 + map * forces.wrench(&h, edge));
            }
            Criterion::Sum if reach > found.0 => found = (reach, map * forces.wrench(&h, edge)),
            _ => {}
        }
    }
    found
}
