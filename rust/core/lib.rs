//! Certified grasp quality, contact planning and force distribution for multifingered grasps.
//!
//! The data's way: [`Contact`]s make a [`Grasp`]; its [`WrenchSet`] answers one question (how far do you
//! reach along this direction?); quality and force distribution ask nothing else.
//!
//! Equation numbers refer to Y. Zheng and W.-H. Qian, "Limiting and minimizing the contact forces in
//! multifingered grasping", Mechanism and Machine Theory 41 (2006) 1243-1257.
#![forbid(unsafe_code)]

mod basis;
mod columns;
mod conic;
mod contact;
mod distribution;
mod enumerated;
mod equilibration;
mod error;
mod grasp;
mod minkowski;
mod simplex;
mod wrench_set;

pub use contact::{Contact, ContactForce, ForceModel, MAX_EDGES};
pub use distribution::{Distribution, DistributionOptions, ForceDistributor, Method};
pub use error::{Error, Result};
pub use grasp::{ContactMap, Grasp, GraspOptions, Wrench, wrench_of_force};
pub use minkowski::{DEFAULT_MAX_POINTS, MinkowskiSum};
pub use wrench_set::{ContactSupport, Criterion, Support, WrenchSet};
