//! The least squares of a grasp: answers with their certificate.

use std::sync::{Arc, OnceLock};

use nalgebra::SMatrix;

use crate::error::{Error, Result, Unmet};
use crate::force::certificate::{Certificate, ContactForces, imbalance, residual};
use crate::force::equilibration::units;
use crate::force::preload::program::checked_bounds;
use crate::force::share_program::ShareProgram;
use crate::force::solution::{DistributionOptions, check_wrench};
use crate::force::squares::dual::{Dual, DualPoint};
use crate::force::squares::newton::minimise;
use crate::force::squares::options::{SquaresOptions, checked};
use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, REPRESENTABLE, Wrench};
use crate::linalg::real::{Real, values};
use crate::tolerances::{
    FEASIBILITY_TOLERANCE, ILL_CONDITIONED, LOOSEST_GAP, ROUNDED_BALANCE, ROUNDED_TERMS,
};

const SOLVER: &str = "least squares";

/// What forces by a price may leave where others balance the wrench.
const BALANCED_BY_PRICE: f64 = 1e-3 * FEASIBILITY_TOLERANCE;

/// The least squares of a grasp; it does not change while solving.
#[derive(Debug, Clone)]
pub(crate) struct SquaresProgram<const D: usize> {
    pub(super) grasp: Arc<Grasp<D>>,
    pub(crate) dual: Dual<D>,
    pub(super) slack: Option<Slack<D>>,
    pub(super) units: Wrench<D>,
    /// Lower bounds of the shares; none where empty.
    pub(super) least: Vec<f64>,
    /// The largest reference, in `units`: what the contacts may press with where no wrench acts.
    pressed: f64,
    pub(super) limits: bool,
    rtol: f64,
    /// `phi(0)`: without references and lower bounds zero.
    value_at_zero: f64,
    /// Tells whether forces within the cones balance a wrench, and if not why.
    pub(super) feasibility: OnceLock<ShareProgram<D>>,
}

/// Why there are no forces yet.
pub(crate) struct Unsolved {
    pub(crate) error: Error,
    /// Whether forces may yet balance the wrench within the tolerance.
    pub(super) open: bool,
}

/// How often a target is moved by what the forces leave over.
const MAX_REFINEMENTS: usize = 3;

/// The price of what stays unbalanced.
#[derive(Debug, Clone)]
pub(super) struct Slack<const D: usize> {
    price: Metric<D>,
    /// `S^-1`.
    inverse: SMatrix<f64, D, D>,
    /// `T C^-1`.
    pub(super) columns: SMatrix<f64, D, D>,
}

/// The multiplier of the last wrench.
#[derive(Debug, Clone)]
pub(crate) struct SquaresWorkspace<const D: usize> {
    pub(crate) y: Wrench<D>,
}

impl<const D: usize> SquaresWorkspace<D> {
    pub(crate) fn new() -> Self {
        Self { y: Wrench::zeros() }
    }

    pub(crate) fn forget(&mut self) {
        self.y = Wrench::zeros();
    }
}

impl<const D: usize> SquaresProgram<D> {
    pub(crate) fn new(grasp: &Arc<Grasp<D>>, options: &SquaresOptions<D>) -> Result<Self> {
        let (weights, reference) = checked(grasp, options)?;
        let bounds =
            DistributionOptions { min_normal: options.min_normal.clone(), ..DistributionOptions::default() };
        let least = checked_bounds(grasp, &bounds)?.unwrap_or_default();
        let mut dual = Dual::new(grasp, &weights, &reference, options.slack.as_ref());
        let high = if options.limits { 1.0 } else { f64::INFINITY };
        for i in 0..grasp.num_contacts() {
            dual.bound(i, least.get(i).copied().unwrap_or(0.0), high);
        }
        let slack = options.slack.map(|price| {
            let columns: Vec<_> = price.inverse_columns().collect();
            let inverse = columns.iter().fold(SMatrix::zeros(), |sum, c| sum + c * c.transpose());
            let columns = dual.whitening.map * SMatrix::from_columns(&columns);
            Slack { price, inverse, columns }
        });
        let units = units(grasp);
        let pressed = dual.contacts.iter().map(|contact| contact.reference.norm() * units[0]);
        let pressed =
            pressed.fold(0.0, |most: f64, one| most.max(if options.limits { one.min(1.0) } else { one }));
        let mut program = Self {
            grasp: Arc::clone(grasp),
            dual,
            slack,
            units,
            least,
            pressed,
            limits: options.limits,
            rtol: options.rtol,
            value_at_zero: 0.0,
            feasibility: OnceLock::new(),
        };
        let mut rest = ContactForces::new(grasp.num_contacts());
        let zero = Wrench::zeros();
        program.value_at_zero = program.dual.at(&zero, &zero, &mut rest.forces, &mut rest.shares).value;
        Ok(program)
    }

    /// Starts from the last multiplier of another program.
    pub(crate) fn adopt(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        other: &Self,
        last: &SquaresWorkspace<D>,
    ) {
        workspace.y = self.dual.of_physical(&other.dual.physical(&last.y), &self.grasp);
    }

