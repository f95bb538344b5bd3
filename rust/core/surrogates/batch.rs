//! Surrogates of many grasps on all cores.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::Result;
use crate::grasp::Grasp;
use crate::interrupt;
use crate::surrogates::{Surrogate, SurrogateValue};

/// The surrogate of `grasp(row)` for all rows, in order, in parallel.
///
/// A row that fails reports its error and does not stop the others. Where no weights sum the wrenches to zero that is
/// [`Error::InfeasibleWrench`](crate::Error::InfeasibleWrench).
pub fn surrogate_batch<const D: usize>(
    rows: Range<usize>,
    grasp: impl Fn(usize) -> Result<Grasp<D>> + Sync,
    surrogate: Surrogate,
) -> Vec<Result<SurrogateValue>> {
    let interrupt = interrupt::current();
    let value = |row| {
        interrupt::check()?;
        surrogate.of(&grasp(row)?)
    };
    rows.into_par_iter().map(|row| interrupt::inherit(interrupt.as_ref(), || value(row))).collect()
}
