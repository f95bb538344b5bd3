//! How a distributor computes forces.

use std::ptr;

use graspforce_core as core;
use graspforce_core::{Criterion, Error, ForceDistributor, Grasp, Metric, NearestOptions, contact_force};
use nalgebra::SMatrix;

use crate::fault::{Fault, Outcome};
use crate::memory::{self, SizedStruct, optional};

/// What a distributor minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Objective {
    /// The largest normalised normal force and, among its optima, their sum.
    Max = 0,
    /// The sum of the normalised normal forces.
    Sum = 1,
    /// `sum_i weights_i |f_i - reference_i|^2 / 2`: the forces change continuously with the wrench.
    Squares = 2,
}

/// How a distributor computes forces. Initialise it by `gf_distributor_options_init`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct DistributorOptions {
    /// Bytes of this struct; `gf_distributor_options_init` sets it.
    size: usize,
    /// A `gf_objective`.
    objective: i32,
    /// Kibibytes that the distributor takes from the system when it is created, beside what its grasp needs: its calls
    /// use them instead of the system's memory.
    reserve: u32,
    /// With `GF_OBJECTIVE_MAX`: minimise the maximum plus `weight` times the sum; at most 1e6.
    weight: f64,
    /// Largest relative gap between the objective and its proven lower bound. True cones take the longer the smaller it
    /// is; 1e-6 is enough for control.
    rtol: f64,
    /// m lower bounds on the normalised normal forces, so that no finger loses contact. NULL: none.
    min_normal: *const f64,
    /// With `GF_OBJECTIVE_SQUARES`: m positive weights. NULL: 1.
    weights: *const f64,
    /// With `GF_OBJECTIVE_SQUARES`: m x k forces to stay close to, in the contact frames. NULL: zero.
    reference: *const f64,
    /// With `GF_OBJECTIVE_SQUARES`: the price S of what stays unbalanced, d x d, symmetric positive definite:
    /// `residual' S residual / 2` is added, and every wrench has an answer. NULL: the forces balance the wrench.
    slack: *const f64,
    /// With `GF_OBJECTIVE_SQUARES`: 1 where normal forces keep their upper bounds, else 0.
    limits: i32,
    /// Of `gf_distributor_nearest`: 1 where normal forces keep their upper bounds, else 0.
    nearest_limits: i32,
    /// Of `gf_distributor_nearest`: d x d, symmetric positive definite, the norm of what stays unbalanced. NULL: that of
    /// the grasp's length scale.
    nearest_metric: *const f64,
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers and a raw pointer.
unsafe impl SizedStruct for DistributorOptions {
    const NAME: &'static str = "options";
}

impl Default for DistributorOptions {
    fn default() -> Self {
        let core::DistributionOptions { weight, rtol, .. } = core::DistributionOptions::default();
        Self {
            size: size_of::<Self>(),
            objective: Objective::Max as i32,
            reserve: 1024,
            weight,
            rtol,
            min_normal: ptr::null(),
            weights: ptr::null(),
            reference: ptr::null(),
            slack: ptr::null(),
            limits: 0,
            nearest_limits: 1,
            nearest_metric: ptr::null(),
        }
    }
}

/// Writes the defaults: the maximum, a gap of 1e-9, no lower bounds; nearest within the limits. `size` is
/// `sizeof(gf_distributor_options)`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_distributor_options_init(options: *mut DistributorOptions, size: usize) {
    // SAFETY: the header's rules.
    unsafe { memory::initialise(options, size) };
}

impl DistributorOptions {
    /// Bytes that the calls may need beside what the grasp does.
    pub(crate) fn reserve(&self) -> usize {
        self.reserve as usize * 1024
    }

