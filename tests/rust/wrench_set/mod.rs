//! The support oracle beside enumeration.

mod minkowski;
mod true_cones;
