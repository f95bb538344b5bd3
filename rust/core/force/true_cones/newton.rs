//! Newton's method on the optimality conditions: quadratic where the statuses of the contacts are right, and a change
//! of statuses where its point shows that they are not.

use nalgebra::SVector;

use crate::force::true_cones::choice::Choice;
use crate::force::true_cones::contact_status::{ContactStatus, friction, load};
use crate::force::true_cones::optimal_point::{ConeConditions, Missing, OptimalPoint};
use crate::force::true_cones::optimality_system::OptimalitySystem;
use crate::force::true_cones::segment::Segment;
use crate::force::true_cones::tie_break::TieBreak;

/// Steps with one set of statuses: from a near point it takes one to three.
const MAX_STATUS_STEPS: usize = 12;

/// Sets of statuses from a point nearby, and from one of column generation.
pub(crate) const FEW_CHANGES: usize = 3;
pub(crate) const MANY_CHANGES: usize = 12;

/// An old factor is used again as long as each step with it reduces what is missing by this much.
const CHORD: f64 = 0.02;

/// Rounding, in units of what it explains at a point.
const STALLED: f64 = 1e3;

/// Violations of cones and prices below this, relative to the level or the multiplier, are rounding.
const VIOLATED_CONDITION: f64 = 1e-11;

/// Wrenches of size one that differ by more are a jump.
const JUMP: f64 = 0.1;

/// Forces beyond this belong to statuses that are not the answer's: the wrench has size one.
const FAR: f64 = 1e6;

/// Multipliers below this, relative to all of them, are zero.
const VANISHED: f64 = 2e-12;

/// Where the steps ended.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Steps {
    Converged,
    /// The statuses are contradictory; forces that move along a null vector get better.
    Improvable,
    Failed,
}

/// The memory of the method.
#[derive(Debug, Clone)]
pub(crate) struct NewtonWorkspace<const D: usize> {
    pub(crate) point: OptimalPoint<D>,
    /// Whether point and system are those of an answer.
    pub(crate) known: bool,
    system: OptimalitySystem<D>,
    factorised: bool,
    along: Vec<f64>,
    tie_break: TieBreak<D>,
    /// The wrench of unit size of the last answer.
    last: SVector<f64, D>,
    /// Steps of the current solve.
    steps: usize,
}

impl<const D: usize> NewtonWorkspace<D> {
    pub(crate) fn new(contacts: usize) -> Self {
        Self {
            point: OptimalPoint::new(contacts),
            known: false,
            system: OptimalitySystem::new(contacts),
            factorised: false,
            along: Vec::with_capacity(4 * contacts + 1),
            tie_break: TieBreak::new(contacts),
            last: SVector::zeros(),
            steps: 0,
        }
    }

    /// Takes a point that is none of this method.
    pub(crate) fn restart(&mut self) {
        self.factorised = false;
        self.known = false;
    }

    /// Whether the point is that of a wrench nearby: from farther away column generation is the shorter way.
    pub(crate) fn is_near(&self, target: &SVector<f64, D>) -> bool {
        self.known && (target - self.last).amax() <= JUMP
    }

    /// Solves for a wrench of unit size from the point in the workspace. `None` where it does not converge with at most
    /// `changes` sets of statuses.
    pub(crate) fn solve(
        &mut self,
        conditions: &ConeConditions<D>,
        target: &SVector<f64, D>,
        changes: usize,
    ) -> Option<Choice> {
        self.last = *target;
        self.reach(conditions, Some(target), changes)
    }

    /// From a multiplier of about unit size: one whose forces exert it. Its direction is a local minimum of the support
    /// on the sphere. `None` where the search does not converge, or other multipliers beside it are as good.
    pub(crate) fn local_minimum(
        &mut self,
        conditions: &ConeConditions<D>,
        changes: usize,
    ) -> Option<SVector<f64, D>> {
        self.reach(conditions, None, changes)?;
        self.system.is_determined().then_some(self.point.z)
    }

