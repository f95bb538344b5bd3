//! Force distribution over second-order friction cones.
//!
//! - [`program`]: column generation; [`columns`]: the furthest force of a cone in closed form.
//! - [`interior_point_socp`]: Clarabel's answer, where column generation stalls.

pub(crate) mod columns;
pub(crate) mod interior_point_socp;
pub(crate) mod program;
