//! Products of triangles with one frame each, divided until no grasp in them can be better than is enough.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::grasp::{ContactMap, Wrench};
use crate::interrupt;
use crate::planning::product_bound::cells::{Corner, LEAF, Piece, furthest};
use crate::planning::product_bound::exact::{Memory, Mixed};
use crate::planning::product_bound::{ProductBound, deadline, is_late};
use crate::wrench_set::Criterion;

/// Divisions of one product, one within the other, after which rounding hides what is left.
const DEEPEST: usize = 120;

/// Grasps that are returned: the best of those met.
const OFFERED: usize = 64;

/// How far contacts keep off the edges of triangles, as a part of their size.
const INWARD: f64 = 1e-5;

/// Facets of a grasp's polytope at most.
const FACETS_OF_GRASPS: usize = 20_000;

/// Divisions of a piece before the one with the largest bound is taken up.
const IN_TURN: usize = 16;

/// Pieces that may wait; with more of them, each is divided to the end.
const MOST_WAITING: usize = 60_000;

/// The largest bound comes first.
struct ByBound<const D: usize>(Piece<D>);

impl<const D: usize> Ord for ByBound<D> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.bound.total_cmp(&other.0.bound)
    }
}

impl<const D: usize> PartialOrd for ByBound<D> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const D: usize> PartialEq for ByBound<D> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const D: usize> Eq for ByBound<D> {}

/// Pieces and rows of products that wait.
struct Waiting<const D: usize> {
    pieces: BinaryHeap<ByBound<D>>,
    /// Products, those with the largest bounds last.
    rows: Vec<usize>,
    begun: Vec<usize>,
}

/// What the threads share.
struct Shared<const D: usize> {
    /// The best grasp known.
    best: f64,
    /// Epsilon and places of grasps that are better than what was known when they were met.
    offered: Vec<(f64, Vec<Vector3<f64>>)>,
    /// The largest bound of what was discarded.
    discarded: f64,
}

/// How good a grasp must be to count as better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Epsilon of the best grasp known.
    pub best: f64,
    /// Bounds up to this factor of it are low enough.
    pub factor: f64,
    /// Bounds up to this are low enough in any case.
    pub least: f64,
    /// Whether grasps met on the way count as known. If not, they are only returned.
    pub adopt: bool,
}

impl Goal {
    fn enough(&self, best: f64) -> f64 {
        self.least.max(best + (self.factor - 1.0) * best.abs())
    }
}

impl<const D: usize> ProductBound<D> {
    /// Divides the triangles of all products, those with the largest bounds first, for so many seconds.
    ///
    /// Returns the best grasps met, as epsilon and places of the contacts. Products that are finished are dropped.
    pub fn divide(&mut self, goal: &Goal, seconds: f64) -> Result<Vec<(f64, Vec<Vector3<f64>>)>> {
        let one_contact = |group: &super::cells::Group<D>| {
            group.forces.len() == 1
                && !group.tree.positions.is_empty()
                && group.tree.slacks.iter().all(|&s| s == 0.0)
        };
        if !self.groups.iter().all(one_contact) {
            return Err(Error::input("cells", "not all are triangles with a slack of zero".to_string()));
        }
        let (end, scale, interrupt) = (deadline(seconds), self.scale(), interrupt::current());
        let mut rows: Vec<usize> = (0..self.bounds.len()).collect();
        rows.sort_by(|&a, &b| self.bounds[a].total_cmp(&self.bounds[b]));
        let pieces = std::mem::take(&mut self.pieces).into_iter().map(ByBound).collect();
        let bound = &*self;
        let waiting = Mutex::new(Waiting { pieces, rows, begun: Vec::new() });
        let shared =
            Mutex::new(Shared { best: goal.best, offered: Vec::new(), discarded: f64::NEG_INFINITY });
        let wait = || waiting.lock().unwrap_or_else(PoisonError::into_inner);
        (0..rayon::current_num_threads()).into_par_iter().with_max_len(1).for_each(|_| {
            interrupt::inherit(interrupt.as_ref(), || {
                let mut memory = Memory::new();
                while !is_late(end) && !interrupt::stopped() {
                    let Some((piece, few)) = bound.next_piece(&mut wait()) else { break };
                    let budget = if few { IN_TURN } else { usize::MAX };
                    let open = bound.finish(piece, goal, &shared, (scale, budget), end, &mut memory);
                    wait().pieces.extend(open.into_iter().map(ByBound));
                }
            });
        });
        let shared = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
        let waiting = waiting.into_inner().unwrap_or_else(PoisonError::into_inner);
        for row in waiting.begun {
            self.bounds[row] = f32::NEG_INFINITY;
        }
        self.discarded = self.discarded.max(shared.discarded);
        self.drop_below(f64::from(f32::MIN));
        self.pieces = waiting.pieces.into_iter().map(|piece| piece.0).collect();
        interrupt::check()?;
        Ok(shared.offered)
    }

