//! The paper's own two phases (section 4): the points of the wrench set offline, then `z_b` and the points
//! on its hyperplane online.
//!
//! Clarabel solves Eq. 26 to about eight digits; for more than [`MAX_INTERIOR`] points the simplex method does. That is
//! enough to tell which points lie on the supporting hyperplane. The simplex restricted to these finishes with a basic
//! solution. Every other point is then checked against the multipliers, so the answer is exact over the whole set.

use clarabel::solver::SupportedConeT;
use nalgebra::SVector;

use crate::error::Result;
use crate::force::equilibration::Equilibration;
use crate::force::interior_point::ConicProgram;
use crate::force::simplex::pricing::{Column, Objective, Pricing, UNUSED, tied_cost, tied_gain};
use crate::force::simplex::primal::{Outcome, RightHandSide, Simplex};
use crate::grasp::Grasp;
use crate::interrupt;
use crate::tolerances::{NEAR_HYPERPLANE, OPTIMAL_COST, UNBALANCED_WRENCH};
use crate::wrench_set::minkowski_sum::MinkowskiSum;

/// Points that the interior-point solver is given: beyond, one of its iterations takes longer than the simplex method
/// does altogether, and cannot be interrupted.
const MAX_INTERIOR: usize = 20_000;

/// Accuracy of the interior-point solver, which only tells the points near the hyperplane from the others.
const INTERIOR_RTOL: f64 = 1e-8;

/// Points priced before asking whether to stop: some ten microseconds.
const POINTS_BETWEEN_CHECKS: usize = 1 << 12;

/// Rounds of adding the points that the multipliers violate; after the last, all points take part.
const MAX_ROUNDS: usize = 20;

/// Points that complete the reduced set along one direction.
const MAX_COMPLETION: usize = 100;

/// Every point of the wrench set, in equilibrated coordinates, with the edges that make it.
#[derive(Debug, Clone)]
pub(crate) struct Enumeration<const D: usize> {
    points: Vec<Column<D>>,
    starts: Vec<u32>,
    /// Contact and edge, the latter counted over all contacts (matrix B of section 4.2).
    entries: Vec<(u32, u32)>,
    objective: Objective,
}

impl<const D: usize> Enumeration<D> {
    pub(crate) fn new(
        grasp: &Grasp<D>,
        objective: Objective,
        equilibration: &Equilibration<D>,
        limit: u128,
    ) -> Result<Self> {
        let (points, starts, entries) = match objective {
            Objective::Sum => union(grasp, equilibration)?,
            _ => minkowski(grasp, objective, equilibration, limit)?,
        };
        Ok(Self { points, starts, entries, objective })
    }

    /// Solves to optimality over all points. `active` is the caller's buffer for those that take part.
    pub(crate) fn solve(
        &self,
        simplex: &mut Simplex<D>,
        target: &RightHandSide<D>,
        active: &mut Vec<u32>,
    ) -> Outcome<D> {
        self.select(simplex, target, active);
        let mut pivots = 0;
        for _ in 0..MAX_ROUNDS {
            let outcome = simplex.cold(&Restricted { all: self, active }, target);
            pivots += simplex.pivots;
            simplex.pivots = pivots;
            if outcome != Outcome::Optimal {
                break;
            }
            if !self.add_violated(&simplex.multipliers, active) {
                return outcome;
            }
        }
        active.clear();
        active.extend(0..self.points.len() as u32);
        let outcome = simplex.cold(&Restricted { all: self, active }, target);
        simplex.pivots += pivots;
        outcome
    }

