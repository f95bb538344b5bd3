//! The bound of one product of cells along the directions that are worst for it.

use rayon::prelude::*;

use crate::convex::expanding_polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::error::Result;
use crate::grasp::Wrench;
use crate::interrupt;
use crate::planning::product_bound::cells::{LEAF, rounded_up};
use crate::planning::product_bound::mixture::Mixture;
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

/// Directions that are mixed for one product at most.
const MIXED: usize = 40;

/// Corners of all cells at most; more are bounded along one direction.
const MOST_CORNERS: usize = 32;

/// A new direction must close this part of what the mixture leaves open.
const PROGRESS: f64 = 0.02;

/// Facets of a polytope at most that looks for such a direction, where pyramids have edges that steps cannot pass.
const FACETS_OF_MIXED: usize = 400;

/// The best mixture of directions for a product of cells.
#[derive(Debug, Clone)]
pub(crate) struct Mixed<const D: usize> {
    /// No grasp in the cells is better.
    pub(crate) bound: f64,
    /// The directions, and their shares.
    pub(crate) directions: Vec<(Wrench<D>, f64)>,
    /// Shares of the corners: where the bound stands.
    pub(crate) corner_shares: Vec<f64>,
}

impl<const D: usize> Memory<D> {
    /// Mixes directions until the bound is at most `enough`, or none closes it much further.
    ///
    /// `corner(row, z)` is the support at one of the corners of cells of the given sizes. Where steps downhill find no
    /// direction, a polytope of so many facets looks for one.
    pub(crate) fn mixed(
        &mut self,
        (scale, facets): (f64, usize),
        enough: f64,
        first: &[Wrench<D>],
        sizes: &[usize],
        corner: impl Fn(usize, &Wrench<D>) -> Support<D>,
    ) -> Option<Mixed<D>> {
        let rows: usize = sizes.iter().sum();
        if rows > MOST_CORNERS {
            return None;
        }
        let reaches = |z: &Wrench<D>| -> Vec<f64> { (0..rows).map(|row| corner(row, z).value).collect() };
        let mut directions: Vec<Wrench<D>> = first.to_vec();
        if directions.is_empty() {
            let any = || Wrench::from_fn(|row, _| f64::from(u8::from(row == 0)));
            directions.push(self.recent.last().copied().unwrap_or_else(any));
        }
        let mut mixture = Mixture::new(sizes, reaches(&directions[0]))?;
        for z in &directions[1..] {
            mixture.add(reaches(z));
        }
        let mut bound = mixture.bound();
        while bound > enough && directions.len() < MIXED {
            let shares = mixture.corner_shares();
            let support = |z: &Wrench<D>| {
                let (mut value, mut wrench) = (0.0, Wrench::zeros());
                for (row, &share) in shares.iter().enumerate().filter(|(_, share)| **share > 1e-12) {
                    let one = corner(row, z);
                    value += share * one.value;
                    wrench += one.wrench * share;
                }
                Support { value, wrench }
            };
            let weights = mixture.shares();
            let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]))?;
            let start = directions[heaviest];
            let low = bound - PROGRESS * (bound - enough);
            let mut found = self.least(scale, enough, Some(&start), 0, support);
            if found.upper > low && facets > 0 {
                found = self.least(scale, enough, Some(&found.direction), facets, support);
            }
            if found.upper > low {
                break;
            }
            mixture.add(reaches(&found.direction));
            directions.push(found.direction);
            bound = bound.min(mixture.bound());
        }
        let weights = mixture.shares();
        let used = directions.into_iter().zip(weights).filter(|(_, share)| *share > 0.0).collect();
        Some(Mixed { bound, directions: used, corner_shares: mixture.corner_shares() })
    }
}

impl<const D: usize> ProductBound<D> {
    /// The sizes of cells for [`Memory::mixed`], by the numbers of their corners. The largest of several supports does
    /// not add up: for the union all combinations of corners are those of one cell.
    pub(crate) fn mixed_sizes(&self, corners: &[usize]) -> Vec<usize> {
        match self.criterion {
            Criterion::Max => corners.to_vec(),
            Criterion::Sum => vec![corners.iter().product()],
        }
    }