    /// The piece or product with the largest bound, and whether few others wait.
    fn next_piece(&self, waiting: &mut Waiting<D>) -> Option<(Piece<D>, bool)> {
        let few = waiting.pieces.len() < MOST_WAITING;
        let divisible = |piece: &ByBound<D>| piece.0.depth < DEEPEST;
        loop {
            let piece = waiting.pieces.peek().filter(|piece| divisible(piece)).map(|piece| piece.0.bound);
            let row = waiting.rows.last().copied();
            if row.is_none_or(|row| piece.is_some_and(|bound| bound >= f64::from(self.bounds[row]))) {
                return piece.and_then(|_| waiting.pieces.pop()).map(|piece| (piece.0, few));
            }
            let row = waiting.rows.pop()?;
            if let Some(piece) = self.piece(row) {
                waiting.begun.push(row);
                return Some((piece, few));
            }
        }
    }

    /// The triangles of a product; `None` where cells have children.
    fn piece(&self, row: usize) -> Option<Piece<D>> {
        let triangle = |(&cell, group): (&u32, &super::cells::Group<D>)| -> Option<[Corner<D>; 3]> {
            let corners: [u32; 3] = group.tree.corners_of(cell).try_into().ok()?;
            let at = |vertex: u32| (group.tree.positions[vertex as usize], group.tree.maps[vertex as usize]);
            (group.tree.children[cell as usize] == LEAF).then(|| corners.map(at))
        };
        let triangles = self.product(row).iter().zip(&self.groups).map(triangle).collect::<Option<_>>()?;
        Some(Piece { triangles, depth: 0, bound: f64::from(self.bounds[row]), directions: Vec::new() })
    }

    /// Divides a piece so many times, and returns what is left of it.
    fn finish(
        &self,
        piece: Piece<D>,
        goal: &Goal,
        shared: &Mutex<Shared<D>>,
        (scale, budget): (f64, usize),
        end: Option<Instant>,
        memory: &mut Memory<D>,
    ) -> Vec<Piece<D>> {
        let (mut stack, mut open, mut divisions) = (vec![piece], Vec::new(), 0);
        while let Some(mut piece) = stack.pop() {
            if is_late(end) || interrupt::stopped() || piece.depth == DEEPEST || divisions >= budget {
                open.push(piece);
                continue;
            }
            divisions += 1;
            let mut best = lock(shared).best;
            let enough = goal.enough(best);
            let counts = vec![3; piece.triangles.len()];
            let corner = |row: usize, z: &Wrench<D>| {
                self.corner(row, &counts, z, |group, at| {
                    self.support_of(group, &piece.triangles[group][at].1, z)
                })
            };
            let mixed = memory.mixed(
                (scale, self.facets()),
                enough,
                &piece.directions,
                &self.mixed_sizes(&counts),
                corner,
            );
            let Some(mixed) = mixed else {
                open.push(piece);
                continue;
            };
            let bound = mixed.bound.min(piece.bound);
            piece.bound = bound;
            if bound <= enough {
                let mut shared = lock(shared);
                shared.discarded = shared.discarded.max(bound);
                continue;
            }
            let place = |group: usize| {
                // Off the edges, where neighbours have other normals.
                let inward = |share: &f64| (1.0 - INWARD) * share + INWARD / 3.0;
                let shares = self.shares_of(group, &counts, &mixed.corner_shares);
                let shares: Vec<f64> = shares.iter().map(inward).collect();
                mean(&piece.triangles[group], &shares)
            };
            let there: Vec<Corner<D>> = (0..counts.len()).map(place).collect();
            let support = |z: &Wrench<D>| {
                let parts = there.iter().enumerate();
                self.joined(parts.map(|(group, (_, map))| self.support_of(group, map, z)), z)
            };
            let is_better = |z: &(Wrench<D>, f64)| support(&z.0).value > best;
            if mixed.directions.iter().all(is_better) && self.is_near(&there) {
                let start = mixed.directions.first().map(|(z, _)| *z);
                let found = memory.least(scale, best, start.as_ref(), FACETS_OF_GRASPS, support);
                if found.lower > best {
                    let mut shared = lock(shared);
                    shared.offer(found.lower, &there, goal.adopt);
                    best = shared.best;
                }
            }
            if bound <= goal.enough(best) {
                let mut shared = lock(shared);
                shared.discarded = shared.discarded.max(bound);
                continue;
            }
            let group = self.most_bent(&piece, &mixed);
            piece.directions = mixed.directions.iter().map(|(z, _)| *z).collect();
            for triangle in halves(&piece.triangles[group]) {
                let mut half = piece.clone();
                half.triangles[group] = triangle;
                (half.depth, half.bound) = (piece.depth + 1, bound);
                if self.may_be_near(&half) {
                    stack.push(half);
                }
            }
        }
        open
    }

