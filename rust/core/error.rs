//! The one error type. Every message names the argument, the contact or row, and the value.

use thiserror::Error;

/// What can go wrong, each with its witness.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A grasp cannot be built from these contacts, or has no finite set where one is needed.
    #[error("{}", located(argument, "contact", *contact, reason))]
    InvalidGrasp {
        /// Name of the offending argument, as callers spell it.
        argument: &'static str,
        /// Zero-based contact, if it is about one.
        contact: Option<usize>,
        /// What is wrong, with the value.
        reason: String,
    },
    /// An argument of a query (a wrench, a tolerance, a step) is unusable.
    #[error("{}", located(argument, if OF_CONTACTS.contains(argument) { "contact" } else { "row" }, *row, reason))]
    InvalidInput {
        /// Name of the offending argument, as callers spell it.
        argument: &'static str,
        /// Zero-based row, or contact of an argument with one value for each, if it is about one.
        row: Option<usize>,
        /// What is wrong, with the value.
        reason: String,
    },
    /// No forces inside the friction cones balance the external wrench, however strong they are.
    ///
    /// The witness is a direction `e` with `w_ih . e <= 0` for every primitive wrench and
    /// `-w_ext . e > 0`.
    #[error(
        "no contact forces within the friction cones {}balance the external wrench; separating direction {}{}",
        if *lower_bounds { "keep the lower bounds and " } else { "" },
        rounded(direction),
        if *lower_bounds { "; without min_normal, forces balance the wrench: lower it" } else { "" }
    )]
    InfeasibleWrench {
        /// The separating direction, of unit length.
        direction: Vec<f64>,
        /// Whether forces balance the wrench without the lower bounds of the normal forces.
        lower_bounds: bool,
    },
    /// Contact forces within the friction cones balance the external wrench, but none that keep the upper bounds of
    /// their normal forces.
    ///
    /// The witness is a direction `e` along which the wrenches of bounded forces reach less far than `-w_ext`.
    #[error(
        "no contact forces within the limits balance the external wrench, though stronger ones do; separating direction \
         {}; raise max_normal_force, or ask for the nearest wrench",
        rounded(direction)
    )]
    BeyondLimits {
        /// The separating direction, of unit length.
        direction: Vec<f64>,
    },
    /// An explicit enumeration would not fit the limit the caller allows.
    #[error(
        "the Minkowski sum has {points} points ({bytes} bytes), more than max_points = {limit}; \
         raise max_points, or use a method that does not enumerate"
    )]
    TooLarge {
        /// How many points the enumeration would hold.
        points: u128,
        /// How much memory the points and their index matrices would take.
        bytes: u128,
        /// The limit in force, in points.
        limit: u128,
    },
    /// The machine, or a limit set on the process, has no room for something large.
    #[error("{what}: no memory for {bytes} bytes; give fewer rows in one call, or raise the memory limit")]
    OutOfMemory {
        /// The argument or result that does not fit.
        what: &'static str,
        /// How much memory was asked for.
        bytes: u128,
    },
    /// [`interruptible`](crate::interruptible) was told to stop.
    #[error("interrupted")]
    Interrupted,
    /// A bounded iteration ended without an answer that passes its checks.
    #[error("{solver}, after {iterations} pivots: {unmet}")]
    NotConverged {
        /// Which iteration.
        solver: &'static str,
        /// Pivots used.
        iterations: usize,
        /// The check that failed.
        unmet: Unmet,
    },
}

/// The check that an answer did not pass, by how much, and what may help.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum Unmet {
    /// No optimal basis within the pivots allowed.
    #[error(
        "no optimal basis was reached; rescale the wrench or the limits where they are spread over many orders of magnitude"
    )]
    Pivots,
    /// The objective is not proven to be the least.
    #[error(
        "the relative gap between the objective and its lower bound is {found:.3e}, more than {allowed:.1e}; raise rtol, \
         or move the wrench away from the boundary of what the contacts can balance"
    )]
    Gap {
        /// The relative gap.
        found: f64,
        /// The largest that is allowed.
        allowed: f64,
    },
    /// The forces do not balance the wrench.
    #[error(
        "the relative residual of the balance is {found:.3e}, more than {allowed:.1e}; bring limits and \
         lever arms closer together, or move the origin towards the contacts"
    )]
    Balance {
        /// What is left over, relative.
        found: f64,
        /// The largest that is allowed.
        allowed: f64,
    },
    /// A contact presses less than its lower bound.
    #[error(
        "a normal force lies below min_normal by {found:.3e} of the largest share, more than {allowed:.1e}; \
         bring the lower bounds closer together"
    )]
    LeastNormal {
        /// What is missing, relative.
        found: f64,
        /// The largest that is allowed.
        allowed: f64,
    },
}

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Whether the error says that no contact forces balance a wrench.
    pub fn is_infeasible(&self) -> bool {
        matches!(self, Self::InfeasibleWrench { .. } | Self::BeyondLimits { .. })
    }

    pub(crate) fn grasp(argument: &'static str, reason: impl Into<String>) -> Self {
        Self::InvalidGrasp { argument, contact: None, reason: reason.into() }
    }

    pub(crate) fn contact(argument: &'static str, contact: usize, reason: impl Into<String>) -> Self {
        Self::InvalidGrasp { argument, contact: Some(contact), reason: reason.into() }
    }

    pub(crate) fn input(argument: &'static str, reason: impl Into<String>) -> Self {
        Self::InvalidInput { argument, row: None, reason: reason.into() }
    }
}

/// Arguments of queries with a value for each contact.
const OF_CONTACTS: [&str; 4] = ["min_normal", "weights", "reference", "max_normal_force"];

/// A number in a message: scientific where plain digits would be many.
pub(crate) fn digits(x: f64) -> String {
    if x == 0.0 || !x.is_finite() || (1e-5..1e9).contains(&x.abs()) {
        format!("{x}")
    } else {
        format!("{x:e}")
    }
}

/// A direction in a message, to six significant digits.
fn rounded(direction: &[f64]) -> String {
    let six = |x: &f64| digits(format!("{x:.5e}").parse().unwrap_or(*x) + 0.0);
    format!("[{}]", direction.iter().map(six).collect::<Vec<_>>().join(", "))
}

fn located(argument: &str, what: &str, index: Option<usize>, reason: &str) -> String {
    match index {
        Some(index) => format!("{argument}, {what} {index}: {reason}"),
        None => format!("{argument}: {reason}"),
    }
}
