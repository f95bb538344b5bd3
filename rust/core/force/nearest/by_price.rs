//! The nearest forces in 32 digits, by a high price of the residual: where grasps are degenerate but for noise.
//!
//! Let `f` minimise `w objective(f) + |sum_i G_i f_i - b|_M^2 / 2` for some `w > 0`. No forces of a smaller objective
//! leave as little of `b`. With falling `w` the residual tends to the least one, and its multiplier proves how near it is.
//! The first `w` at which nothing comes nearer by more than a tolerance ends the search: both claims hold there. The least
//! forces of the nearest wrench itself have multipliers without bound; these have none.
//!
//! Least squares are minimised at once, and so are shares of [finitely many extreme forces](super::vertices). Shares of true
//! cones need proximal steps, because they are linear in the forces. Their least maximum is the cap of all shares at which
//! a larger cap costs as much as it saves.

use crate::force::certificate::{Certificate, ContactForces};
use crate::force::nearest::answer::Found;
use crate::force::nearest::limited_sum::{FIRST_STEP, is_linear_in_forces};
use crate::force::nearest::vertices::{ShareCost, Vector, Vertices};
use crate::force::nearest::wrench_projection::WrenchProjection;
use crate::force::problem::Problem;
use crate::force::program::Program;
use crate::force::squares::dual::{Dual, ForceSet};
use crate::force::squares::newton::minimise;
use crate::force::squares::projection::Force;
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;
use crate::linalg::real::{dot, values};
use crate::tolerances::{CLOSE_GAP, NEAREST_DISTANCE};
use crate::wrench_set::Criterion;

/// Weights of the objective beside the residual: the first, the factor between two, and their number.
const HEAVIEST: f64 = 1e-3;
const LIGHTER: f64 = 30.0;
const MAX_WEIGHTS: usize = 22;

/// Weights after which the gap may grow: the lightest leave few digits.
const MAX_STALLED: usize = 6;

/// The length of the first proximal step in shares where steps only choose among equal forces, what all steps grow by, and
/// how many there are at most.
const FREE_STEP: f64 = 100.0;
const STEP_GROWTH: f64 = 20.0;
const MAX_STEPS_OF_WEIGHT: usize = 16;

/// Newton's steps of one wrench: a hundred are usual.
const MAX_STEPS_OF_SEARCH: usize = 2000;

/// The weight of the objective, the largest share, and the gap of the objective at which no further step is worth it.
pub(super) struct Trial {
    pub(super) weight: f64,
    pub(super) cap: f64,
    pub(super) enough: f64,
}

/// What is minimised beside the residual.
pub(crate) enum Cost {
    /// Half the squares of forces less their references, with weights relative to the heaviest.
    Squares { weights: Vec<f64>, heaviest: f64, reference: Vec<ContactForce> },
    /// The sum of shares times a factor, and the largest share if it counts.
    Shares { of_sum: f64, max: bool },
}

/// Forces at one weight, with what their multiplier proves.
pub(crate) struct Point<const D: usize> {
    pub(super) y: Vector<D>,
    /// The multiplier that proves the excess.
    pub(crate) proof: Vector<D>,
    pub(crate) forces: ContactForces,
    /// The same forces in 32 digits.
    pub(super) exact: Vec<Force<DoubleDouble>>,
    /// What the objective may be above the least, times the weight, and the objective times the weight.
    pub(crate) excess: f64,
    pub(super) cost: f64,
    /// The excess over forces up to the same cap.
    pub(super) capped: f64,
    pub(super) distance: f64,
    pub(super) lower: f64,
}

impl<const D: usize> Point<D> {
    /// The relative gap of the objective, or that of the distance relative to the wrench; at most 1.
    fn gap(&self, size: f64) -> f64 {
        let relative = |excess: f64, of: f64| if excess <= 0.0 { 0.0 } else { (excess / of).min(1.0) };
        relative(self.distance - self.lower, size).max(relative(self.excess, self.cost))
    }
}

pub(crate) struct Pricing<'a, const D: usize> {
    pub(super) grasp: &'a Grasp<D>,
    pub(super) projection: &'a WrenchProjection<D>,
    pub(crate) dual: Dual<D>,
    pub(super) cost: Cost,
    pub(super) b: &'a Wrench<D>,
    pub(super) target: Wrench<D>,
    pub(super) size: f64,
    /// Bounds of the shares, and the largest upper bound or infinity.
    pub(super) bounds: Vec<(f64, f64)>,
    pub(super) linear: bool,
    pub(crate) steps: usize,
    /// Of contacts without true cones, if shares are minimised.
    pub(super) vertices: Option<Vertices<D>>,
    /// What forces have to keep, where that ends the search instead of the distance.
    enough: Option<&'a dyn Fn(&ContactForces) -> bool>,
}

