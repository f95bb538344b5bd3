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

// Quality

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

/// What rounding makes of a balance that was added up in doubles, relative to its terms: some ten roundings.
pub(crate) const ROUNDED_TERMS: f64 = 1e-15;

// Force distribution

/// Directions weaker than this, relative to the strongest, are rounding: the grasp cannot act along them.
pub(crate) const RANK_TOLERANCE: f64 = 1e-12;

/// What an external wrench may have outside the span of the forces, relative to the whole: its own rounding.
pub(crate) const UNBALANCED_WRENCH: f64 = 1e-10;

/// Reduced costs below this, relative to the cost of a column, are no improvement: some thousand roundings.
pub(crate) const OPTIMAL_COST: f64 = 1e-12;

/// Columns whose first reduced cost is at most this share the optimum of the objective: above [`OPTIMAL_COST`].
pub(crate) const TIED_COST: f64 = 1e-11;

/// Columns whose reduced cost is above rounding and at most this share of the cost are optimal but for noise of the
/// wrenches: twice what the third level may lose ([`CHOSEN_GAP`]).
pub(crate) const NEARLY_TIED: f64 = 1e-9;

/// The same of the tie-break, whose tolerance is [`TIED_GAIN`].
pub(crate) const NEARLY_TIED_GAIN: f64 = 1e-7;

/// What rounding makes of a reduced cost in which equal terms cancel, relative to the multipliers: 64 roundings.
pub(crate) const ROUNDED_TIE: f64 = 64.0 * f64::EPSILON;

/// What rounding of multipliers makes of a reduced cost, relative to their size: nine roundings.
pub(crate) const ROUNDED_COST: f64 = 2e-15;

/// Products with a multiplier below this, relative to its size, do not reach along it: some hundred roundings.
pub(crate) const UNREACHED: f64 = 1e-13;

/// What the first phase of the simplex method leaves, relative to its multiplier, before that separates.
pub(crate) const SEPARATED: f64 = 1e-11;

/// Gains below this, relative to the multipliers, are lost in their last digit.
pub(crate) const SMALLEST_GAIN: f64 = 5e-16;

/// Gains below this, relative to the multipliers, may be rounding: nine terms and their sum.
pub(crate) const FEIGNED_GAIN: f64 = 4e-15;

/// Gains of the tie-break below this are no improvement, and below [`ROUNDED_GAIN`] of its multipliers.
pub(crate) const TIED_GAIN: f64 = 1e-9;

/// What rounding makes of a gain of the tie-break, relative to its multipliers.
pub(crate) const ROUNDED_GAIN: f64 = 1e-12;

/// What rounding makes of a support value, relative to the multipliers.
pub(crate) const ROUNDED_SUPPORT_VALUE: f64 = 1e-15;

/// Levels below this share of the largest are zero.
pub(crate) const ROUNDED_LEVEL: f64 = 1e-15;

/// How negative a level may be, relative to the largest, before the basis has lost the wrench.
pub(crate) const NEGATIVE_LEVEL: f64 = 1e-13;

/// A step of refinement larger than this, relative to the multipliers, means that updates have worn the inverse out.
pub(crate) const WORN_OUT: f64 = 1e-10;

/// Pivot elements below this share of the largest are not trusted: a basis would keep less than half its digits.
pub(crate) const SMALLEST_PIVOT: f64 = 1e-9;

/// The same in 32 digits; the next of them where a basis lost too many.
pub(crate) const SMALLEST_PIVOTS_32_DIGITS: [f64; 3] = [1e-24, 1e-19, 1e-14];

/// What a basis in 32 digits may leave of the wrench, relative to the largest level.
pub(crate) const ROUNDED_BASIS: f64 = 1e-13;

/// How far true cones may reach along a witness of infeasibility, in units of the feasibility tolerance: a few roundings.
pub(crate) const CONE_SEPARATED: f64 = 1e-15;

/// Ratios of levels that differ by this share of the largest level are equal up to rounding.
pub(crate) const TIED_LEVELS: f64 = 1e-14;

/// Normalised normal forces that differ by less than this share of the largest are the same.
pub(crate) const SAME_SHARE: f64 = 1e-9;

/// Levels below this share of their sum are not used, and so is no negative share of a remembered region.
pub(crate) const UNUSED_LEVEL: f64 = 1e-11;

/// How far forces on a face may be from balance and from the multipliers' objective before the basis is not trusted.
pub(crate) const TRUSTED_FORCES: f64 = 1e-9;

/// What rounding makes of forces, relative to their sum.
pub(crate) const ROUNDED_FORCES: f64 = 1e-14;

/// How negative a share may be, relative to the objective, in the critical region that was just built for a wrench.
pub(crate) const NEGATIVE_IN_NEW_REGION: f64 = 1e-9;

/// How negative a share may be before the wrench is outside a remembered critical region.
pub(crate) const NEGATIVE_IN_KNOWN_REGION: f64 = 1e-11;

/// The largest relative gap that counts as an answer where multipliers are too large to keep the caller's tolerance.
pub(crate) const LOOSEST_GAP: f64 = 1e-6;

/// The gap that rounding leaves, relative to the largest term of the objective: 32 roundings.
pub(crate) const ROUNDED_GAP: f64 = 32.0 * f64::EPSILON;

