//! The least friction at which a grasp is force closure, or holds a wrench within its limits.
//!
//! Friction cones grow with the coefficient, so both are monotone in it: a coefficient at which the grasp closes bounds the
//! least one from above, one at which it does not bounds it from below, and bisection narrows the bracket. Each step is a
//! proven answer of its own, by [`classify`] or by the certificate of the forces.

use std::ops::Range;

use rayon::prelude::*;

use crate::convex::expanding_polytope::Polytope;
use crate::error::{Error, Result, digits};
use crate::force::distributor::ForceDistributor;
use crate::grasp::contact::ForceModel;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::quality::closure::{Closure, classify};
use crate::tolerances::AT_LIMIT;
use crate::wrench_set::Criterion;

/// Coefficients below this count as none: a pinch closes at any.
const NO_FRICTION: f64 = 1e-9;

/// What is asked of the friction.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionOptions<const D: usize> {
    /// The wrench that limited forces have to balance; `None` asks for force closure.
    pub external_wrench: Option<Wrench<D>>,
    /// Which normalised normal forces are limited to 1 where a wrench is to be held.
    pub criterion: Criterion,
    /// Relative width of the bracket that is narrow enough.
    pub rtol: f64,
    /// The largest coefficient that is tried.
    pub max_friction: f64,
}

impl<const D: usize> Default for FrictionOptions<D> {
    fn default() -> Self {
        Self { external_wrench: None, criterion: Criterion::Max, rtol: 1e-6, max_friction: 10.0 }
    }
}

impl<const D: usize> FrictionOptions<D> {
    /// Refuses a tolerance outside 1e-12 to 1, a coefficient that is none, and a wrench that is not finite.
    pub fn check(&self) -> Result<()> {
        if !(1e-12..1.0).contains(&self.rtol) {
            let reason = format!("{} must be at least 1e-12 and less than 1", digits(self.rtol));
            return Err(Error::input("rtol", reason));
        }
        if !(self.max_friction > NO_FRICTION && self.max_friction <= 1e6) {
            let reason = format!("{} must lie between 1e-9 and 1e6", digits(self.max_friction));
            return Err(Error::input("max_friction", reason));
        }
        match &self.external_wrench {
            Some(wrench) if wrench.iter().any(|x| !x.is_finite()) => {
                Err(Error::input("external_wrench", format!("{:?} is not finite", wrench.as_slice())))
            }
            _ => Ok(()),
        }
    }
}

/// A bracket of the least friction coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastFriction {
    /// Proven: less friction does not suffice. Zero where none is needed, or none is too little.
    pub lower: f64,
    /// Proven: this friction suffices. Infinite where the largest coefficient that was tried does not.
    pub upper: f64,
}

impl<const D: usize> Grasp<D> {
    /// The least Coulomb coefficient, the same at all contacts, at which the grasp is force closure, or holds a wrench.
    /// Everything else about the contacts stays, also their torsional friction.
    ///
    /// ```
    /// use graspforce::{Contact, FrictionOptions, Grasp};
    /// use nalgebra::Vector3;
    ///
    /// // A pinch whose normals point 0.2 rad off the line between both fingers needs tan(0.2).
    /// let normals = [Vector3::new(0.2_f64.cos(), 0.2_f64.sin(), 0.0), Vector3::new(-0.2_f64.cos(), 0.2_f64.sin(), 0.0)];
    /// let fingers = [(-1.0, normals[0]), (1.0, normals[1])].map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), n));
    /// let least = Grasp::<3>::new(&fingers)?.least_friction(&FrictionOptions::default())?;
    /// assert!(least.lower <= 0.2_f64.tan() && 0.2_f64.tan() <= least.upper && least.upper - least.lower < 1e-6);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    ///
    /// # Errors
    /// A contact has extreme forces of its own instead of a friction cone ([`Error::InvalidGrasp`]); an option is unusable;
    /// whether forces hold the wrench at some coefficient is not decided ([`Error::NotConverged`]).
    pub fn least_friction(&self, options: &FrictionOptions<D>) -> Result<LeastFriction> {
        options.check()?;
        if let Some(at) = self.contacts().iter().position(|one| matches!(one.forces, ForceModel::Extreme(_)))
        {
            return Err(Error::contact(
                "extreme_forces",
                at,
                "given, so there is no friction coefficient to vary",
            ));
        }
        let mut polytope = Polytope::new();
        let mut suffices = |friction: f64| self.suffices(friction, options, &mut polytope);
        if suffices(0.0)? {
            return Ok(LeastFriction { lower: 0.0, upper: 0.0 });
        }
        let (mut lower, mut upper) = (0.0, options.max_friction);
        if !suffices(upper)? {
            return Ok(LeastFriction { lower: upper, upper: f64::INFINITY });
        }
        while upper - lower > options.rtol * upper && upper > NO_FRICTION {
            let middle = 0.5 * (lower + upper);
            if middle <= lower || middle >= upper {
                break;
            }
            if suffices(middle)? {
                upper = middle;
            } else {
                lower = middle;
            }
        }
        Ok(LeastFriction { lower, upper })
    }

    fn suffices(
        &self,
        friction: f64,
        options: &FrictionOptions<D>,
        polytope: &mut Polytope<D>,
    ) -> Result<bool> {
        let mut contacts = self.contacts().to_vec();
        for contact in &mut contacts {
            contact.friction = friction;
            // A grasp keeps what its margin leaves.
            contact.torsion *= self.options().friction_margin;
        }
        let grasp = Self::with_options(&contacts, *self.options())?;
        let Some(wrench) = &options.external_wrench else {
            let closed = classify(&grasp, polytope).closure == Closure::Force;
            return interrupt::check().map(|()| closed);
        };
        interrupt::check()?;
        let distributor = ForceDistributor::new(&grasp, options.criterion)?;
        match distributor.solve(&mut distributor.workspace(), wrench) {
            Ok(forces) => Ok(forces.sigma <= 1.0 + AT_LIMIT),
            Err(error) if error.is_infeasible() => Ok(false),
            Err(error) => Err(error),
        }
    }
}

/// The least frictions of `grasp(row)` for all rows, in order, in parallel. A row that fails does not stop the others.
pub fn least_friction_batch<const D: usize>(
    rows: Range<usize>,
    grasp: impl Fn(usize) -> Result<Grasp<D>> + Sync,
    options: &FrictionOptions<D>,
) -> Vec<Result<LeastFriction>> {
    let interrupt = interrupt::current();
    let one = |row| {
        interrupt::inherit(interrupt.as_ref(), || {
            interrupt::check()?;
            grasp(row)?.least_friction(options)
        })
    };
    rows.into_par_iter().map(one).collect()
}