    fn reach(&self, group: usize, map: &ContactMap<D>, z: &Wrench<D>) -> f64 {
        let reach = self.groups[group].supports[0].value(&map.tr_mul(z));
        if self.criterion == Criterion::Max { reach.max(0.0) } else { reach }
    }

    fn support_of(&self, group: usize, map: &ContactMap<D>, z: &Wrench<D>) -> (f64, Wrench<D>) {
        furthest(self.criterion, std::iter::once((&self.groups[group].supports[0], map)), z)
    }

    /// The group whose support departs most from its interpolation, or else the one with the largest triangle.
    fn most_bent(&self, piece: &Piece<D>, mixed: &Mixed<D>) -> usize {
        let bent = |group: usize| {
            let triangle = &piece.triangles[group];
            let middle = mean(triangle, &[1.0 / 3.0; 3]);
            let departs = |(z, share): &(Wrench<D>, f64)| {
                let corners: f64 = triangle.iter().map(|(_, map)| self.reach(group, map, z)).sum();
                share * (corners / 3.0 - self.reach(group, &middle.1, z))
            };
            // A flat one is divided, too, in the end.
            mixed.directions.iter().map(departs).sum::<f64>() + 1e-3 * longest_edge(triangle).1
        };
        (0..piece.triangles.len()).max_by(|&a, &b| bent(a).total_cmp(&bent(b))).unwrap_or(0)
    }

    /// Whether no two of these contacts are too far apart.
    fn is_near(&self, contacts: &[Corner<D>]) -> bool {
        let apart = |(one, other): (&Corner<D>, &Corner<D>)| (one.0 - other.0).norm() > self.max_distance;
        !contacts.iter().enumerate().any(|(at, one)| contacts[..at].iter().any(|other| apart((one, other))))
    }

    fn may_be_near(&self, piece: &Piece<D>) -> bool {
        if !self.max_distance.is_finite() {
            return true;
        }
        let spheres: Vec<_> = piece
            .triangles
            .iter()
            .map(|triangle| {
                let center = mean(triangle, &[1.0 / 3.0; 3]).0;
                (center, triangle.iter().map(|(p, _)| (p - center).norm()).fold(0.0, f64::max))
            })
            .collect();
        !spheres
            .iter()
            .enumerate()
            .any(|(at, (p, r))| spheres[..at].iter().any(|(q, s)| (p - q).norm() - r - s > self.max_distance))
    }
}

impl<const D: usize> Shared<D> {
    fn offer(&mut self, epsilon: f64, places: &[Corner<D>], adopt: bool) {
        self.offered.push((epsilon, places.iter().map(|(place, _)| *place).collect()));
        self.offered.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.offered.truncate(OFFERED);
        if adopt {
            self.best = self.best.max(epsilon);
        }
    }
}

fn lock<const D: usize>(shared: &Mutex<Shared<D>>) -> std::sync::MutexGuard<'_, Shared<D>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn mean<const D: usize>(triangle: &[Corner<D>; 3], shares: &[f64]) -> Corner<D> {
    let nothing = (Vector3::zeros(), ContactMap::zeros());
    triangle
        .iter()
        .zip(shares)
        .fold(nothing, |sum, (corner, share)| (sum.0 + corner.0 * *share, sum.1 + corner.1 * *share))
}

/// The corner opposite to a triangle's longest edge, and that edge's length.
fn longest_edge<const D: usize>(triangle: &[Corner<D>; 3]) -> (usize, f64) {
    let length = |corner: usize| (triangle[(corner + 1) % 3].0 - triangle[(corner + 2) % 3].0).norm();
    let lengths = [length(0), length(1), length(2)];
    let corner = (0..3).max_by(|&a, &b| lengths[a].total_cmp(&lengths[b])).unwrap_or(0);
    (corner, lengths[corner])
}

fn halves<const D: usize>(triangle: &[Corner<D>; 3]) -> [[Corner<D>; 3]; 2] {
    let (top, _) = longest_edge(triangle);
    let [tip, first, last] = [0, 1, 2].map(|step| triangle[(top + step) % 3]);
    let middle = ((first.0 + last.0) / 2.0, (first.1 + last.1) / 2.0);
    [[tip, first, middle], [tip, middle, last]]
}
