//! What a solve says beside the forces.

use graspforce_core::{Distribution, Error};

use crate::memory::{self, SizedStruct};

/// What a solve says beside the forces. Initialise it by `gf_solution_init`.
///
/// Planar wrenches use the first three of six numbers. Without forces all numbers are NaN, but for the `direction` of an
/// infeasible wrench.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Solution {
    /// Bytes of this struct; `gf_solution_init` sets it.
    size: usize,
    /// The objective.
    sigma: f64,
    /// The largest share of a contact of its limit; at most 1 within the limits.
    sigma_max: f64,
    /// The sum of the shares.
    sigma_sum: f64,
    /// Relative distance between `sigma` and the lower bound that `dual` proves.
    gap: f64,
    /// The objective changes by `-dual` with the external wrench.
    dual: [f64; 6],
    /// What the forces leave unbalanced: the external wrench plus that of the forces.
    residual: [f64; 6],
    /// The norm of the residual by `gf_distributor_nearest`; 0 by `gf_distributor_solve`.
    distance: f64,
    /// Of an infeasible wrench: a direction along which no contact can push, but the external wrench must be balanced.
    /// Where stronger forces balance it: a direction along which forces within the limits do not push far enough.
    direction: [f64; 6],
    /// 1 where objective and tie-break alone determine the forces, else 0.
    unique: i32,
    /// 1 where every normal force keeps its limit, else 0.
    within_limits: i32,
    /// Simplex pivots of this solve.
    pivots: u64,
    /// 1 where another solver had to give the answer, else 0. Of nearest forces: 1 where 32 digits gave it, or where
    /// nothing proves more than `gap`.
    fell_back: i32,
}

// SAFETY: `repr(C)`, the first field is a `usize`, the others are numbers.
unsafe impl SizedStruct for Solution {
    const NAME: &'static str = "solution";
}

impl Default for Solution {
    fn default() -> Self {
        Self {
            size: size_of::<Self>(),
            sigma: f64::NAN,
            sigma_max: f64::NAN,
            sigma_sum: f64::NAN,
            gap: f64::NAN,
            dual: [f64::NAN; 6],
            residual: [f64::NAN; 6],
            distance: f64::NAN,
            direction: [f64::NAN; 6],
            unique: 0,
            within_limits: 0,
            pivots: 0,
            fell_back: 0,
        }
    }
}

/// Writes NaN. `size` is `sizeof(gf_solution)`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gf_solution_init(solution: *mut Solution, size: usize) {
    // SAFETY: the header's rules.
    unsafe { memory::initialise(solution, size) };
}

impl<const D: usize> From<&Distribution<D>> for Solution {
    fn from(found: &Distribution<D>) -> Self {
        let mut solution = Self {
            sigma: found.sigma,
            sigma_max: found.sigma_max,
            sigma_sum: found.sigma_sum,
            gap: found.gap,
            distance: found.distance,
            unique: i32::from(found.unique),
            within_limits: i32::from(found.within_limits()),
            pivots: found.pivots as u64,
            fell_back: i32::from(found.fell_back),
            ..Self::default()
        };
        solution.dual[..D].copy_from_slice(found.dual.as_slice());
        solution.residual[..D].copy_from_slice(found.residual.as_slice());
        solution
    }
}

impl From<&Error> for Solution {
    fn from(error: &Error) -> Self {
        let mut solution = Self::default();
        if let Error::InfeasibleWrench { direction, .. } | Error::BeyondLimits { direction } = error {
            solution.direction[..direction.len()].copy_from_slice(direction);
        }
        solution
    }
}
