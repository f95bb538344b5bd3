//! How good is a grasp?

use std::ffi::c_char;
use std::ptr;

use graspforce_core as core;
use graspforce_core::{QualityWorkspace, Wrench};

use crate::boundary::call;
use crate::distributor_options::metric;
use crate::fault::{Fault, Outcome, Status};
use crate::grasp::{Grasp, borrowed, with_grasp};
use crate::memory::{self, SizedStruct, optional};

/// Which measure of the contact forces is limited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Criterion {
    /// The largest normalised normal force.
    Max = 0,
    /// The sum of the normalised normal forces.
    Sum = 1,
}

/// What a grasp can resist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub enum Closure {
    /// Wrenches in all directions.
    Force = 0,
    /// Opposite wrenches in some directions, but not in all.
    Partial = 1,
    /// No two opposite wrenches.
    None = 2,
}

/// How quality is asked for. Initialise it by `gf_quality_options_init`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct QualityOptions {
    /// Bytes of this struct; `gf_quality_options_init` sets it.
    size: usize,
    /// A `gf_criterion`.
    criterion: i32,
    /// Facets of the polytope at most; 0: 200,000.
    max_facets: u32,
    /// Relative width of the bracket, below 1; 0: 1e-9, or 1e-6 where a contact has its true cone.
    rtol: f64,
    /// d numbers: a wrench that acts all the time, such as the weight. NULL: none.
    external_wrench: *const f64,
    /// d x d, symmetric positive definite, `|w|^2 = w' M w`. NULL: the norm of the grasp's length scale.
    metric: *const f64,
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers and raw pointers.
unsafe impl SizedStruct for QualityOptions {
    const NAME: &'static str = "options";
}

impl Default for QualityOptions {
    fn default() -> Self {
        Self {
            size: size_of::<Self>(),
            criterion: Criterion::Max as i32,
            max_facets: 0,
            rtol: 0.0,
            external_wrench: ptr::null(),
            metric: ptr::null(),
        }
    }
}

/// The quality of a grasp, with its certificate. Initialise it by `gf_quality_init`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Quality {
    /// Bytes of this struct; `gf_quality_init` sets it.
    size: usize,
    /// The largest wrench that is resisted in the worst direction, as far as it is proven: `-rho`.
    epsilon: f64,
    /// `-epsilon`: negative for force closure, positive without closure.
    rho: f64,
    /// `lower <= rho`.
    lower: f64,
    /// `rho <= upper`.
    upper: f64,
    /// The worst direction, a physical wrench of unit norm; planar grasps use the first three numbers.
    direction: [f64; 6],
    /// The nearest boundary wrench, `-rho * direction`.
    wrench: [f64; 6],
    /// A `gf_closure`: the class of the grasp itself, whatever the external wrench.
    closure: i32,
    /// 1 where the bracket is as narrow as asked for, 0 elsewhere.
    converged: i32,
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers.
unsafe impl SizedStruct for Quality {
    const NAME: &'static str = "quality";
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            size: size_of::<Self>(),
            epsilon: f64::NAN,
            rho: f64::NAN,
            lower: f64::NAN,
            upper: f64::NAN,
            direction: [f64::NAN; 6],
            wrench: [f64::NAN; 6],
            closure: Closure::None as i32,
            converged: 0,
        }
    }
}

/// Writes the defaults: the maximum, the default tolerance, no external wrench. `size` is `sizeof(gf_quality_options)`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_quality_options_init(options: *mut QualityOptions, size: usize) {
    // SAFETY: the header's rules.
    unsafe { memory::initialise(options, size) };
}

/// Writes NaN. `size` is `sizeof(gf_quality)`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_quality_init(quality: *mut Quality, size: usize) {
    // SAFETY: the header's rules.
    unsafe { memory::initialise(quality, size) };
}

/// Measures a grasp. `options` may be NULL for the defaults.
///
/// `GF_STATUS_NOT_CONVERGED` comes with a valid bracket that is wider than asked for. This is no call for a control
/// loop: it takes memory from the system and up to milliseconds, more where many directions are nearly as bad as the worst.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_grasp_quality(
    grasp: *const Grasp,
    options: *const QualityOptions,
    quality: *mut Quality,
    message: *mut c_char,
    message_size: usize,
) -> Status {
    let body = || {
        // SAFETY: the header's rules.
        let (any, options) = unsafe { (borrowed(grasp)?, memory::read_or_default(options)?) };
        // SAFETY: the header's rules.
        let answer = with_grasp!(any, grasp => unsafe { measured(grasp, &options) })?;
        // SAFETY: the header's rules.
        unsafe { memory::write(quality, &answer) }?;
        Ok(if answer.converged == 1 { Status::Solved } else { Status::NotConverged })
    };
    // SAFETY: the header's rules.
    unsafe { call(message, message_size, body) }
}

/// The criterion that a number means.
pub(crate) fn criterion(argument: &'static str, number: i32) -> Outcome<core::Criterion> {
    match number {
        n if n == Criterion::Max as i32 => Ok(core::Criterion::Max),
        n if n == Criterion::Sum as i32 => Ok(core::Criterion::Sum),
        _ => Err(Fault::Number(argument, number.into(), "is neither GF_CRITERION_MAX nor GF_CRITERION_SUM")),
    }
}

/// # Safety
///
/// The pointers of the options keep the header's rules.
unsafe fn measured<const D: usize>(grasp: &core::Grasp<D>, options: &QualityOptions) -> Outcome<Quality> {
    let mut asked = core::QualityOptions::new(criterion("criterion", options.criterion)?);
    asked.rtol = (options.rtol != 0.0).then_some(options.rtol);
    asked.max_facets = (options.max_facets != 0).then_some(options.max_facets as usize);
    // SAFETY: the caller's promise.
    let (external_wrench, metric) = unsafe {
        (optional("external_wrench", options.external_wrench, D)?, metric("metric", options.metric)?)
    };
    asked.external_wrench = external_wrench.map(Wrench::from_column_slice);
    asked.metric = metric;
    let found = grasp.quality_with(&asked, &mut QualityWorkspace::default())?;
    let mut quality = Quality {
        epsilon: 0.0 - found.rho,
        rho: found.rho,
        lower: found.lower,
        upper: found.upper,
        closure: match found.closure {
            core::Closure::Force => Closure::Force,
            core::Closure::Partial => Closure::Partial,
            core::Closure::None => Closure::None,
        } as i32,
        converged: i32::from(found.converged),
        ..Quality::default()
    };
    quality.direction[..D].copy_from_slice(found.direction.as_slice());
    quality.wrench[..D].copy_from_slice(found.wrench.as_slice());
    Ok(quality)
}
