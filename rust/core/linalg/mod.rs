//! Small dense linear algebra that no wrench set knows of.
//!
//! - [`dense`]: solves and inverses of matrices of the size of a wrench.
//! - [`least_distance`]: the least distance to a polyhedron; [`active_planes`]: the factor of its active rows.
//! - [`pivoted_basis`]: an orthonormal basis of what vectors span.
//! - [`double_double`]: numbers of 32 digits, as the sum of two doubles; [`orthonormal_equations`]: equations in them;
//!   [`real`]: what algorithms for both precisions need.

pub(crate) mod active_planes;
pub(crate) mod dense;
pub(crate) mod double_double;
pub(crate) mod least_distance;
pub(crate) mod orthonormal_equations;
pub(crate) mod pivoted_basis;
pub(crate) mod real;
