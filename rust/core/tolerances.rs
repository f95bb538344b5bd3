//! The tolerances of the library, each with what it means and where it comes from.

// Grasps

/// How far outside a bound on torques a vertex may lie, relative to its size: three rounded bounds meet in it.
pub(crate) const OUTSIDE_TORQUE_LIMITS: f64 = 1e-9;

/// A pivot of a metric's factor below this part of its diagonal entry cannot be told from zero: 32 digits, less four.
pub(crate) const INDEFINITE: f64 = 1e-28;

/// Cosine to the centre below which a normal points away from it: heights that differ by rounding or by noise are
/// no direction.
pub(crate) const AWAY_FROM_CENTRE: f64 = -1e-3;

// Convex sets

/// Rounding of a component of a wrench, relative to the sizes of its terms: counted from positions and normals on, it is
/// fewer units.
pub(crate) const ROUNDED_POINT: f64 = 16.0 * f64::EPSILON;

/// A point is beyond a plane `y . x = 1` where it exceeds it by this much: some thousand roundings, so that coplanar points
/// are not.
pub(crate) const BEYOND_PLANE: f64 = 1e-12;

/// What rounding leaves uncertain in a distance, relative to the longest vertex: six products and their sum.
pub(crate) const ROUNDED_DISTANCE: f64 = 8.0 * f64::EPSILON;

/// What norms and quotients lose, relative to themselves.
pub(crate) const ROUNDED_QUOTIENT: f64 = 8.0 * f64::EPSILON;

/// A plane whose vertices are off it by less than this proves that the origin is on its inner side.
pub(crate) const PROVEN_PLANE: f64 = 0.5;

/// Wolfe's algorithm has stalled where its bounds move by less than this part of them: below any tolerance that can be asked
/// for.
pub(crate) const LEAST_PROGRESS: f64 = 1e-12;

// Quality

/// Closure is beyond doubt with a ball of more than this radius inside the hull of unit wrenches, or a gap of more than this
/// between the hull and the origin: a million roundings.
pub(crate) const CLEAR_CLOSURE: f64 = 1e-10;

/// The uncertainty of a position in units of [`ROUNDED_POINT`]: two roundings of its coordinates.
pub(crate) const ROUNDED_POSITION: f64 = 0.125;

/// Deviations from symmetry of up to this part of the tolerance leave the bracket enough of it to close.
pub(crate) const EXACT_SYMMETRY: f64 = 0.25;

/// Larger deviations from symmetry may take up to this part of the radius from what is proven.
pub(crate) const NEAR_SYMMETRY: f64 = 1e-3;

/// A radius below this part of the longest wrench counts as zero about a center: the center itself is rounded.
pub(crate) const NEGLIGIBLE_RADIUS: f64 = 1e-12;

/// Features of contacts that differ by more than this part of the grasp's size belong to different contacts. Only how
/// many maps are tried depends on it.
pub(crate) const ALIKE_FEATURES: f64 = 1e-4;

/// How far from the nearest boundary wrench the forces that exert it may end, relative to the longest wrench: the default
/// tolerance of quality.
pub(crate) const EXERTED_WRENCH: f64 = 1e-9;

/// The same where contacts have true cones: the minimiser of a smooth function is only as exact as the square root of
/// its bracket.
pub(crate) const EXERTED_WRENCH_BY_CONES: f64 = 1e-5;

/// Gradients of dependent edges that differ by less, relative to what adds up to them, are the same.
pub(crate) const SAME_GRADIENT: f64 = 1e-7;

/// The same where contacts have true cones, whose worst direction is less exact.
pub(crate) const SAME_GRADIENT_BY_CONES: f64 = 1e-4;

// Planning

/// What rounding and [`CLEAR_CLOSURE`] leave uncertain in a candidate's quality, relative to the longest wrench.
pub(crate) const UNCERTAIN_QUALITY: f64 = 1e-9;

/// What rounding leaves uncertain between equal sums, relative to the longest wrench.
pub(crate) const ROUNDED_BOUND: f64 = 16.0 * f64::EPSILON;

/// Candidates within this of the best (relative) are equally good: the paper does not say which of them wins.
pub const TIE: f64 = 1e-9;

/// Relative width at which the bound of a box is sharp enough: the slack of the box is wider.
pub(crate) const BOX_BOUND_RTOL: f64 = 1e-3;

// Balance

/// The feasibility tolerance of force distribution: what may be left unbalanced, as a share of the wrench.
///
/// Forces count in units of the largest force that one contact exerts at its limit, torques in units of the largest
/// torque; the wrench's size is its largest component in these units. A wrench is balanced if what is left over, its
/// components added up in these units, is at most this share of that size. It is infeasible if a direction separates
/// it by more. Nothing lies in between.
pub const FEASIBILITY_TOLERANCE: f64 = 1e-9;

/// What may be left over of a balance of any size because its terms were rounded, relative to the terms.
pub(crate) const ROUNDED_TERMS: f64 = 1e-13;
