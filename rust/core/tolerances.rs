//! The tolerances of the library, each with what it means.

/// The feasibility tolerance of force distribution: what may be left unbalanced, as a share of the wrench.
///
/// Forces count in units of the largest force that one contact exerts at its limit, torques in units of the largest
/// torque; the wrench's size is its largest component in these units. A wrench is balanced if what is left over, its
/// components added up in these units, is at most this share of that size. It is infeasible if a direction separates
/// it by more. Nothing lies in between.
pub const FEASIBILITY_TOLERANCE: f64 = 1e-9;

/// What may be left over of a balance of any size because its terms were rounded, relative to the terms.
pub(crate) const ROUNDED_TERMS: f64 = 1e-13;

// Force distribution

/// Directions weaker than this, relative to the strongest, are rounding: the grasp cannot act along them.
pub(crate) const RANK_TOLERANCE: f64 = 1e-12;

/// What an external wrench may have outside the span of the forces, relative to the whole: its own rounding.
pub(crate) const UNBALANCED_WRENCH: f64 = 1e-10;

/// Reduced costs below this, relative to the cost of a column, are no improvement: some thousand roundings.
pub(crate) const OPTIMAL_COST: f64 = 1e-12;

/// Columns whose first reduced cost is at most this share the optimum of the objective: above [`OPTIMAL_COST`].
pub(crate) const TIED_COST: f64 = 1e-11;

/// What rounding of multipliers makes of a reduced cost, relative to their size: nine roundings.
pub(crate) const ROUNDED_COST: f64 = 2e-15;

/// Pivot elements below this share of the largest are not trusted: a basis would keep less than half its digits.
pub(crate) const SMALLEST_PIVOT: f64 = 1e-9;

/// The same in 32 digits; the next of them where a basis lost too many.
pub(crate) const SMALLEST_PIVOTS_32_DIGITS: [f64; 3] = [1e-24, 1e-19, 1e-14];

/// What a basis in 32 digits may leave of the wrench, relative to the largest level.
pub(crate) const ROUNDED_BASIS: f64 = 1e-13;

/// Ratios of levels that differ by this share of the largest level are equal up to rounding.
pub(crate) const TIED_LEVELS: f64 = 1e-14;

/// Levels below this share of their sum are not used, and so is no negative share of a remembered region.
pub(crate) const UNUSED_LEVEL: f64 = 1e-11;

/// How negative a share may be, relative to the objective, in the critical region that was just built for a wrench.
pub(crate) const NEGATIVE_IN_NEW_REGION: f64 = 1e-9;

/// How negative a share may be before the wrench is outside a remembered critical region.
pub(crate) const NEGATIVE_IN_KNOWN_REGION: f64 = 1e-11;

/// The largest relative gap that counts as an answer where multipliers are too large to keep the caller's tolerance.
pub(crate) const LOOSEST_GAP: f64 = 1e-6;

/// The gap that rounding leaves, relative to the largest term of the objective: 32 roundings.
pub(crate) const ROUNDED_GAP: f64 = 32.0 * f64::EPSILON;

/// A larger gap is not left by rounding alone: the multipliers are wrong, and 32 digits decide.
pub(crate) const DOUBTFUL_GAP: f64 = 1e-11;

/// What rounding leaves between the two ways of computing the objective along a ray.
pub(crate) const RAY_GAP: f64 = 1e-13;

/// How far a wrench may be from a ray, relative to its size: rounding.
pub(crate) const RAY_WIDTH: f64 = UNBALANCED_WRENCH / 2e4;

/// Forces that change by more than this, relative to the wrench's and their own size, follow rounding of positions.
pub(crate) const STEEP: f64 = 1e6;

/// Forces or multipliers that grow by more than this with a wrench, all in their units, are decided in 32 digits and
/// remembered for no other wrench.
pub(crate) const DELICATE: f64 = 1e5;

/// Columns or rows of unit length that are dependent up to this do not determine the unknowns.
pub(crate) const DEPENDENT: f64 = 1e-11;

/// Gradients below this, relative to the largest, are rounding of the wrenches.
pub(crate) const UNMOVED: f64 = 1e-9;

/// Violations of constraints below this, relative to bounds and solution, are rounding.
pub(crate) const VIOLATED: f64 = 1e-12;

/// What a solution of least norm may miss of its constraints and multipliers, relative to parameters and solution.
pub(crate) const UNSATISFIED: f64 = 1e-10;

/// Points of the wrench set this near to the hyperplane of Eq. 26 take part: the interior-point solver's digits.
pub(crate) const NEAR_HYPERPLANE: f64 = 1e-5;

/// Extreme forces that lose more than this share of the objective cannot take part in the least squares.
pub(crate) const LOST_OBJECTIVE: f64 = 1e-3;

/// How far the objective of forces chosen by least squares may be above the least: half of the default tolerance.
pub(crate) const CHOSEN_GAP: f64 = 5e-10;

/// What forces chosen by least squares may leave over: a hundredth of [`FEASIBILITY_TOLERANCE`].
pub(crate) const CHOSEN_REST: f64 = 1e-11;

/// Witnesses in doubles with a larger margin, along which nothing reaches beyond [`CLEAR_REACH`], need no proof in
/// 32 digits.
pub(crate) const CLEAR_MARGIN: f64 = 1e-6;

/// How far wrenches may reach along a clear witness: rounding.
pub(crate) const CLEAR_REACH: f64 = 4e-15;

/// A wrench that reaches this far along a witness, relative to both their lengths, pushes along it.
pub(crate) const PUSHING: f64 = 1e-9;

/// What is left over of a wrench that was computed in doubles.
pub(crate) const ROUNDED_WRENCH: f64 = 5e-16;

/// How far a support value in doubles may be off, relative to the multipliers, before it is computed in 32 digits.
pub(crate) const ROUNDED_SUPPORT: f64 = 1e-14;

/// Roundings of the forces times the longest arm by which a balance of torques may fail though no torque takes part.
pub(crate) const ROUNDED_TORQUE: f64 = 64.0 * f64::EPSILON;

/// Forces that need this share of their limits more than all of them are at their limits.
pub(crate) const AT_LIMIT: f64 = 1e-9;
