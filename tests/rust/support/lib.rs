//! What the tests, the benchmarks and the fuzz targets share.
//!
//! - [`problems`] and [`tile`]: seeded grasps, and the paper's Example 2; [`random`]: a cheap sequence of numbers.
//! - [`reference_cases`]: the answers in `tests/reference`, and what any answer must satisfy.
//! - [`balance`], [`duality`], [`friction_cone`], [`interior_point`], [`least_squares`]: independent checks of forces.
//! - [`control_loop`]: a distributor with one workspace.
#![allow(
    missing_docs,
    clippy::missing_panics_doc,
    clippy::return_self_not_must_use,
    clippy::should_implement_trait,
    reason = "helpers of tests: a failed check is a panic"
)]

pub mod balance;
pub mod control_loop;
pub mod duality;
pub mod friction_cone;
pub mod interior_point;
pub mod least_squares;
pub mod problems;
pub mod random;
pub mod reference_cases;
pub mod tile;