    /// Without a target, the forces must exert the multiplier itself.
    fn reach(
        &mut self,
        conditions: &ConeConditions<D>,
        target: Option<&SVector<f64, D>>,
        changes: usize,
    ) -> Option<Choice> {
        self.steps = 0;
        self.known = false;
        for _ in 0..changes {
            match self.converge(conditions, target) {
                // Contacts that seem to slide at a multiplier of zero stick.
                Steps::Failed if widen(conditions, &mut self.point) => {}
                Steps::Failed => return None,
                Steps::Improvable => {
                    if !self.improve(conditions) {
                        return None;
                    }
                }
                Steps::Converged => {
                    if widen(conditions, &mut self.point) {
                        conditions.linearise(&self.point, &mut self.system);
                        self.system.factorise(target.is_none());
                    }
                    let choice = match target {
                        Some(target) if self.system.free_directions() > 0 => {
                            self.tie_break.choose(conditions, &mut self.point, target, &self.system)
                        }
                        _ => Choice::Unique,
                    };
                    if !change_statuses(conditions, &mut self.point) {
                        self.known = choice != Choice::Open;
                        return Some(choice);
                    }
                }
            }
            self.factorised = false;
        }
        None
    }

    fn converge(&mut self, conditions: &ConeConditions<D>, target: Option<&SVector<f64, D>>) -> Steps {
        let steps = self.converge_from_here(conditions, target);
        if self.point.contacts.iter().all(|contact| contact.x.amax() <= FAR) {
            return steps;
        }
        // Nearly dependent columns of earlier statuses made forces whose rounding hides the balance.
        self.point.contacts.iter_mut().for_each(|contact| contact.x.fill(0.0));
        self.converge_from_here(conditions, target)
    }

    fn converge_from_here(
        &mut self,
        conditions: &ConeConditions<D>,
        target: Option<&SVector<f64, D>>,
    ) -> Steps {
        let Self { point, system, factorised, .. } = self;
        let mut before = f64::INFINITY;
        for _ in 0..MAX_STATUS_STEPS {
            let exerted = target.copied().unwrap_or(point.z);
            let Missing { balance, error } = conditions.evaluate(point, &exerted, &mut system.missing);
            if error <= 1.0 {
                if !*factorised {
                    conditions.linearise(point, system);
                    system.factorise(target.is_none());
                    *factorised = true;
                }
                return Steps::Converged;
            }
            if !error.is_finite() || point.z.amax() > FAR * FAR {
                return Steps::Failed;
            }
            let reduced = error / before;
            if *factorised && reduced > 0.5 && before.is_finite() && error <= STALLED {
                return Steps::Converged;
            }
            if !*factorised || (reduced > CHORD && before.is_finite()) {
                if *factorised && reduced > 0.5 && self.steps > 2 && system.contradictory() {
                    return Steps::Improvable;
                }
                conditions.linearise(point, system);
                system.factorise(target.is_none());
                *factorised = true;
            }
            let dz = system.solve(&balance);
            point.z += dz;
            point.advance(&system.unknowns, system.step(), 1.0);
            before = error;
            self.steps += 1;
        }
        Steps::Failed
    }

    /// Moves along the null vector whose condition contradicts the others, until a contact stops.
    fn improve(&mut self, conditions: &ConeConditions<D>) -> bool {
        let Self { point, system, along, .. } = self;
        let Some((which, contradiction)) = system.contradiction() else { return false };
        system.null_vector(which, along);
        let segment = Segment::of(point, conditions.bounded, &system.unknowns, along);
        let end = if contradiction > 0.0 { segment.low } else { segment.high };
        let Some((contact, status)) = end.stop.filter(|_| end.at.is_finite()) else { return false };
        point.advance(&system.unknowns, along, end.at);
        let x = point.force(contact);
        set_status(point, contact, status, x, 0.5 * contradiction.abs());
        true
    }
}

/// Gives contacts whose multiplier vanishes the status that their multiplier allows, so that the statuses describe all
/// optimal forces. True if one changed.
fn widen<const D: usize>(conditions: &ConeConditions<D>, point: &mut OptimalPoint<D>) -> bool {
    let price = conditions.price;
    let zero = VANISHED * (1.0 + point.z.lp_norm(1));
    let mut widened = false;
    for (contact, cone) in conditions.cones.iter().enumerate() {
        let at = point.contacts[contact];
        let (turned, excess) = (load(&at.v), at.v[0] + load(&at.v) - price);
        let straight = cone.dim > 1 && turned <= zero;
        let status = match at.status {
            ContactStatus::Idle | ContactStatus::FullSliding | ContactStatus::FullSticking
                if excess.abs() <= zero =>
            {
                if straight {
                    ContactStatus::Sticking
                } else {
                    ContactStatus::Sliding
                }
            }
            ContactStatus::FullSliding if straight => ContactStatus::FullSticking,
            ContactStatus::Sliding if straight => ContactStatus::Sticking,
            _ => continue,
        };
        let x = point.force(contact);
        let at = &mut point.contacts[contact];
        (at.status, at.x) = (status, x);
        widened = true;
    }
    widened
}

