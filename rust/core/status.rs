//! How one row of a batch ended.

use crate::error::Error;

/// How one row of a batch ended, with the same meaning for forces and for qualities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum Status {
    /// The row has its answer, within the tolerance asked for.
    Solved = 0,
    /// No forces inside the friction cones balance this wrench.
    Infeasible = 1,
    /// The row is no valid input: not finite, too large or too small to compute with, or not a grasp.
    Invalid = 2,
    /// The tolerance was not met. Forces are NaN, but for nearest ones, whose `gap` is wider than asked for. The bracket of
    /// a quality is valid, and wider than asked for.
    NotConverged = 3,
}

impl Status {
    /// How a row ended that has no forces for this reason.
    #[must_use]
    pub fn of(error: &Error) -> Self {
        match error {
            error if error.is_infeasible() => Self::Infeasible,
            Error::InvalidInput { .. } | Error::InvalidGrasp { .. } => Self::Invalid,
            _ => Self::NotConverged,
        }
    }
}
