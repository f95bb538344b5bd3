//! The support oracle beside enumeration.

mod minkowski;
mod soft_lattices;
mod true_cones;
