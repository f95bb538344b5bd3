//! Certified grasp quality, contact planning and force distribution for multifingered grasps.
//!
//! The data's way: [`Contact`]s make a [`Grasp`]; its [`WrenchSet`] answers one question (how far do you
//! reach along this direction?); quality and force distribution ask nothing else.
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
mod tolerances;
mod wrench_set;

pub use convex::expanding_polytope::DEFAULT_MAX_FACETS;
pub use error::{Error, Result, Unmet};
pub use force::batch::{DistributionBatch, RowStatus};
pub use force::distributor::ForceDistributor;
pub use force::solution::{Distribution, DistributionOptions, Method};
pub use grasp::contact::{Contact, ContactForce, ForceModel, MAX_EDGES, MAX_EXTREME_FORCES};
pub use grasp::plausibility::implausibility;
pub use grasp::torque_limits::torque_limited_forces;
pub use grasp::wrench_norm::Metric;
pub use grasp::{ContactMap, Grasp, GraspOptions, Wrench, wrench_of_force};
pub use interrupt::{Interrupt, interruptible};
pub use memory::{check_room, room};
pub use planning::box_bound::{BoxBound, Stencil};
pub use planning::candidate_search::{CandidateSearch, SearchCounts, TIE, Winner};
pub use planning::triangle_tree::{ClosestPoint, TriangleTree};
pub use quality::batch::{BatchItem, quality_batch};
pub use quality::closure::Closure;
pub use quality::gradient::Gradient;
pub use quality::{Quality, QualityOptions, QualityWorkspace};
pub use tolerances::FEASIBILITY_TOLERANCE;
pub use wrench_set::minkowski_sum::{DEFAULT_MAX_POINTS, MinkowskiSum};
pub use wrench_set::{ContactReach, Criterion, Support, WrenchSet};
