//! What works on any convex set that is known by its support function.
//!
//! - [`expanding_polytope`]: the largest ball around the origin inside the set, bracketed from both sides (Appendix A).
//! - [`min_norm_point`]: the point of the set nearest to the origin, where the origin lies outside.
//! - [`round_coordinates`]: coordinates in which a thin set is round, and the largest ball by their help.
//! - [`rounding`]: how far rounding may have moved the points of the set.

pub(crate) mod expanding_polytope;
pub(crate) mod min_norm_point;
pub(crate) mod round_coordinates;
pub(crate) mod rounding;
