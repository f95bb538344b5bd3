//! Brackets, closure, gradients and batches.

mod degenerate;
mod flat;
mod gradient;
mod near_rounding;
mod quality;
mod quality_laws;
mod symmetric_cones;
