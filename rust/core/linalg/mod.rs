//! Small dense linear algebra that no wrench set knows of.
//!
//! - [`dense`]: solves, inverses and square roots of matrices of the size of a wrench.

pub(crate) mod dense;
pub(crate) mod double_double;