/// Gives contacts that violate their status the one that they ask for; false if none does.
fn change_statuses<const D: usize>(conditions: &ConeConditions<D>, point: &mut OptimalPoint<D>) -> bool {
    let ConeConditions { price, bounded, .. } = *conditions;
    let shares =
        |point: &OptimalPoint<D>| (0..point.contacts.len()).map(|i| point.force(i)[0]).fold(0.0, f64::max);
    let level = if bounded { point.level } else { shares(point) };
    let (small, flat) = (VIOLATED_CONDITION * level, VIOLATED_CONDITION * (1.0 + point.z.lp_norm(1)));
    let units = point.z.amax() / level.max(f64::MIN_POSITIVE);
    let mut changed = false;
    for (contact, cone) in conditions.cones.iter().enumerate() {
        let at = point.contacts[contact];
        let x = point.force(contact);
        let (reach, beyond) = (at.v[0] + load(&at.v), load(&x) - x[0]);
        let above = bounded && x[0] > level + small;
        let (status, x, slope) = match at.status {
            ContactStatus::Idle if reach > price + flat => {
                let sliding = cone.dim == 1 || load(&at.v) > flat;
                let status = if sliding { ContactStatus::Sliding } else { ContactStatus::Sticking };
                (status, x, 0.0)
            }
            ContactStatus::Sliding if x[0] < -small => (ContactStatus::Idle, x, 0.0),
            ContactStatus::Sliding if above => (ContactStatus::FullSliding, x, 0.0),
            ContactStatus::Sticking if x[0] < -load(&x) - small => (ContactStatus::Idle, x, 0.0),
            ContactStatus::Sticking if beyond > small => {
                let share = f64::midpoint(x[0], load(&x));
                let full = bounded && share > level;
                let status = if full { ContactStatus::FullSliding } else { ContactStatus::Sliding };
                let mut y = friction(&x);
                y[0] = share;
                (status, y, 0.5 * beyond * units)
            }
            ContactStatus::Sticking if above => (ContactStatus::FullSticking, x, 0.0),
            ContactStatus::FullSliding if reach < price - flat => (ContactStatus::Sliding, x, 0.0),
            ContactStatus::FullSticking if at.v[0] < price - flat => (ContactStatus::Sticking, x, 0.0),
            ContactStatus::FullSticking if beyond > small => {
                (ContactStatus::FullSliding, x, 0.5 * beyond * units)
            }
            _ => continue,
        };
        set_status(point, contact, status, x, slope);
        changed = true;
    }
    changed
}

/// Gives a contact a status; `slope` is the guess for one that begins to slide out of sticking, zero otherwise.
fn set_status<const D: usize>(
    point: &mut OptimalPoint<D>,
    contact: usize,
    status: ContactStatus,
    x: nalgebra::Vector4<f64>,
    slope: f64,
) {
    let at = &mut point.contacts[contact];
    at.status = status;
    at.x = x;
    if slope > 0.0 && matches!(status, ContactStatus::Sliding | ContactStatus::FullSliding) {
        let load = load(&x);
        if load > 0.0 {
            at.direction = friction(&x) / load;
            at.slope = slope;
            at.guessed = true;
        }
    }
}

impl<const D: usize> OptimalitySystem<D> {
    /// Whether only conditions of dependent columns miss something.
    fn contradictory(&self) -> bool {
        self.contradiction().is_some_and(|(_, most)| {
            let independent = self.order[..self.rank].iter().map(|&j| self.missing[j].abs());
            independent.fold(0.0, f64::max) <= 1e-3 * most.abs()
        })
    }

    /// The dependent column whose condition misses most, and how much.
    fn contradiction(&self) -> Option<(usize, f64)> {
        let dependent = self.order[self.rank..].iter().map(|&j| self.missing[j]).enumerate();
        dependent.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).filter(|(_, most)| *most != 0.0)
    }
}