impl<const D: usize> Problem<D> {
    /// Leaves forces that come nearest up to a tolerance, and the least of those. The gap is the larger one of the distance,
    /// relative to the wrench, and of the objective: at most 1.
    #[cold]
    pub(crate) fn nearest_by_price(
        &self,
        projection: &WrenchProjection<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Option<Found<D>> {
        let mut pricing = Pricing::new(&self.grasp, projection, self.cost(), b, None);
        let (point, weight) = pricing.search()?;
        let gap = point.gap(pricing.size);
        let unit = if let Cost::Squares { heaviest, .. } = pricing.cost { heaviest } else { 1.0 };
        let multiplier = pricing.dual.physical(&values(&point.proof)) * (unit / weight);
        *forces = point.forces;
        forces.unique = matches!(pricing.cost, Cost::Squares { .. });
        let answer = Certificate {
            sigma: self.value(forces),
            dual: multiplier,
            gap,
            pivots: pricing.steps,
            fell_back: true,
        };
        Some(Found { answer, distance: point.distance, steep: false })
    }

    fn cost(&self) -> Cost {
        match &self.program {
            Program::Shares(criterion, _) => {
                let max = *criterion == Criterion::Max;
                Cost::Shares { of_sum: if max { self.options.weight } else { 1.0 }, max }
            }
            Program::Squares(_, program) => Cost::of_squares(&program.dual),
        }
    }
}

impl Cost {
    pub(crate) fn of_squares<const D: usize>(dual: &Dual<D>) -> Self {
        let heaviest = dual.heaviest();
        Self::Squares {
            weights: dual.contacts.iter().map(|contact| contact.weight / heaviest).collect(),
            heaviest,
            reference: dual.contacts.iter().map(|contact| contact.reference).collect(),
        }
    }
}

impl<'a, const D: usize> Pricing<'a, D> {
    pub(crate) fn new(
        grasp: &'a Grasp<D>,
        projection: &'a WrenchProjection<D>,
        cost: Cost,
        b: &'a Wrench<D>,
        enough: Option<&'a dyn Fn(&ContactForces) -> bool>,
    ) -> Self {
        let sets: Vec<_> = projection.dual.contacts.iter().map(|contact| contact.set.clone()).collect();
        let dual = Dual::unrounded(grasp, sets, &projection.metric);
        let bounds = dual.contacts.iter().map(|contact| {
            let (low, high) = contact.bounds();
            (low / contact.unit, high / contact.unit)
        });
        let bounds: Vec<_> = bounds.collect();
        let target = dual.whitening.map * b;
        let vertices = match cost {
            Cost::Squares { .. } => None,
            Cost::Shares { .. } => Vertices::new(&dual, &bounds, &target),
        };
        Self {
            grasp,
            projection,
            cost,
            b,
            target,
            size: projection.metric.norm(b),
            bounds,
            linear: is_linear_in_forces(grasp),
            steps: 0,
            vertices,
            enough,
            dual,
        }
    }
}

impl<const D: usize> Pricing<'_, D> {
    /// The first weight at which the forces are near enough; else the one of the smallest gap.
    pub(crate) fn search(&mut self) -> Option<(Point<D>, f64)> {
        let limit = |i: usize| self.grasp.contacts()[i].max_normal_force;
        let strongest = |i: usize| self.projection.maps[i].norm() * limit(i);
        let strongest = (0..self.dual.contacts.len()).map(strongest).fold(0.0, f64::max);
        let of_shares = strongest * if self.size > 0.0 { self.size } else { strongest };
        let mut weight = HEAVIEST
            * match self.cost {
                Cost::Squares { .. } => self.projection.strength,
                Cost::Shares { of_sum, max } => of_shares / of_sum.max(f64::from(u8::from(max))),
            };
        let (mut best, mut stalled) = (None::<(Point<D>, f64)>, 0);
        let mut start = vec![Vector::repeat(DoubleDouble::ZERO)];
        let mut last = ContactForces::new(self.dual.contacts.len());
        let mut lower = 0.0_f64;
        for _ in 0..MAX_WEIGHTS {
            let mut point =
                self.at(&Trial { weight, cap: f64::INFINITY, enough: CLOSE_GAP }, &start, &last)?;
            if self.enough.is_none()
                && self.size - point.lower <= NEAREST_DISTANCE * self.size
                && self.may_rest()
            {
                return Some((self.without_forces(point), weight));
            }
            if point.distance - point.lower <= NEAREST_DISTANCE * self.size {
                point = self.lower_cap(weight, point);
            }
            // A bound over all forces within the limits holds at every weight.
            if self.bounds.iter().all(|(_, high)| high.is_finite()) {
                lower = lower.max(point.lower);
                point.lower = lower.min(point.distance);
            }
            // While no contact changes its face, the multiplier is a linear function of the weight.
            let y = point.y;
            let ahead = start.first().map(|before| y + (y - before).map(|x| x.times(1.0 / LIGHTER)));
            start = ahead.into_iter().chain([y]).collect();
            last.clone_from(&point.forces);
            let near_enough = match self.enough {
                Some(enough) => enough(&point.forces),
                None => point.distance - point.lower <= NEAREST_DISTANCE * self.size,
            };
            if near_enough && self.enough.is_some() {
                return Some((point, weight));
            }
            let better = best.as_ref().is_none_or(|(best, _)| point.gap(self.size) < best.gap(self.size));
            let nearer = best.as_ref().is_some_and(|(best, _)| point.distance < 0.5 * best.distance);
            stalled = if better || nearer { 0 } else { stalled + 1 };
            if better || nearer {
                best = Some((point, weight));
            }
            if near_enough || stalled >= MAX_STALLED || self.has_to_end() {
                break;
            }
            weight /= LIGHTER;
        }
        best
    }

