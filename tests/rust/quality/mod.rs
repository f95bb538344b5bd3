//! Brackets, closure, gradients and batches.

mod answers;
mod degenerate;
mod flat;
mod gradient;
mod map_coordinates;
mod near_rounding;
mod quality_laws;
mod symmetric_cones;