/// A smaller gap is left by rounding alone, however small the multipliers are.
pub(crate) const LEAST_DOUBTFUL_GAP: f64 = 1e-13;

/// A larger gap is not left by rounding alone: the multipliers are wrong, and 32 digits decide.
pub(crate) const DOUBTFUL_GAP: f64 = 1e-11;

/// What rounding leaves between the two ways of computing the objective along a ray.
pub(crate) const RAY_GAP: f64 = 1e-13;

/// How far a wrench may be from a ray, relative to its size: rounding.
pub(crate) const RAY_WIDTH: f64 = UNBALANCED_WRENCH / 2e4;

/// Forces or multipliers that grow by more than this with a wrench, all in their units, are decided in 32 digits and
/// remembered for no other wrench.
pub(crate) const DELICATE: f64 = 1e5;

/// Forces that add up to more than this beside a wrench, both in their units, are not computed anew for its multiples:
/// their rounding comes near to [`FEASIBILITY_TOLERANCE`].
pub(crate) const LARGE_FORCES: f64 = 1e4;

/// Columns or rows of unit length that are dependent up to this do not determine the unknowns.
pub(crate) const DEPENDENT: f64 = 1e-11;

/// A multiplier whose curvature is below this part of its own terms is not determined by the curvature.
pub(crate) const FREE_DIRECTION: f64 = 1e-12;

/// The largest relative gap of an answer of Newton's method over true cones.
pub(crate) const NEWTON_GAP: f64 = 1e-11;

/// Gradients below this, relative to the largest, are rounding of the wrenches.
pub(crate) const UNMOVED: f64 = 1e-9;

/// Violations of constraints below this, relative to bounds and solution, are rounding.
pub(crate) const VIOLATED: f64 = 1e-12;

/// What a solution of least norm may miss of its constraints and multipliers, relative to parameters and solution.
pub(crate) const UNSATISFIED: f64 = 1e-10;

/// Points of the wrench set this near to the hyperplane of Eq. 26 take part: the interior-point solver's digits.
pub(crate) const NEAR_HYPERPLANE: f64 = 1e-5;

/// What rounding leaves of a balance in the coordinates of the least squares, relative to its terms.
pub(crate) const ROUNDED_BALANCE: f64 = 64.0 * f64::EPSILON;

/// How far beyond all forces a wrench must lie, relative to both, before a multiplier of least squares proves that.
pub(crate) const SEPARATED_BY_DUAL: f64 = 1e-6;

/// What rounding leaves of how far a force reaches beyond the face of the nearest one, relative to both lengths.
pub(crate) const ROUNDED_REACH_OF_FACE: f64 = 1e-13;

/// What rounding may make of forces beside a price of the residual, relative to the largest: a tenth of
/// [`FEASIBILITY_TOLERANCE`]. Where it is more, 32 digits decide.
pub(crate) const ROUNDED_FORCES_BY_PRICE: f64 = 1e-10;

/// Extreme forces that lose more than this share of the objective cannot take part in the least squares.
pub(crate) const LOST_OBJECTIVE: f64 = 1e-3;

/// Gradients below this, relative to the largest, are rounding where the equations were solved in 32 digits.
pub(crate) const UNMOVED_BY_CHOICE: f64 = 1e-13;

/// Equations of wrenches in their units that are dependent up to this add nothing: less than [`CHOSEN_REST`].
pub(crate) const DEPENDENT_EQUATION: f64 = 1e-12;

/// How far the objective of forces chosen by least squares may be above the least: half of the default tolerance.
pub(crate) const CHOSEN_GAP: f64 = 5e-10;

/// What forces chosen by least squares may leave over: a hundredth of [`FEASIBILITY_TOLERANCE`].
pub(crate) const CHOSEN_REST: f64 = 1e-11;

/// Witnesses in doubles with a larger margin need no proof in 32 digits, if nothing reaches beyond [`CLEAR_REACH`].
pub(crate) const CLEAR_MARGIN: f64 = 1e-6;

/// How far wrenches may reach along a clear witness: rounding.
pub(crate) const CLEAR_REACH: f64 = 4e-15;

/// A wrench that reaches this far along a witness, relative to both their lengths, pushes along it.
pub(crate) const PUSHING: f64 = 1e-9;

/// What is left over of a wrench computed in doubles: to balance less may take multipliers too large for doubles.
pub(crate) const ROUNDED_WRENCH: f64 = 1e-14;

/// The objective up to which forces count for a wrench of size 1: rounding of larger ones nears [`FEASIBILITY_TOLERANCE`].
pub(crate) const LARGEST_OBJECTIVE: f64 = 1e5;

/// Extreme forces that reach this near to the furthest one, relative to the longest, are as good.
pub(crate) const SUPPORTED: f64 = 1e-9;

/// How far a support value in doubles may be off, relative to the multipliers, before it is computed in 32 digits.
pub(crate) const ROUNDED_SUPPORT: f64 = 1e-14;

/// Roundings of the forces times the longest arm by which a balance of torques may fail though no torque takes part.
pub(crate) const ROUNDED_TORQUE: f64 = 64.0 * f64::EPSILON;

/// Forces that need this share of their limits more than all of them are at their limits.
pub(crate) const AT_LIMIT: f64 = 1e-9;