    /// Leaves the forces for `b = -w_ext` in `forces`.
    pub(crate) fn solve(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let answer = match self.solve_in_doubles(workspace, b, forces) {
            // The wrench is at the limits, or nothing is known of it.
            Err(Unsolved { error, open: true }) if self.slack.is_none() => {
                self.solve_by_price(b, FEASIBILITY_TOLERANCE, forces).ok_or(error)?
            }
            Err(Unsolved { error, .. }) => return Err(error),
            // On the edge of what forces balance multipliers grow, and with them what rounding of the balance is worth.
            Ok(found) if found.gap > self.rtol && self.slack.is_none() => {
                self.or_by_price(found, (found.gap, FEASIBILITY_TOLERANCE), b, forces)
            }
            Ok(found) => return Ok(found),
        };
        let allowed = LOOSEST_GAP.max(self.rtol);
        if answer.gap > allowed {
            let unmet = Unmet::Gap { found: answer.gap, allowed };
            return Err(Error::NotConverged { solver: SOLVER, iterations: answer.pivots, unmet });
        }
        Ok(answer)
    }

    /// The same without a price of the residual, which leaves some of the wrench.
    pub(crate) fn solve_in_doubles(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> std::result::Result<Certificate<D>, Unsolved> {
        match self.solve_once(workspace, b, forces) {
            Ok(answer) => Ok(answer),
            Err(error @ Error::NotConverged { .. }) => {
                let answer = self.solve_again(workspace, b, forces, error)?;
                Ok(self.steep_by_price(answer, b, forces))
            }
            Err(error) => Err(Unsolved { error, open: false }),
        }
    }

    /// The same by Newton's method alone.
    pub(crate) fn solve_once(
        &self,
        workspace: &mut SquaresWorkspace<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Result<Certificate<D>> {
        let size = b.amax();
        if !(size == 0.0 || REPRESENTABLE.contains(&size)) {
            check_wrench(&-b)?;
            let reason =
                format!("its largest component, {size:e}, lies outside 1e-140 to 1e140; check the units");
            return Err(Error::input("external_wrench", reason));
        }
        check_wrench(&-b)?;
        let target = self.target(b);
        let ContactForces { forces: f, shares, unique, .. } = forces;
        *unique = true;
        let mut start = self.dual.at(&workspace.y, &target, f, shares);
        if start.value > self.value_at_zero || start.value.is_nan() {
            start = self.dual.at(&Wrench::zeros(), &target, f, shares);
        }
        let (point, steps) = minimise(&self.dual, &target, start, f, shares);
        let answer = match self.certify(b, &point, steps, forces) {
            Err(error) if self.slack.is_none() && worth_refining(&error, &point) => {
                self.refine(b, &target, point, steps, forces, error)
            }
            Err(_) if self.slack.is_some() => self.solve_in_32_digits(b, &target, &point, steps, forces),
            answer => answer,
        };
        workspace.y = answer.as_ref().map_or_else(|_| Wrench::zeros(), |(_, y)| *y);
        answer.map(|(answer, _)| self.steep_by_price(answer, b, forces))
    }

    /// Another answer where multipliers are so large beside the forces that rounding of the wrench would decide between
    /// them, and so would the wrenches before it.
    #[inline]
    fn steep_by_price(
        &self,
        answer: Certificate<D>,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Certificate<D> {
        let price = answer.dual.component_div(&self.units).norm() * b.component_mul(&self.units).norm();
        if self.slack.is_some() || price <= ILL_CONDITIONED * self.objective(forces).1 {
            return answer;
        }
        self.or_by_price(answer, (self.rtol.max(answer.gap), BALANCED_BY_PRICE), b, forces)
    }

    /// The answer by a price of the residual where its gap and what it leaves are at most these, or else the one found.
    #[cold]
    fn or_by_price(
        &self,
        found: Certificate<D>,
        (gap, left): (f64, f64),
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Certificate<D> {
        let kept = forces.clone();
        let priced = self.solve_by_price(b, left, forces).filter(|priced| priced.gap <= gap);
        priced.unwrap_or_else(|| {
            *forces = kept;
            found
        })
    }

    /// `T b`; without slack only what the contacts can reach of it.
    pub(super) fn target(&self, b: &Wrench<D>) -> Wrench<D> {
        if self.slack.is_some() { self.dual.whitening.map * b } else { self.dual.whitening.wrench(b) }
    }

    /// Moves the target by what the forces leave over: the coordinates of the dual are rounded where contacts are weak.
    #[cold]
    fn refine(
        &self,
        b: &Wrench<D>,
        target: &Wrench<D>,
        mut point: DualPoint<D>,
        mut steps: usize,
        forces: &mut ContactForces,
        mut error: Error,
    ) -> Result<(Certificate<D>, Wrench<D>)> {
        let mut moved = *target;
        for _ in 0..MAX_REFINEMENTS {
            moved -= self.target(&self.residual(b, forces));
            let ContactForces { forces: f, shares, .. } = forces;
            let start = self.dual.at(&point.y, &moved, f, shares);
            let (next, more) = minimise(&self.dual, &moved, start, f, shares);
            (point, steps) = (next, steps + more);
            match self.certify(b, &point, steps, forces) {
                Ok(answer) => return Ok(answer),
                Err(again) => error = again,
            }
        }
        Err(error)
    }

    /// What forces leave of `b`.
    fn residual(&self, b: &Wrench<D>, forces: &ContactForces) -> Wrench<D> {
        residual(b, self.grasp.maps().iter().zip(forces.forces.iter().copied()))
    }

    /// What the forces of a point are worth.
    #[inline]
    pub(crate) fn certify<R: Real>(
        &self,
        b: &Wrench<D>,
        point: &DualPoint<D, R>,
        steps: usize,
        forces: &ContactForces,
    ) -> Result<(Certificate<D>, Wrench<D>)> {
        let (y, gradient) = (values(&point.y), values(&point.gradient));
        let dual = self.dual.physical(&y);
        let (mut sigma, mut size) = self.objective(forces);
        let (gap, missing, allowed);
        if let Some(slack) = &self.slack {
            let rest = self.residual(b, forces);
            let cost = 0.5 * slack.price.norm(&rest).powi(2);
            (sigma, size) = (sigma + cost, size + cost);
            // The forces are those of the multiplier: what the residual is away from its own is the whole error.
            let left = rest + slack.inverse * dual;
            gap = 0.5 * slack.price.norm(&left).powi(2);
            allowed = self.rtol;
            missing =
                self.unpriced(b, &rest, &left, forces).max(R::ROUNDING * self.dual.rounding(&y, forces));
        } else {
            // Beside large multipliers, on the edge of what can be balanced, rounding of the balance is a gap.
            let rounding = ROUNDED_BALANCE * y.norm() * point.size / size;
            gap = y.dot(&gradient).abs();
            allowed = self.rtol.max(rounding.min(LOOSEST_GAP));
            missing = self.missing(b, forces);
        }
        let gap = if gap == 0.0 { 0.0 } else { gap / size };
        let unmet = if missing > FEASIBILITY_TOLERANCE || missing.is_nan() {
            Unmet::Balance { found: missing, allowed: FEASIBILITY_TOLERANCE }
        } else if gap > allowed || gap.is_nan() {
            Unmet::Gap { found: gap, allowed }
        } else {
            let certificate = Certificate { sigma, dual, gap, pivots: steps, fell_back: false };
            return Ok((certificate, y));
        };
        Err(Error::NotConverged { solver: SOLVER, iterations: steps, unmet })
    }

    /// The objective of the forces, and the size of its terms.
    #[inline]
    pub(crate) fn objective(&self, forces: &ContactForces) -> (f64, f64) {
        let contacts = self.dual.contacts.iter().zip(&forces.forces);
        contacts.fold((0.0, 0.0), |(sigma, size), (contact, force)| {
            let half = 0.5 * contact.weight;
            (
                sigma + half * (force - contact.reference).norm_squared(),
                size + half * (force.norm_squared() + contact.reference.norm_squared()),
            )
        })
    }

    /// What the forces leave unbalanced, as a share of the wrench or, if they are larger, of the references.
    #[inline]
    pub(crate) fn missing(&self, b: &Wrench<D>, forces: &ContactForces) -> f64 {
        let held = self.least.iter().copied().fold(0.0, f64::max);
        let contacts = self.grasp.maps().iter().zip(forces.forces.iter().copied());
        let wanting = imbalance(b, &self.units, held, contacts);
        // Beside references a small wrench counts as little.
        if wanting > FEASIBILITY_TOLERANCE && self.pressed > 0.0 {
            let left = self.residual(b, forces).component_mul(&self.units).lp_norm(1);
            wanting.min(left / self.pressed)
        } else {
            wanting
        }
    }

    /// What lies between the residual of the forces and that of the multiplier, as a share of the wrench.
    fn unpriced(&self, b: &Wrench<D>, rest: &Wrench<D>, left: &Wrench<D>, forces: &ContactForces) -> f64 {
        let [b, rest, left] = [b, rest, left].map(|wrench| wrench.component_mul(&self.units).lp_norm(1));
        let pressing: f64 = forces.forces.iter().map(ContactForce::norm).sum::<f64>() * self.units[0];
        let left = (left - ROUNDED_TERMS * pressing).max(0.0);
        if left > 0.0 { left / (b + rest) } else { 0.0 }
    }
}

/// Whether Newton's method ended, and forces miss the balance by little: what rounding may have done.
fn worth_refining<const D: usize>(error: &Error, point: &DualPoint<D>) -> bool {
    point.gradient.norm() <= FEASIBILITY_TOLERANCE * point.size
        && matches!(error, Error::NotConverged { unmet: Unmet::Balance { found, .. }, .. } if *found < 1e-4)
}
