//! One iteration of the pattern search of section 3.4: the best of many candidate grasps.
//!
//! Only the winner has to be known exactly. For *any* unit `z`, `epsilon(c) <= p(z; c)`, and the directions in
//! which one candidate is weakest are nearly the worst of its neighbours: a pool of them rejects most candidates
//! for one oracle call each. The rest are visited in descending order of their upper bounds, which are refined
//! only as far as the order needs. Before a polytope starts, the best direction known is turned downhill towards the
//! bound that rejects (Polyak's subgradient step), which finds what the neighbours' directions narrowly miss; and each
//! polytope stops as soon as its own upper bound falls below the incumbent.
//!
//! **Nothing is rejected that could win.** A candidate goes for good only when it is proven worse than the
//! incumbent by more than the tie tolerance, the width of both brackets and rounding together. One that is no
//! better than a measured candidate that wins ties against it (moving a contact which the worst direction does not
//! load leaves `epsilon` as it is) is put aside, and taken up again should another winner leave it a chance. Where
//! every bracket converges, the winner is therefore the one that measuring all candidates would give, whatever the
//! number of threads; only the counters depend on their timing.
//!
//! **Up to 1% of a tie.** A bracket narrower than [`SHARE_OF_TIE`] times the tie tolerance counts as one number. Candidates
//! whose qualities differ by the tie tolerance, give or take 1% of it, may therefore be told apart otherwise than by
//! measuring all of them.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::quality::answer::Examination;
use crate::quality::query::QualityQuery;
use crate::quality::{QualityOptions, QualityWorkspace};
use crate::tolerances::{ROUNDED_BOUND, TIE, UNCERTAIN_QUALITY};

/// Directions kept from one iteration to the next.
const KEPT_DIRECTIONS: usize = 50;

/// Oracle calls spent on turning a direction until it rejects: a small part of a polytope's.
const CALLS_OF_TURNING: usize = 24;

/// Oracle calls before candidates are first put in order.
const FIRST_DIRECTIONS: usize = 6;

/// What part of a tie the bracket of one number may be wide.
const SHARE_OF_TIE: f64 = 0.01;

/// What an iteration cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SearchCounts {
    /// Candidates offered.
    pub candidates: usize,
    /// Candidates rejected by directions that were critical before, or by turning one of them.
    pub rejected: usize,
    /// Expanding polytopes started.
    pub polytopes: usize,
    /// Polytopes that ran until their bracket closed; the others stopped below the incumbent.
    pub converged: usize,
}

/// The winner of an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winner {
    /// Its number.
    pub index: usize,
    /// Its quality, smaller is better.
    pub rho: f64,
    /// The quality of the centre.
    pub center_rho: f64,
    /// What it cost to find out.
    pub counts: SearchCounts,
}

/// Chooses the best of many candidates, again and again, and remembers where grasps were weak.
///
/// ```
/// use graspforce::{CandidateSearch, Contact, Criterion, Grasp, QualityOptions};
/// use nalgebra::Vector3;
///
/// // Two fingers on a disc: the second may stand at any of three angles.
/// let grasp = |index: usize| {
///     let angles = [0.0, 2.0 + 0.5 * index as f64];
///     Grasp::<3>::new(&angles.map(|angle: f64| {
///         let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
///         Contact::new(outward, -outward)
///     }))
/// };
/// let mut search = CandidateSearch::new(QualityOptions::new(Criterion::Max), true)?;
/// assert_eq!(search.best(3, 0, None, grasp).map_err(|(_, error)| error)?.index, 2);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug)]
pub struct CandidateSearch<const D: usize> {
    options: QualityOptions<D>,
    prune: bool,
    pool: Vec<Critical<D>>,
    workspaces: Vec<QualityWorkspace<D>>,
}

/// A unit direction (in Euclidean coordinates) along which some candidate was weak.
#[derive(Debug, Clone, Copy)]
struct Critical<const D: usize> {
    z: Wrench<D>,
    /// Candidates it rejected, recent ones counting more.
    merit: f64,
}

/// A candidate waiting for its turn: highest bound first, then lowest number.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Waiting {
    bound: f64,
    index: usize,
    /// How many directions its bound accounts for, and which of them gave it.
    looked: usize,
    by: usize,
}

impl Waiting {
    /// Accounts for the next direction of the pool.
    fn tighten(&mut self, value: f64) {
        if value < self.bound {
            (self.bound, self.by) = (value, self.looked);
        }
        self.looked += 1;
    }
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound).then(other.index.cmp(&self.index))
    }
}

/// A candidate whose quality is known, as `epsilon`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Measured {
    index: usize,
    epsilon: f64,
    /// The upper end of its bracket, unless that is too wide to be one number.
    at_most: f64,
}

/// What the threads share.
struct SharedState<const D: usize> {
    center: usize,
    waiting: BinaryHeap<Waiting>,
    /// No better than what wins ties against them.
    aside: Vec<Waiting>,
    /// Whether candidates may still be put aside.
    lenient: bool,
    pool: Vec<Critical<D>>,
    measured: Vec<Measured>,
    incumbent: f64,
    counts: SearchCounts,
}

