//! Qualities of many grasps on all cores.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::grasp::Grasp;
use crate::interrupt;
use crate::quality::closure::Closure;
use crate::quality::gradient::Gradient;
use crate::quality::result::{QualityOptions, QualityWorkspace};
use crate::status::Status;

/// What a batch reports of one grasp.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchItem {
    /// `-epsilon`; NaN where there is no grasp.
    pub rho: f64,
    /// `lower <= rho`.
    pub lower: f64,
    /// `rho <= upper`.
    pub upper: f64,
    /// Whether the bracket is as narrow as asked for.
    pub converged: bool,
    /// The class; `None` where there is no grasp.
    pub closure: Option<Closure>,
    /// How `epsilon` changes with the contacts, where that was asked for and there is a grasp.
    pub gradient: Option<Gradient>,
    /// Why there is no grasp, or no gradient of `float64`.
    pub error: Option<Error>,
}

impl BatchItem {
    /// How the row ended.
    pub fn status(&self) -> Status {
        match self.error {
            Some(_) => Status::Invalid,
            None if self.converged => Status::Solved,
            None => Status::NotConverged,
        }
    }
}

/// The qualities of `grasp(row)` for all rows, in order, in parallel; with their gradients where `gradient` is true.
///
/// A row that fails reports its error and does not stop the others.
pub fn quality_batch<const D: usize>(
    rows: Range<usize>,
    grasp: impl Fn(usize) -> Result<Grasp<D>> + Sync,
    options: &QualityOptions<D>,
    gradient: bool,
) -> Vec<BatchItem> {
    let interrupt = interrupt::current();
    let measured = |workspace: &mut _, row| {
        interrupt::check()?;
        let grasp = grasp(row)?;
        if gradient {
            return grasp.quality_and_gradient(options, workspace).map(|(quality, by)| (quality, Some(by)));
        }
        grasp.quality_with(options, workspace).map(|quality| (quality, None))
    };
    rows.into_par_iter()
        .map_init(QualityWorkspace::default, |workspace, row| {
            match interrupt::inherit(interrupt.as_ref(), || measured(workspace, row)) {
                Ok((quality, gradient)) => BatchItem {
                    rho: quality.rho,
                    lower: quality.lower,
                    upper: quality.upper,
                    converged: quality.converged,
                    closure: Some(quality.closure),
                    gradient,
                    error: None,
                },
                Err(error) => BatchItem {
                    rho: f64::NAN,
                    lower: f64::NAN,
                    upper: f64::NAN,
                    converged: false,
                    closure: None,
                    gradient: None,
                    error: Some(error),
                },
            }
        })
        .collect()
}
