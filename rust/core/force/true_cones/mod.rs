//! Force distribution over second-order friction cones.
//!
//! - [`program`]: column generation; [`columns`]: the furthest force of a cone in closed form.
//! - [`interior_point_socp`]: the reference and fallback by Clarabel.

pub(crate) mod columns;
pub(crate) mod interior_point_socp;
pub(crate) mod program;