    /// The points that some targets need, completed until every direction can be balanced (section 4.2).
    pub(crate) fn reduce(
        &self,
        simplex: &mut Simplex<D>,
        targets: &[RightHandSide<D>],
        rank: usize,
    ) -> Result<Vec<u32>> {
        let (mut kept, mut active) = (Vec::new(), Vec::new());
        for target in targets {
            interrupt::check()?;
            self.select(simplex, target, &mut active);
            if active.len() < self.points.len() {
                kept.append(&mut active);
            }
        }
        kept.sort_unstable();
        kept.dedup();
        // Directions that positively span the wrench space: with these, nothing is out of reach.
        for k in 0..=rank {
            let mut wrench = SVector::<f64, D>::zeros();
            match k {
                k if k < rank => wrench[k] = 1.0,
                _ => wrench.rows_range_mut(..rank).fill(-1.0),
            }
            let target = RightHandSide { wrench, rank, tolerance: SVector::repeat(UNBALANCED_WRENCH) };
            for _ in 0..MAX_COMPLETION {
                let separating = if kept.is_empty() {
                    wrench
                } else {
                    let restricted = Restricted { all: self, active: &kept };
                    let Outcome::Infeasible(z) = simplex.cold(&restricted, &target) else { break };
                    z
                };
                let reach = |j: &u32| self.points[*j as usize].wrench.dot(&separating);
                let furthest = (0..self.points.len() as u32).max_by(|a, b| reach(a).total_cmp(&reach(b)));
                match furthest.filter(|j| reach(j) > 0.0 && !kept.contains(j)) {
                    Some(furthest) => kept.push(furthest),
                    // The grasp itself is not force-closure along this direction.
                    None => break,
                }
            }
        }
        interrupt::check().map(|()| kept)
    }

    /// Solves over some of the points; whether the others could do better is for the caller to ask.
    pub(crate) fn solve_reduced(
        &self,
        simplex: &mut Simplex<D>,
        target: &RightHandSide<D>,
        kept: &[u32],
    ) -> Outcome<D> {
        simplex.cold(&Restricted { all: self, active: kept }, target)
    }

    /// The points on the hyperplane of Eq. 26; all of them where there is none, for the simplex to
    /// tell an infeasible wrench from a hard one.
    fn select(&self, simplex: &mut Simplex<D>, target: &RightHandSide<D>, active: &mut Vec<u32>) {
        active.clear();
        if let Some(z) = self.furthest_dual(simplex, target, active) {
            active.clear();
            let near = (0_u32..).zip(&self.points);
            active.extend(
                near.filter(|(_, p)| p.wrench.dot(&z) >= p.costs[0] * (1.0 - NEAR_HYPERPLANE))
                    .map(|(j, _)| j),
            );
        }
        if active.is_empty() {
            active.extend(0..self.points.len() as u32);
        }
    }

    /// `z_b` of Eq. 26. `all` is a buffer.
    fn furthest_dual(
        &self,
        simplex: &mut Simplex<D>,
        target: &RightHandSide<D>,
        all: &mut Vec<u32>,
    ) -> Option<SVector<f64, D>> {
        if self.points.len() > MAX_INTERIOR {
            all.extend(0..self.points.len() as u32);
            let outcome = simplex.cold(&Restricted { all: self, active: all }, target);
            return (outcome == Outcome::Optimal).then_some(simplex.multipliers[0]);
        }
        let mut program = ConicProgram::default();
        for k in 0..target.rank {
            program.cost.push(-target.wrench[k]);
            for (j, point) in self.points.iter().enumerate() {
                program.constraints.push(j, k, point.wrench[k]);
            }
        }
        program.bounds = self.points.iter().map(|point| point.costs[0]).collect();
        program.cones = vec![SupportedConeT::NonnegativeConeT(self.points.len())];
        let z = program.solve(INTERIOR_RTOL, 100).filter(|solution| solution.solved)?.x;
        Some(SVector::from_fn(|row, _| z.get(row).copied().unwrap_or(0.0)))
    }

    /// Adds the points whose reduced cost is wrong in either level; `false` if there are none.
    fn add_violated(&self, z: &[SVector<f64, D>; 2], active: &mut Vec<u32>) -> bool {
        let before = active.len();
        let tolerance = tied_cost(&z[0]);
        let second = tied_gain(&z[1]);
        active.extend((0_u32..).zip(&self.points).filter_map(|(j, point)| {
            let gain = point.wrench.dot(&z[0]) - point.costs[0];
            let tied = self.objective == Objective::MaxThenSum && gain >= -tolerance;
            let wrong = gain > tolerance || (tied && point.wrench.dot(&z[1]) - point.costs[1] > second);
            wrong.then_some(j)
        }));
        // A point that takes part already is only wrong by rounding, and must not be added for ever.
        let (old, new) = active.split_at_mut(before);
        old.sort_unstable();
        let fresh: Vec<u32> = new.iter().copied().filter(|j| old.binary_search(j).is_err()).collect();
        active.truncate(before);
        active.extend(fresh);
        active.len() > before
    }

