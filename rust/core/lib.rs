//! Certified grasp quality, contact planning and force distribution for multifingered grasps.
//!
//! Contact i at `r_i` exerts the force `s` in its frame, and so the wrench `G_i s` (planar `[fx, fy, tau]`, spatial
//! `[f, tau]`). Its extreme forces `s_ih` (Eq. 3) give the primitive wrenches `w_ih = G_i s_ih` (Eq. 8). With shares
//! `lambda_ih >= 0` of them:
//!
//! ```text
//! grasp equation    W lambda = -w_ext                                              (Eq. 11)
//! contact forces    sigma_sum = sum_i sum_h lambda_ih                              (Eq. 6)
//!                   sigma_max = max_i sum_h lambda_ih                              (Eq. 7)
//! support function  p(z) = max_ih w_ih . z                  for the sum            (Eq. 14)
//!                   p(z) = sum_i max(0, max_h w_ih . z)     for the maximum        (Eqs. 16, 17)
//! quality           rho = -min p(z) over |z| = 1,  epsilon = -rho                  (Eqs. 16 to 19)
//! least forces      sigma = min sum_j alpha_j  subject to  P alpha = -w_ext, alpha >= 0   (Eqs. 24, 26)
//! ```
//!
//! `rho < 0` means force closure. The columns of `P` are the points of the wrench set; they are never listed but priced by
//! `p(z)`.
//!
//! # Where is what
//!
//! | paper | question | folder |
//! |---|---|---|
//! | Section 2, Eqs. 3 to 8 | contacts, frames, extreme forces, wrenches, their norm | `grasp/` |
//! | Sections 3.1 and 3.2, Eqs. 12 to 17, Algorithm 1 | the wrench sets and their support | `wrench_set/` |
//! | Theorem 1, Appendix A | the largest ball inside a convex set, its point nearest to the origin | `convex/` |
//! | Section 3.2, Eqs. 16 to 19, Propositions 1 and 2 | quality, closure, gradients | `quality/` |
//! | Section 3.4 | candidates and boxes of contact planning | `planning/` |
//! | Section 4, Eqs. 20 to 31, Appendix B | least contact forces | `force/` |
//! | | places of the centre of mass at which contacts hold a body | `support_region/` |
//! | | numbers that the field optimises in place of the quality | `surrogates/` |
//! | | small matrices, 32 digits | `linalg/` |
//! | | every tolerance, with its meaning and origin | `tolerances/` |
//! | | errors, and the status of a row of a batch | `error.rs`, `status.rs` |
//! | | Ctrl-C, and large allocations that are tried | `interrupt.rs`, `memory.rs` |
//!
//! The data's way: [`Contact`]s make a [`Grasp`]; its [`WrenchSet`] answers how far it reaches along a direction; quality
//! and force distribution ask nothing else.
//!
//! Equation numbers refer to Y. Zheng and W.-H. Qian, "Limiting and minimizing the contact forces in
//! multifingered grasping", Mechanism and Machine Theory 41 (2006) 1243-1257.
#![forbid(unsafe_code)]

mod convex;
mod error;
mod force;
mod grasp;
mod interrupt;
mod linalg;
mod memory;
mod planning;
mod quality;
mod status;
mod support_region;
mod surrogates;
#[cfg(test)]
mod test_numbers;
mod tolerances;
mod wrench_set;

pub use convex::expanding_polytope::DEFAULT_MAX_FACETS;
pub use error::{Error, Result, Unmet};
pub use force::batch::DistributionBatch;
pub use force::distributor::ForceDistributor;
pub use force::gradient::ForceGradient;
pub use force::grasp_batch::{GraspForceGradients, GraspForces, GraspForcesOptions, forces_batch};
pub use force::nearest::options::NearestOptions;
pub use force::solution::{Distribution, DistributionOptions, Method};
pub use force::squares::options::SquaresOptions;
pub use force::workspace::ForceWorkspace;
pub use grasp::contact::{
    Contact, ContactForce, ForceModel, MAX_EDGES, MAX_EXTREME_FORCES, contact_force, write_components,
};
pub use grasp::plausibility::implausibility;
pub use grasp::torque_limits::torque_limited_forces;
pub use grasp::wrench_norm::Metric;
pub use grasp::{ContactMap, Grasp, GraspOptions, Wrench, wrench_of_force};
pub use interrupt::{Interrupt, interruptible};
pub use memory::{check_room, room};
pub use planning::box_bound::{BoxBound, Stencil};
pub use planning::candidate_search::{CandidateSearch, SearchCounts, Winner};
pub use planning::product_bound::ProductBound;
pub use planning::product_bound::cells::{CellTree, ForceSet};
pub use planning::product_bound::triangles::Goal;
pub use planning::triangle_tree::{ClosestPoint, QUERIES_PER_TASK, TriangleTree};
pub use quality::batch::{BatchItem, quality_batch};
pub use quality::bundle::CriticalDirection;
pub use quality::closure::Closure;
pub use quality::gradient::Gradient;
pub use quality::least_friction::{FrictionOptions, LeastFriction, least_friction_batch};
pub use quality::{Quality, QualityOptions, QualityWorkspace};
pub use status::Status;
pub use support_region::{
    HorizontalPoint, RegionShape, STANDARD_GRAVITY, SupportOptions, SupportRegion, polygon_margin,
};
pub use surrogates::batch::surrogate_batch;
pub use surrogates::{Surrogate, SurrogateValue};
pub use tolerances::{FEASIBILITY_TOLERANCE, TIE};
pub use wrench_set::minkowski_sum::{DEFAULT_MAX_POINTS, MinkowskiSum};
pub use wrench_set::{ContactReach, Criterion, Support, WrenchSet};
