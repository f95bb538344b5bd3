//! Small dense linear algebra that no wrench set knows of.
//!
//! - [`dense`]: solves, inverses and square roots of matrices of the size of a wrench.
//! - [`double_double`]: numbers of 32 digits, as the sum of two doubles; [`orthonormal_equations`]: equations in them.

pub(crate) mod dense;
pub(crate) mod double_double;
pub(crate) mod orthonormal_equations;
