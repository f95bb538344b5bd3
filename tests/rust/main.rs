//! All tests of the core, in one binary, by the folders of `rust/core`.

mod force;
mod grasp;
mod planning;
mod quality;
mod robustness;
mod support_region;
mod wrench_set;
