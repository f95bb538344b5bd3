//! Tolerances of convex sets.

/// Rounding of a component of a wrench, relative to the sizes of its terms: counted from positions and normals on, it is
/// fewer units.
pub(crate) const ROUNDED_POINT: f64 = 16.0 * f64::EPSILON;

/// The least square of a tangent's part across the normal that counts: what is less, the frame does not use.
pub(crate) const LEAST_TANGENT: f64 = 1e-18;

/// A point is beyond a plane `y . x = 1` where it exceeds it by this much: some thousand roundings, so that coplanar points
/// are not.
pub(crate) const BEYOND_PLANE: f64 = 1e-12;

/// What rounding leaves uncertain in a distance, relative to the longest vertex: six products and their sum.
pub(crate) const ROUNDED_DISTANCE: f64 = 8.0 * f64::EPSILON;

/// What norms and quotients lose, relative to themselves.
pub(crate) const ROUNDED_QUOTIENT: f64 = 8.0 * f64::EPSILON;

/// A plane whose vertices are off it by more is computed afresh before it is used: some hundred roundings.
pub(crate) const DRIFTED_PLANE: f64 = 1e-13;

/// A plane this much shorter than the two that it is combined from has lost three digits, and is computed afresh.
pub(crate) const CANCELLED_PLANE: f64 = 1e-3;

/// What a projection in 32 digits leaves of a column, relative to the column, is rounding: some thousand of them.
pub(crate) const CANCELLED_COLUMN: f64 = 1e-28;

/// What a product in 32 digits loses, in units of what one in 16 digits does: [`ROUNDED_POINT`] times this is some thousand
/// roundings.
pub(crate) const LOST_IN_32_DIGITS: f64 = 1e-14;

/// A plane whose vertices are off it by less than this proves that the origin is on its inner side.
pub(crate) const PROVEN_PLANE: f64 = 0.5;

/// Wolfe's algorithm has stalled where its bounds move by less than this part of them: below any tolerance that can be asked
/// for.
pub(crate) const LEAST_PROGRESS: f64 = 1e-12;

/// Weights below this, times how far they move the nearest point, are rounding: points without weight leave the hull.
pub(crate) const UNUSED_WEIGHT: f64 = 1e-14;

/// The same in 32 digits.
pub(crate) const UNUSED_WEIGHT_32_DIGITS: f64 = 1e-20;

/// An edge of which a smaller part lies outside the span of the others depends on them: some hundred roundings.
pub(crate) const DEPENDENT_EDGE: f64 = 1e-13;

/// The same in 32 digits.
pub(crate) const DEPENDENT_EDGE_32_DIGITS: f64 = 1e-26;

/// Where the square of the support function's slope is below this part of the point's, the slope is rounding.
pub(crate) const FLAT_SUPPORT: f64 = 1e-20;

/// A direction is as bad as the worst where its support is larger by at most this part: the default tolerance of quality.
pub(crate) const RIVAL_RADIUS: f64 = 1e-9;

/// Directions nearer than this to the worst one are not others: near a smooth minimum they are nearly as bad.
pub(crate) const RIVAL_DIRECTION: f64 = 1e-3;
