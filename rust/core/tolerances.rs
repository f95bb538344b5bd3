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
