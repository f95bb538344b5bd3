//! Certified grasp quality, contact planning and force distribution for multifingered grasps.
//!
//! The data's way: [`Contact`]s make a [`Grasp`]; its [`WrenchSet`] answers one question (how far do you
//! reach along this direction?); quality and force distribution ask nothing else.
//!
//! Equation numbers refer to Y. Zheng and W.-H. Qian, "Limiting and minimizing the contact forces in
//! multifingered grasping", Mechanism and Machine Theory 41 (2006) 1243-1257.
#![forbid(unsafe_code)]

mod basis;
mod batch;
mod boundary;
mod box_bound;
mod closest_point;
mod closure;
mod columns;
mod cone_columns;
mod cone_program;
mod conic;
mod contact;
mod distribution;
mod distribution_batch;
mod dual_simplex;
mod edge_blocks;
mod enumerated;
mod equilibration;
mod error;
mod face;
mod facet;
mod force_distributor;
mod found;
mod gradient;
mod grasp;
mod interior;
mod interrupt;
mod joint_torques;
mod law;
mod least_squares;
mod linear;
mod linear_program;
mod manipulability;
mod memory;
mod metric;
mod minkowski;
mod nearest_point;
mod plausibility;
mod polytope;
mod preload;
mod preload_columns;
mod preload_face;
mod quality;
mod question;
mod region;
mod region_reader;
mod resistance;
mod ridge_table;
mod search;
mod second_order;
mod simplex;
mod wrench_set;

pub use batch::{BatchItem, quality_batch};
pub use box_bound::{BoxBound, Stencil};
pub use closest_point::{ClosestPoint, TriangleTree};
pub use closure::{CLOSURE_TOLERANCE, Closure};
pub use contact::{Contact, ContactForce, ForceModel, MAX_EDGES, MAX_EXTREME_FORCES};
pub use distribution::{Distribution, DistributionOptions, Method};
pub use distribution_batch::{DistributionBatch, RowStatus};
pub use error::{Error, Result};
pub use force_distributor::ForceDistributor;
pub use gradient::Gradient;
pub use grasp::{ContactMap, Grasp, GraspOptions, Wrench, wrench_of_force};
pub use interrupt::{Interrupt, interruptible};
pub use joint_torques::torque_limited_forces;
pub use memory::{check_room, room};
pub use metric::Metric;
pub use minkowski::{DEFAULT_MAX_POINTS, MinkowskiSum};
pub use plausibility::implausibility;
pub use quality::{Quality, QualityOptions, QualityWorkspace};
pub use search::{CandidateSearch, SearchCounts, TIE, Winner};
pub use wrench_set::{ContactSupport, Criterion, Support, WrenchSet};
