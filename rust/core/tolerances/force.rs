//! Tolerances of balance and force distribution.

/// The feasibility tolerance of force distribution: what may be left unbalanced, as a share of the wrench.
///
/// Forces count in units of the largest force that one contact exerts at its limit, torques in units of the largest
/// torque; the wrench's size is its largest component in these units. A wrench is balanced if what is left over, its
/// components added up in these units, is at most this share of that size. It is infeasible if a direction separates
/// it by more. Nothing lies in between.
pub const FEASIBILITY_TOLERANCE: f64 = 1e-9;

/// What rounding makes of a balance that was added up in doubles, relative to its terms: some ten roundings.
pub(crate) const ROUNDED_TERMS: f64 = 1e-15;

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
pub(crate) const UNCERTAIN_GAIN: f64 = 4e-15;

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

/// A step of refinement larger than this, relative to the multipliers, means that updates have cost the inverse its digits.
pub(crate) const LARGE_REFINEMENT: f64 = 1e-10;

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
pub(crate) const ILL_CONDITIONED: f64 = 1e5;

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

/// An arm of torsion this many times longer than all others is none beside them: rounding makes arms of at least 1e-17
/// of the grasp's size.
pub(crate) const IMMENSE_ARM: f64 = 1e20;

/// Forces that need this share of their limits more than all of them are at their limits.
pub(crate) const AT_LIMIT: f64 = 1e-9;

/// How much nearer, relative to the wrench, other forces may come: a tenth of what `nearest` proves.
pub(crate) const NEAREST_DISTANCE: f64 = 1e-10;

/// The gap of a distance, relative to the norm of the wrench, that rounding leaves: some fifty roundings.
pub(crate) const ROUNDED_DISTANCE_GAP: f64 = 1e-14;

/// What rounding leaves of the reach of all forces, relative to its terms.
pub(crate) const ROUNDED_REACH: f64 = 16.0 * f64::EPSILON;

/// The gap of an objective at which no further step is worth it where steps bring little.
pub(crate) const CLOSE_GAP: f64 = 1e-10;

/// The gap of a least sum within limits at which no further step or weight is worth it.
pub(crate) const PROVEN_SUM: f64 = 1e-12;

/// What the forces of a step, or on exposed faces, may leave unbalanced, relative to the wrench.
pub(crate) const BALANCED_STEP: f64 = 1e-11;

/// A contact is about to change its face where its furthest forces differ by this, relative to the pull on it.
pub(crate) const TOUCHING: f64 = 1e-9;

/// A direction with less than this outside the span of the others depends on them.
pub(crate) const DEPENDENT_DIRECTION: f64 = 1e-9;

/// Directions with more than this outside the span of the others prove forces to be the only ones.
pub(crate) const INDEPENDENT_DIRECTION: f64 = 1e-7;
