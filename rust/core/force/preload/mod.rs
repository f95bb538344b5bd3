//! Lower bounds on normal forces.
//!
//! - [`program`]: the linear program with its convexity row; [`columns`]: its columns and their price.
//! - [`optimal_face`]: which contacts and edges are active in all optimal forces.

pub(crate) mod columns;
pub(crate) mod optimal_face;
pub(crate) mod program;