    pub(super) fn has_to_end(&self) -> bool {
        self.steps >= MAX_STEPS_OF_SEARCH || interrupt::stopped()
    }

    /// Whether no forces cost nothing.
    fn may_rest(&self) -> bool {
        let wanted = match &self.cost {
            Cost::Squares { reference, .. } => reference.iter().any(|force| force.amax() > 0.0),
            Cost::Shares { .. } => false,
        };
        !wanted && self.bounds.iter().all(|(low, _)| *low == 0.0)
    }

    fn without_forces(&self, mut point: Point<D>) -> Point<D> {
        point.forces.clear();
        Point { excess: 0.0, cost: 0.0, distance: self.size, ..point }
    }

    /// The least cost of shares up to `cap`.
    pub(super) fn at(
        &mut self,
        trial: &Trial,
        starts: &[Vector<D>],
        from: &ContactForces,
    ) -> Option<Point<D>> {
        let Trial { weight, cap, enough } = *trial;
        if let (Some(vertices), Cost::Shares { of_sum, max }) = (&mut self.vertices, &self.cost) {
            let cost = ShareCost { weight, of_sum: *of_sum, max: *max };
            let (y, steps) = vertices.minimise(cost, self.projection.strongest(0.0, self.size));
            let (exact, forces) = vertices.forces(&self.dual);
            self.steps += steps;
            return Some(self.proven(weight, y, exact, forces));
        }
        for (contact, (low, high)) in self.dual.contacts.iter_mut().zip(&self.bounds) {
            let high = high.min(cap.max(f64::MIN_POSITIVE)) * contact.unit;
            match &mut contact.set {
                ForceSet::Cone(cone) => (cone.low, cone.high) = (low * contact.unit, high),
                ForceSet::Finite(polytope) => (polytope.low, polytope.high) = (*low, high),
                ForceSet::Zero => {}
            }
        }
        let mut forces = from.clone();
        // Without a cost of their sum proximal steps only choose among equal forces.
        let free = matches!(self.cost, Cost::Shares { of_sum: 0.0, .. });
        let (mut y, mut length) = (*starts.first()?, if free { FREE_STEP } else { FIRST_STEP });
        let mut best: Option<Point<D>> = None;
        for step in 0..MAX_STEPS_OF_WEIGHT {
            self.weigh(weight, length, &forces.forces);
            let ContactForces { forces: f, shares, .. } = &mut forces;
            let candidates = if step == 0 { starts } else { std::slice::from_ref(&y) };
            let mut start = self.dual.at(&candidates[0], &self.target, f, shares);
            for other in &candidates[1..] {
                let found = self.dual.at(other, &self.target, f, shares);
                start = if found.value < start.value { found } else { start };
            }
            let (found, more) = minimise(&self.dual, &self.target, start, f, shares);
            (y, self.steps) = (found.y, self.steps + more);
            let mut point = self.point(weight, y, &forces);
            if let Cost::Squares { weights, reference, .. } = &self.cost {
                let contacts = forces.forces.iter().zip(weights.iter().zip(reference));
                point.cost = contacts.map(|(f, (w, r))| 0.5 * weight * w * (f - r).norm_squared()).sum();
                point.excess += dot(&y, &found.gradient).value().abs();
                return Some(point);
            }
            let known = best.as_ref().map_or(f64::INFINITY, |best| best.capped);
            let (excess, cost) = (point.capped, point.cost);
            if excess < known {
                best = Some(point);
            }
            if excess <= enough * cost || !self.linear || self.has_to_end() {
                break;
            }
            length *= STEP_GROWTH;
        }
        best
    }

    /// Weights and references of the next proximal step.
    fn weigh(&mut self, weight: f64, length: f64, last: &[ContactForce]) {
        for (i, contact) in self.dual.contacts.iter_mut().enumerate() {
            match &self.cost {
                Cost::Squares { weights, reference, .. } => {
                    (contact.weight, contact.reference) = (weight * weights[i], reference[i]);
                }
                Cost::Shares { of_sum, .. } => {
                    let limit = self.grasp.contacts()[i].max_normal_force;
                    contact.weight = weight / (length * limit * limit);
                    contact.reference = last[i];
                    if self.linear {
                        contact.reference[0] -= length * limit * of_sum;
                    }
                }
            }
        }
    }
}
