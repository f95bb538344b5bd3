//! Brackets, closure, gradients and batches.

mod answers;
mod degenerate;
mod flat;
mod gradient;
mod laws;
mod least_friction;
mod map_coordinates;
mod near_rounding;
mod symmetric_cones;
