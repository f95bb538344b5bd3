//! The tolerances of the library, each with what it means and where it comes from.
//!
//! - [`grasp`]: units, torque limits, metrics; [`convex`]: polytopes and nearest points.
//! - [`quality`]: quality and planning; [`force`]: balance and force distribution.

pub(crate) mod convex;
pub(crate) mod force;
pub(crate) mod grasp;
pub(crate) mod quality;

pub(crate) use convex::*;
pub use force::*;
pub(crate) use grasp::*;
pub use quality::*;
