//! How a distributor computes forces.

use std::ptr;

use graspforce_core::{Criterion, DistributionOptions};

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
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers and a raw pointer.
unsafe impl SizedStruct for DistributorOptions {
    const NAME: &'static str = "options";
}

impl Default for DistributorOptions {
    fn default() -> Self {
        let DistributionOptions { weight, rtol, .. } = DistributionOptions::default();
        Self {
            size: size_of::<Self>(),
            objective: Objective::Max as i32,
            reserve: 1024,
            weight,
            rtol,
            min_normal: ptr::null(),
        }
    }
}

/// Writes the defaults: the maximum, a gap of 1e-9, no lower bounds. `size` is `sizeof(gf_distributor_options)`.
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

    pub(crate) fn objective(&self) -> Outcome<Criterion> {
        match self.objective {
            n if n == Objective::Max as i32 => Ok(Criterion::Max),
            n if n == Objective::Sum as i32 => Ok(Criterion::Sum),
            n => {
                Err(Fault::Number("objective", n.into(), "is neither GF_OBJECTIVE_MAX nor GF_OBJECTIVE_SUM"))
            }
        }
    }

    /// The options of the core, for a grasp of so many contacts.
    ///
    /// # Safety
    ///
    /// The pointers keep the header's rules.
    pub(crate) unsafe fn core(&self, contacts: usize) -> Outcome<DistributionOptions> {
        let mut options = DistributionOptions::default();
        options.weight = self.weight;
        options.rtol = self.rtol;
        // SAFETY: the caller's promise.
        if let Some(bounds) = unsafe { optional("min_normal", self.min_normal, contacts) }? {
            options.min_normal = bounds.to_vec();
        }
        Ok(options)
    }
}