    /// The support at one of these corners, where `reach(group, corner)` is that of one group.
    pub(crate) fn corner(
        &self,
        row: usize,
        corners: &[usize],
        z: &Wrench<D>,
        mut reach: impl FnMut(usize, usize) -> (f64, Wrench<D>),
    ) -> Support<D> {
        let mut rest = row;
        if self.criterion == Criterion::Sum {
            let parts = corners.iter().enumerate().map(|(group, &count)| {
                let at = rest % count;
                rest /= count;
                reach(group, at)
            });
            return self.joined(parts, z);
        }
        let mut group = 0;
        while group + 1 < corners.len() && rest >= corners[group] {
            rest -= corners[group];
            group += 1;
        }
        let (mut value, mut wrench) = reach(group, rest);
        if let Some(center) = self.center.filter(|_| group == 0) {
            (value, wrench) = (value + center.dot(z), wrench + center);
        }
        Support { value, wrench }
    }

    /// Shares of the corners of one group, from those of [`Mixed`].
    pub(crate) fn shares_of(&self, group: usize, corners: &[usize], shares: &[f64]) -> Vec<f64> {
        let before = &corners[..group];
        if self.criterion == Criterion::Max {
            return shares[before.iter().sum::<usize>()..][..corners[group]].to_vec();
        }
        let mut own = vec![0.0; corners[group]];
        for (row, share) in shares.iter().enumerate() {
            own[row / before.iter().product::<usize>() % corners[group]] += share;
        }
        own
    }

    /// Adds up what groups reach, and the external wrench.
    pub(crate) fn joined(&self, parts: impl Iterator<Item = (f64, Wrench<D>)>, z: &Wrench<D>) -> Support<D> {
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
            let (_, vertex) = group.furthest_corner(self.criterion, cell, z);
            group.support(self.criterion, vertex, z)
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

    /// Facets that are worth looking for a direction to be mixed.
    pub(crate) fn facets(&self) -> usize {
        let pyramids = |group: &super::cells::Group<D>| {
            group.forces.iter().any(|forces| matches!(forces, super::cells::ForceSet::Finite(_)))
        };
        if self.groups.iter().any(pyramids) { FACETS_OF_MIXED } else { 0 }
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

    /// Bounds these products along their own worst directions, in parallel, drops those that come to at most `enough`, and
    /// returns the directions. If `mix` is set, several directions are mixed for each product, which bounds it more
    /// closely.
    ///
    /// Products whose cells have children stay as they are, and so does what is left after `seconds`.
    pub fn ask(&mut self, rows: &[usize], enough: f64, mix: bool, seconds: f64) -> Result<Vec<Wrench<D>>> {
        let (end, scale, interrupt) = (deadline(seconds), self.scale(), interrupt::current());
        let bound = &*self;
        let tasks: Vec<Vec<(usize, f64, Vec<Wrench<D>>)>> = rows
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
                        if slack >= enough
                            || !slack.is_finite()
                            || !product.iter().zip(&bound.groups).all(is_leaf)
                        {
                            continue;
                        }
                        let corners: Vec<&[u32]> = product
                            .iter()
                            .zip(&bound.groups)
                            .map(|(&cell, group)| group.tree.corners_of(cell))
                            .collect();
                        let counts: Vec<usize> = corners.iter().map(|corners| corners.len()).collect();
                        let reach = |z: &Wrench<D>, group: usize, at: usize| {
                            bound.groups[group].support(bound.criterion, corners[group][at], z)
                        };
                        let corner = |row: usize, z: &Wrench<D>| {
                            bound.corner(row, &counts, z, |group, at| reach(z, group, at))
                        };
                        let sizes = bound.mixed_sizes(&counts);
                        let mixed = mix
                            .then(|| {
                                memory.mixed((scale, bound.facets()), enough - slack, &[], &sizes, corner)
                            })
                            .flatten();
                        if let Some(mixed) = mixed {
                            let directions = mixed.directions.into_iter().map(|(z, _)| z).collect();
                            found.push((row, mixed.bound + slack, directions));
                            continue;
                        }
                        let support = |z: &Wrench<D>| bound.support(product, z);
                        let least = memory.least(scale, enough - slack, None, FACETS, support);
                        found.push((row, least.upper + slack, vec![least.direction]));
                    }
                    found
                })
            })
            .collect();
        let mut directions = Vec::new();
        for (row, bound, found) in tasks.into_iter().flatten() {
            self.bounds[row] = self.bounds[row].min(rounded_up(bound));
            directions.extend(found);
        }
        self.drop_below(enough);
        interrupt::check()?;
        Ok(directions)
    }
}
