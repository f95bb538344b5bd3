//! The bound of one product of cells along its own worst direction.

use rayon::prelude::*;

use crate::convex::expanding_polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::error::Result;
use crate::grasp::Wrench;
use crate::interrupt;
use crate::planning::product_bound::cells::{LEAF, rounded_up};
use crate::planning::product_bound::{ProductBound, deadline, is_late};
use crate::tolerances::BOX_BOUND_RTOL;
use crate::wrench_set::{Criterion, Support};

/// Directions that a thread tries first: those that it found last.
const RECENT: usize = 8;

/// Products that one task asks for: neighbours in the list share directions.
const NEIGHBOURS: usize = 64;

/// Steps downhill before a polytope is grown, which costs far more.
const TURNS: usize = 30;

/// Facets of a polytope at most: cells that need more are better cut.
pub(crate) const FACETS: usize = 4000;

/// What a thread works with.
pub(crate) struct Memory<const D: usize> {
    polytope: Polytope<D>,
    recent: Vec<Wrench<D>>,
}

/// What is known of the least `p(z)` of a set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Least<const D: usize> {
    /// It is at most this, ...
    pub(crate) upper: f64,
    /// ... which is `p` of this direction.
    pub(crate) direction: Wrench<D>,
    /// A ball of this radius lies in the set.
    pub(crate) lower: f64,
}

impl<const D: usize> Memory<D> {
    pub(crate) fn new() -> Self {
        Self { polytope: Polytope::new(), recent: Vec::new() }
    }

    /// Looks for the least `p(z)`, until a value is at most `enough`: first from directions near at hand, then by a
    /// polytope of at most so many facets.
    pub(crate) fn least(
        &mut self,
        scale: f64,
        enough: f64,
        first: Option<&Wrench<D>>,
        facets: usize,
        mut support: impl FnMut(&Wrench<D>) -> Support<D>,
    ) -> Least<D> {
        let mut best = Least { upper: f64::INFINITY, direction: Wrench::zeros(), lower: 0.0 };
        let mut start = None;
        for z in first.into_iter().chain(self.recent.iter().rev()) {
            let there = support(z);
            if there.value < best.upper {
                (best.upper, best.direction) = (there.value, *z);
                start = Some(there);
            }
            if there.value <= enough {
                return best;
            }
        }
        // A little beyond, so that the bound is passed and not only approached.
        let target = enough - 1e-3 * enough.abs();
        let (mut z, mut there) = (best.direction, start);
        for _ in 0..TURNS {
            let Some(next) = there.and_then(|there| there.downhill(&z, target)) else { break };
            let reached = support(&next);
            (z, there) = (next, Some(reached));
            if reached.value < best.upper {
                (best.upper, best.direction) = (reached.value, z);
            }
            if reached.value <= enough {
                self.remember(z);
                return best;
            }
        }
        if facets == 0 {
            return best;
        }
        let limits = Limits { stop_below: enough, max_facets: facets, ..Limits::new(BOX_BOUND_RTOL) };
        let (upper, direction) = match self.polytope.expand(1e-3 * scale, &limits, support) {
            Expansion::Radius(Radius { upper, direction, lower, .. }) => {
                best.lower = lower;
                (upper, direction)
            }
            Expansion::Pierced(Thinnest { upper, direction, .. })
            | Expansion::Stopped(Thinnest { upper, direction, .. }) => (upper, direction),
        };
        if upper < best.upper {
            (best.upper, best.direction) = (upper, direction);
            self.remember(direction);
        }
        best
    }

    fn remember(&mut self, direction: Wrench<D>) {
        if self.recent.len() == RECENT {
            self.recent.remove(0);
        }
        self.recent.push(direction);
    }
}

impl<const D: usize> ProductBound<D> {
    /// Adds up what groups reach, and the external wrench.
    pub(crate) fn joined(
        &self,
        parts: impl Iterator<Item = (f64, Wrench<D>)>,
        z: &Wrench<D>,
    ) -> Support<D> {
        let (mut value, mut wrench) = (f64::NEG_INFINITY, Wrench::zeros());
        for (reach, point) in parts {
            match self.criterion {
                Criterion::Max => (value, wrench) = (value.max(0.0) + reach, wrench + point),
                Criterion::Sum if reach > value => (value, wrench) = (reach, point),
                Criterion::Sum => {}
            }
        }
        if let Some(center) = &self.center {
            if value < 0.0 {
                (value, wrench) = (0.0, Wrench::zeros());
            }
            (value, wrench) = (value + center.dot(z), wrench + center);
        }
        Support { value, wrench }
    }

    fn support(&self, product: &[u32], z: &Wrench<D>) -> Support<D> {
        let parts = product.iter().zip(&self.groups).map(|(&cell, group)| {
            let (reach, vertex) = group.furthest_corner(self.criterion, cell, z);
            (reach, group.furthest(self.criterion, vertex, z))
        });
        self.joined(parts, z)
    }

    /// What the cells of a product leave open between their corners.
    fn slack(&self, product: &[u32]) -> f64 {
        let each = product.iter().zip(&self.groups).map(|(&cell, group)| group.tree.slacks[cell as usize]);
        match self.criterion {
            Criterion::Max => each.sum(),
            Criterion::Sum => each.fold(0.0, f64::max),
        }
    }

    /// No wrench of a grasp is longer.
    pub(crate) fn scale(&self) -> f64 {
        let each = self.groups.iter().map(super::cells::Group::longest);
        let longest = match self.criterion {
            Criterion::Max => each.sum(),
            Criterion::Sum => each.fold(0.0, f64::max),
        };
        longest + self.center.map_or(0.0, |center| center.norm())
    }

    /// Bounds these products along their own worst directions, in parallel, and drops those that come to at most
    /// `enough`. Returns the directions of the others, and of a few that were dropped.
    ///
    /// Products whose cells have children stay as they are, and so does what is left after `seconds`.
    pub fn ask(&mut self, rows: &[usize], enough: f64, seconds: f64) -> Result<Vec<Wrench<D>>> {
        let (end, scale, interrupt) = (deadline(seconds), self.scale(), interrupt::current());
        let bound = &*self;
        let tasks: Vec<Vec<(usize, f64, Wrench<D>)>> = rows
            .par_chunks(NEIGHBOURS.min(rows.len() / 8 + 1))
            .map_init(Memory::new, |memory, rows| {
                interrupt::inherit(interrupt.as_ref(), || {
                    let mut found = Vec::with_capacity(rows.len());
                    for &row in rows {
                        if is_late(end) || interrupt::stopped() {
                            break;
                        }
                        let product = bound.product(row);
                        let is_leaf = |(&cell, group): (&u32, &super::cells::Group<D>)| {
                            group.tree.children[cell as usize] == LEAF
                        };
                        let slack = bound.slack(product);
                        if slack >= enough || !slack.is_finite() || !product.iter().zip(&bound.groups).all(is_leaf) {
                            continue;
                        }
                        let support = |z: &Wrench<D>| bound.support(product, z);
                        let least = memory.least(scale, enough - slack, None, FACETS, support);
                        found.push((row, least.upper + slack, least.direction));
                    }
                    found
                })
            })
            .collect();
        let mut directions = Vec::new();
        for (row, bound, direction) in tasks.into_iter().flatten() {
            self.bounds[row] = self.bounds[row].min(rounded_up(bound));
            directions.push(direction);
        }
        self.drop_below(enough);
        interrupt::check()?;
        Ok(directions)
    }
}
