//! Tolerances of quality and planning.

/// A radius below this part of the longest wrench is not searched for: rounding of wrenches is larger.
pub(crate) const SMALLEST_RADIUS: f64 = 1e-18;

/// The bracket of partial closure counts as converged up to this part of the longest wrench: the default tolerance.
pub(crate) const ON_BOUNDARY: f64 = 1e-9;

/// Contacts nearer to each other than this part of their distance from the origin coincide: some fifty roundings.
pub(crate) const COINCIDENT_CONTACTS: f64 = 1e-14;

/// A map is orthogonal, or a generator skew, up to this: some thousand roundings.
pub(crate) const ORTHOGONAL_MAP: f64 = 1e-12;

/// Closure is beyond doubt with a ball of this radius inside the hull of unit wrenches, or a gap of this width between the
/// hull and the origin, beyond what rounding takes of either: half a million roundings.
///
/// This is only the shortcut of clear cases, and where the search for the class begins. What rounding may have done
/// decides closure: [`ROUNDED_POINT`] times the sizes of the terms of unit wrenches. It grows with the distance of the
/// contacts from the coordinates' origin, in units of their extent.
pub(crate) const CLEAR_CLOSURE: f64 = 1e-10;

/// The uncertainty of a position in units of [`ROUNDED_POINT`]: two roundings of its coordinates.
pub(crate) const ROUNDED_POSITION: f64 = 0.125;

/// Deviations from symmetry of up to this part of the tolerance leave the bracket enough of it to close.
pub(crate) const EXACT_SYMMETRY: f64 = 0.25;

/// Relative width of the bracket of inscribed true cones that is narrow enough: what they are smaller than the
/// linearised ones costs more.
pub(crate) const INSCRIBED_RTOL: f64 = 1e-4;

/// Larger deviations from symmetry may take up to this part of the radius from what is proven.
pub(crate) const NEAR_SYMMETRY: f64 = 1e-3;

/// A radius below this part of the longest wrench counts as zero about a center: the center itself is rounded.
pub(crate) const NEGLIGIBLE_RADIUS: f64 = 1e-12;

/// Features of contacts that differ by more than this part of the grasp's size belong to different contacts. Only how
/// many maps are tried depends on it.
pub(crate) const ALIKE_FEATURES: f64 = 1e-4;

/// How far from the nearest boundary wrench its forces may end, relative to the longest one: the default tolerance.
pub(crate) const EXERTED_WRENCH: f64 = 1e-9;

/// The same where contacts have true cones: the minimiser of a smooth function is only as exact as the square root of
/// its bracket.
pub(crate) const EXERTED_WRENCH_BY_CONES: f64 = 1e-5;

/// The same relative to the boundary wrench itself: contacts of very unequal limits have wrenches far longer than it, and
/// forces that miss it by as much as its own length are no gradient.
pub(crate) const EXERTED_PART: f64 = 1e-4;

/// What of it rounding leaves in any case, relative to the longest wrench.
pub(crate) const ROUNDED_EXERTED_WRENCH: f64 = 1e-13;

/// Gradients of dependent edges that differ by less, relative to what adds up to them, are the same.
pub(crate) const SAME_GRADIENT: f64 = 1e-7;

/// The same where contacts have true cones, whose worst direction is less exact.
pub(crate) const SAME_GRADIENT_BY_CONES: f64 = 1e-4;

/// Default relative width of the bracket of quality.
pub(crate) const QUALITY_RTOL: f64 = 1e-9;

/// The same where contacts have true cones: a polytope resolves smooth sets by ever more facets.
pub(crate) const QUALITY_RTOL_OF_CONES: f64 = 1e-6;

/// Relative width of the bracket of a distance: outside, precision costs a few more calls of the oracle.
pub(crate) const DISTANCE_RTOL: f64 = 1e-9;

/// Relative width of the bracket of a radius in the hull of unit wrenches, of which only the sign matters.
pub(crate) const UNIT_WRENCHES_RTOL: f64 = 1e-9;

/// The same of the distance of that hull.
pub(crate) const NEAREST_UNIT_WRENCH_RTOL: f64 = 1e-6;

/// The first simplex of a polytope, relative to the longest wrench: a ball of that size is worth mentioning.
pub(crate) const FIRST_SIMPLEX: f64 = 1e-3;

/// The next simplex where one did not fit, relative to it and to the least support found.
pub(crate) const SMALLER_SIMPLEX: f64 = 1e-3;

/// The first simplex in the part of the sphere that symmetries leave, relative to the least support found.
pub(crate) const SYMMETRIC_SIMPLEX: f64 = 1e-2;

/// Unit directions that a generator of rotations moves by less lie on the axis: there the orbit has no velocity.
pub(crate) const FIXED_DIRECTION: f64 = 1e-6;

/// What a wall may give away inside its chamber, relative to the least support found.
pub(crate) const BEYOND_WALL: f64 = 1e-3;

/// A radius of less, relative to the least support found, may come from walls: ten times [`BEYOND_WALL`].
pub(crate) const PROVEN_IN_CHAMBER: f64 = 1e-2;

/// A bracket wider than its tolerance by this factor of the tolerance has closed, up to rounding of the quotient.
pub(crate) const CLOSED_BRACKET: f64 = 1.001;

/// Relative width of the bracket from which gradients take their minimiser: as exact as rounding allows.
pub(crate) const MINIMISER_RTOL: f64 = 1e-12;

/// The same where contacts have true cones, whose bracket costs more.
pub(crate) const MINIMISER_RTOL_OF_CONES: f64 = 1e-10;

/// How far from the supporting hyperplane wrenches count as active, relative to the longest: from the default tolerance
/// on, in turn, until the active ones exert the nearest boundary wrench.
pub(crate) const ACTIVE_FACES: [f64; 4] = [1e-9, 1e-7, 1e-5, 1e-3];

/// A combination of active wrenches this near to the boundary wrench, relative to the longest, meets it.
pub(crate) const ROUNDED_RESIDUAL: f64 = 1e-14;

/// An edge of a face of which a smaller part lies outside the span of the others depends on them: the square root of a
/// hundred roundings, since the faces come from a search.
pub(crate) const INDEPENDENT_SHIFT: f64 = 1e-7;

/// What rounding and [`CLEAR_CLOSURE`] leave uncertain in a candidate's quality, relative to the longest wrench.
pub(crate) const UNCERTAIN_QUALITY: f64 = 1e-9;

/// What rounding leaves uncertain between equal sums, relative to the longest wrench.
pub(crate) const ROUNDED_BOUND: f64 = 16.0 * f64::EPSILON;

/// Candidates within this of the best (relative) are equally good: the paper does not say which of them wins.
pub const TIE: f64 = 1e-9;

/// Relative width at which the bound of a box is sharp enough: the slack of the box is wider.
pub(crate) const BOX_BOUND_RTOL: f64 = 1e-3;
