//! Force distribution, as Python sees it.
//!
//! - [`distributor`]: `ForceDistributor`; [`distribution_options`]: its options; [`shared`]: its workspace, for one
//!   thread at a time; [`solve`]: its calls.
//! - [`solution`]: `ForceSolution`; [`batch`]: `ForceBatch`; [`solve_iter`]: the iterator over wrenches.

pub(crate) mod batch;
pub(crate) mod distribution_options;
pub(crate) mod distributor;
pub(crate) mod shared;
pub(crate) mod solution;
pub(crate) mod solve;
pub(crate) mod solve_iter;