    /// The distributor of a grasp.
    ///
    /// # Safety
    ///
    /// The pointers keep the header's rules.
    pub(crate) unsafe fn distributor<const D: usize>(
        &self,
        grasp: &Grasp<D>,
    ) -> Outcome<ForceDistributor<D>> {
        let objective = match self.objective {
            n if n == Objective::Max as i32 => Criterion::Max,
            n if n == Objective::Sum as i32 => Criterion::Sum,
            n if n == Objective::Squares as i32 => {
                // SAFETY: the caller's promise.
                return Ok(ForceDistributor::squares(grasp, unsafe { self.squares(grasp) }?)?);
            }
            n => return Err(Fault::Number("objective", n.into(), "is no gf_objective")),
        };
        let squares = [("weights", self.weights), ("reference", self.reference), ("slack", self.slack)];
        if let Some((argument, _)) = squares.iter().find(|(_, pointer)| !pointer.is_null()) {
            return Err(Fault::Argument(argument, "only with GF_OBJECTIVE_SQUARES"));
        }
        if self.limits != 0 {
            return Err(Fault::Argument("limits", "only with GF_OBJECTIVE_SQUARES"));
        }
        let mut options = core::DistributionOptions::default();
        options.weight = self.weight;
        options.rtol = self.rtol;
        // SAFETY: the caller's promise.
        options.min_normal = unsafe { numbers("min_normal", self.min_normal, grasp.num_contacts()) }?;
        Ok(ForceDistributor::with_options(grasp, objective, options)?)
    }

    /// # Safety
    ///
    /// The pointers keep the header's rules.
    unsafe fn squares<const D: usize>(&self, grasp: &Grasp<D>) -> Outcome<core::SquaresOptions<D>> {
        if self.weight != 0.0 {
            return Err(Fault::Argument("weight", "only with GF_OBJECTIVE_MAX"));
        }
        let (contacts, components) = (grasp.num_contacts(), grasp.force_components());
        // SAFETY: the caller's promise.
        let (weights, min_normal, reference, slack) = unsafe {
            (
                numbers("weights", self.weights, contacts)?,
                numbers("min_normal", self.min_normal, contacts)?,
                numbers("reference", self.reference, contacts * components.len())?,
                metric("slack", self.slack)?,
            )
        };
        let reference = reference.chunks_exact(components.len()).map(|row| contact_force(row, components));
        Ok(core::SquaresOptions {
            reference: reference.collect(),
            weights,
            slack,
            limits: self.limits != 0,
            min_normal,
            rtol: self.rtol,
        })
    }

    /// What `gf_distributor_nearest` asks.
    ///
    /// # Safety
    ///
    /// The pointers keep the header's rules.
    pub(crate) unsafe fn nearest<const D: usize>(&self) -> Outcome<NearestOptions<D>> {
        // SAFETY: the caller's promise.
        let metric = unsafe { metric("nearest_metric", self.nearest_metric) }?;
        Ok(NearestOptions { metric, limits: self.nearest_limits != 0 })
    }
}

/// A copy of an array; empty for NULL.
///
/// # Safety
///
/// `array` is NULL or points at `length` numbers.
unsafe fn numbers(argument: &'static str, array: *const f64, length: usize) -> Outcome<Vec<f64>> {
    // SAFETY: the caller's promise.
    Ok(unsafe { optional(argument, array, length) }?.map_or_else(Vec::new, <[f64]>::to_vec))
}

/// The metric of a d x d matrix, or `None` for NULL.
///
/// # Safety
///
/// `matrix` is NULL or points at d x d numbers.
pub(crate) unsafe fn metric<const D: usize>(
    argument: &'static str,
    matrix: *const f64,
) -> Outcome<Option<Metric<D>>> {
    // SAFETY: the caller's promise.
    let Some(rows) = (unsafe { optional(argument, matrix, D * D) })? else { return Ok(None) };
    match Metric::from_matrix(&SMatrix::<f64, D, D>::from_row_slice(rows)) {
        Ok(metric) => Ok(Some(metric)),
        Err(Error::InvalidInput { row, reason, .. }) => {
            Err(Error::InvalidInput { argument, row, reason }.into())
        }
        Err(error) => Err(error.into()),
    }
}