    fn write_edges(&self, point: usize, edges: &mut [u32]) {
        edges.fill(UNUSED);
        let range = self.starts[point] as usize..self.starts[point + 1] as usize;
        for &(contact, edge) in &self.entries[range] {
            edges[contact as usize] = edge;
        }
    }
}

/// The simplex's view of the points that take part.
struct Restricted<'a, const D: usize> {
    all: &'a Enumeration<D>,
    active: &'a [u32],
}

impl<const D: usize> Restricted<'_, D> {
    fn best(&self, value: impl Fn(&Column<D>) -> f64, edges: &mut [u32]) -> Column<D> {
        let mut winner = (f64::NEG_INFINITY, self.active.first().copied().unwrap_or(0));
        for chunk in self.active.chunks(POINTS_BETWEEN_CHECKS) {
            for &j in chunk {
                let value = value(&self.all.points[j as usize]);
                if value > winner.0 {
                    winner = (value, j);
                }
            }
            if interrupt::stopped() {
                break;
            }
        }
        self.all.write_edges(winner.1 as usize, edges);
        self.all.points[winner.1 as usize]
    }
}

impl<const D: usize> Pricing<D> for Restricted<'_, D> {
    fn optimality(&self) -> f64 {
        OPTIMAL_COST * self.all.objective.unit()
    }

    fn furthest(&self, z: &SVector<f64, D>, discount: f64, edges: &mut [u32]) -> Column<D> {
        self.best(|point| point.wrench.dot(z) - discount * point.costs[0], edges)
    }

    fn tie_break(&self, z: &[SVector<f64, D>; 2], tolerance: f64, edges: &mut [u32]) -> Option<Column<D>> {
        if self.all.objective != Objective::MaxThenSum {
            return None;
        }
        let gain = |point: &Column<D>| {
            if point.wrench.dot(&z[0]) < point.costs[0] - tolerance {
                return f64::NEG_INFINITY;
            }
            point.wrench.dot(&z[1]) - point.costs[1]
        };
        Some(self.best(gain, edges))
    }
}

type Points<const D: usize> = (Vec<Column<D>>, Vec<u32>, Vec<(u32, u32)>);

fn union<const D: usize>(grasp: &Grasp<D>, equilibration: &Equilibration<D>) -> Result<Points<D>> {
    let wrenches = grasp.primitive_wrenches()?;
    let costs = Objective::Sum.costs(1);
    let points = wrenches
        .iter()
        .map(|w| Column { wrench: equilibration.wrench(w), costs, direction: SVector::zeros() })
        .collect();
    let ranges = (0..grasp.num_contacts()).filter_map(|i| Some((i, grasp.edges(i)?)));
    let entries = ranges.flat_map(|(i, range)| range.map(move |edge| (i as u32, edge as u32))).collect();
    Ok((points, (0..=wrenches.len() as u32).collect(), entries))
}

fn minkowski<const D: usize>(
    grasp: &Grasp<D>,
    objective: Objective,
    equilibration: &Equilibration<D>,
    limit: u128,
) -> Result<Points<D>> {
    let sum = MinkowskiSum::with_limit(grasp, limit)?;
    let firsts: Vec<u32> =
        (0..grasp.num_contacts()).map(|i| grasp.edges(i).map_or(0, |range| range.start as u32)).collect();
    let points = (0..sum.len()).map(|j| Column {
        wrench: equilibration.wrench(&sum.wrenches()[j]),
        costs: objective.costs((sum.ends()[j] - sum.starts()[j]) as usize),
        direction: SVector::zeros(),
    });
    let starts = sum.starts().iter().chain(sum.ends().last()).copied().collect();
    let entries = sum.contacts().iter().zip(sum.edges()).map(|(&i, &h)| (i, firsts[i as usize] + h));
    Ok((points.collect(), starts, entries.collect()))
}