impl<const D: usize> CandidateSearch<D> {
    /// A search by these options; without `prune` every candidate is measured to the end.
    pub fn new(options: QualityOptions<D>, prune: bool) -> Result<Self> {
        options.check()?;
        Ok(Self { options, prune, pool: Vec::new(), workspaces: Vec::new() })
    }

    /// Works on all cores until no candidate waits.
    fn run(&mut self, state: SharedState<D>, queries: &[QualityQuery<'_, D>]) -> SharedState<D> {
        let (prune, state) = (self.prune, Mutex::new(state));
        let interrupt = interrupt::current();
        self.workspaces.par_iter_mut().for_each(|workspace| {
            interrupt::inherit(interrupt.as_ref(), || work(&state, queries, prune, workspace));
        });
        state.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The best of the candidates `grasp(0) .. grasp(count - 1)`, in parallel.
    ///
    /// Among those within [`TIE`] of the best the candidate `center_index` wins, else the lowest number. `known` is the
    /// centre's `rho` where an earlier iteration measured it. A candidate that is no grasp is an error, with its
    /// number.
    pub fn best(
        &mut self,
        count: usize,
        center_index: usize,
        known: Option<f64>,
        grasp: impl Fn(usize) -> Result<Grasp<D>> + Sync,
    ) -> std::result::Result<Winner, (usize, Error)> {
        if center_index >= count {
            let reason = format!("{center_index} is none of {count} candidates");
            return Err((center_index, Error::input("center_index", reason)));
        }
        let named = |(i, grasp): (usize, Result<_>)| grasp.map_err(|error| (i, error));
        let grasps: Vec<_> = (0..count).into_par_iter().map(|i| (i, grasp(i))).collect();
        let grasps: Vec<_> = grasps.into_iter().map(named).collect::<std::result::Result<_, _>>()?;
        let queries: Vec<_> = grasps
            .par_iter()
            .enumerate()
            .map(|(i, grasp)| QualityQuery::new(grasp, &self.options).map_err(|error| (i, error)))
            .collect();
        let queries: Vec<_> = queries.into_iter().collect::<std::result::Result<_, _>>()?;
        self.workspaces.resize_with(rayon::current_num_threads().min(count), QualityWorkspace::default);

        let mut state = SharedState {
            center: center_index,
            waiting: BinaryHeap::new(),
            aside: Vec::new(),
            lenient: self.prune,
            pool: std::mem::take(&mut self.pool),
            measured: Vec::new(),
            incumbent: f64::NEG_INFINITY,
            counts: SearchCounts { candidates: count, ..SearchCounts::default() },
        };
        let query = &queries[center_index];
        let center_epsilon = if let Some(rho) = known {
            // The direction that was critical for the winner of the last iteration comes first.
            let bounds = state.pool.iter().take(FIRST_DIRECTIONS).map(|critical| query.value(&critical.z));
            let at_most = bounds.fold(f64::INFINITY, f64::min);
            state.note(center_index, -rho, at_most, None)
        } else {
            state.counts.polytopes += 1;
            let examination = query.examine(f64::NEG_INFINITY, &mut self.workspaces[0]);
            state.record(center_index, &examination)
        };
        if self.prune {
            let look = |index| first_bound(index, &queries[index], &state.pool);
            let waiting: Vec<_> = (0..count)
                .into_par_iter()
                .with_min_len(16)
                .filter(|i| *i != center_index)
                .map(look)
                .collect();
            state.waiting = waiting.into();
        } else {
            let blind = |index| Waiting { bound: f64::INFINITY, index, looked: usize::MAX, by: 0 };
            state.waiting = (0..count).filter(|i| *i != center_index).map(blind).collect();
        }
        let mut state = self.run(state, &queries);
        interrupt::check().map_err(|error| (center_index, error))?;
        let (mut index, mut epsilon) = state.winner();
        let mut again = std::mem::take(&mut state.aside);
        again.retain(|other| {
            index != center_index
                && other.index < index
                && other.bound >= state.threshold(&queries[other.index])
        });
        if !again.is_empty() {
            state.lenient = false;
            state.waiting = again.into();
            state = self.run(state, &queries);
            interrupt::check().map_err(|error| (center_index, error))?;
            (index, epsilon) = state.winner();
        }
        state.pool.sort_by(|a, b| b.merit.total_cmp(&a.merit));
        state.pool.truncate(KEPT_DIRECTIONS);
        for critical in &mut state.pool {
            critical.merit *= 0.5;
        }
        self.pool = state.pool;
        Ok(Winner { index, rho: 0.0 - epsilon, center_rho: 0.0 - center_epsilon, counts: state.counts })
    }
}

impl<const D: usize> SharedState<D> {
    /// The centre where it is as good as the best, else the first of those that are.
    fn winner(&self) -> (usize, f64) {
        let least = self.incumbent - TIE * self.incumbent.abs();
        let good = self.measured.iter().filter(|other| other.epsilon >= least);
        let first = good.min_by_key(|other| (other.index != self.center, other.index));
        first.map_or((self.center, self.incumbent), |winner| (winner.index, winner.epsilon))
    }

    /// The best that wins ties against this candidate: reaching no further, it need not be known exactly.
    fn ceiling(&self, index: usize, query: &QualityQuery<'_, D>) -> f64 {
        let wins_ties = |other: &&Measured| other.index == self.center || other.index < index;
        self.measured.iter().filter(wins_ties).map(|other| other.at_most).fold(f64::NEG_INFINITY, f64::max)
            + ROUNDED_BOUND * query.scale
    }

    fn record(&mut self, index: usize, examination: &Examination<D>) -> f64 {
        match *examination {
            Examination::Below { upper, direction } => {
                self.pool.push(Critical { z: direction, merit: 1.0 });
                upper
            }
            Examination::Answer { lower, upper, direction, converged } => {
                self.counts.converged += usize::from(converged);
                self.note(index, lower, upper, Some(direction))
            }
        }
    }

    fn note(&mut self, index: usize, epsilon: f64, upper: f64, direction: Option<Wrench<D>>) -> f64 {
        let narrow = upper <= epsilon + SHARE_OF_TIE * TIE * epsilon.abs();
        self.measured.push(Measured { index, epsilon, at_most: if narrow { upper } else { epsilon } });
        self.incumbent = self.incumbent.max(epsilon);
        // What the best are weak against rejects the rest: such directions come first.
        self.pool.extend(direction.map(|z| Critical { z, merit: 2.0 }));
        epsilon
    }

    /// What a candidate must be able to reach; below, it is worse than the incumbent by more than a tie.
    fn threshold(&self, query: &QualityQuery<'_, D>) -> f64 {
        let uncertain = TIE + 2.0 * query.rtol();
        self.incumbent - uncertain * self.incumbent.abs() - UNCERTAIN_QUALITY * query.scale
    }
}

fn first_bound<const D: usize>(index: usize, query: &QualityQuery<'_, D>, pool: &[Critical<D>]) -> Waiting {
    let mut waiting = Waiting { bound: f64::INFINITY, index, looked: 0, by: 0 };
    for critical in pool.iter().take(FIRST_DIRECTIONS) {
        waiting.tighten(query.value(&critical.z));
    }
    waiting
}

/// Turns `z` downhill until `p(z) < enough`, as if `enough` were the minimum.
fn turned<const D: usize>(
    query: &QualityQuery<'_, D>,
    mut z: Wrench<D>,
    enough: f64,
) -> Option<(f64, Wrench<D>)> {
    for _ in 0..CALLS_OF_TURNING {
        let support = query.support(&z);
        if support.value < enough {
            return Some((support.value, z));
        }
        // A little beyond, so that the bound is passed and not only approached.
        z = support.downhill(&z, enough - 1e-3 * enough.abs())?;
    }
    None
}

/// What a thread does until no candidate waits.
fn work<const D: usize>(
    state: &Mutex<SharedState<D>>,
    queries: &[QualityQuery<'_, D>],
    prune: bool,
    workspace: &mut QualityWorkspace<D>,
) {
    let lock = || state.lock().unwrap_or_else(PoisonError::into_inner);
    let mut unseen = Vec::new();
    loop {
        if interrupt::stopped() {
            return;
        }
        let mut shared = lock();
        let Some(mut next) = shared.waiting.pop() else { return };
        let query = &queries[next.index];
        let threshold = if prune { shared.threshold(query) } else { f64::NEG_INFINITY };
        let enough =
            if shared.lenient { threshold.max(shared.ceiling(next.index, query)) } else { threshold };
        if next.bound < enough {
            shared.counts.rejected += 1;
            // Entries are only ever appended, so the number still names the direction.
            shared.pool[next.by].merit += 1.0;
            if next.bound >= threshold {
                shared.aside.push(next);
            }
            continue;
        }
        if prune && next.looked < shared.pool.len() {
            let rival = shared.waiting.peek().map_or(f64::NEG_INFINITY, |other| other.bound);
            unseen.clear();
            unseen.extend(shared.pool[next.looked..].iter().map(|critical| critical.z));
            drop(shared);
            for z in &unseen {
                next.tighten(query.value(z));
                if next.bound < enough || next.bound < rival {
                    break;
                }
            }
            lock().waiting.push(next);
            continue;
        }
        let start = shared.pool.get(next.by).filter(|_| prune).map(|critical| critical.z);
        drop(shared);
        if let Some((bound, z)) = start.and_then(|z| turned(query, z, enough)) {
            let mut shared = lock();
            shared.counts.rejected += 1;
            shared.pool.push(Critical { z, merit: 1.0 });
            if bound >= threshold {
                shared.aside.push(Waiting { bound, ..next });
            }
            continue;
        }
        lock().counts.polytopes += 1;
        let examination = query.examine(enough, workspace);
        let mut shared = lock();
        let reached = shared.record(next.index, &examination);
        if matches!(examination, Examination::Below { .. }) && reached >= threshold {
            shared.aside.push(Waiting { bound: reached, ..next });
        }
    }
}
