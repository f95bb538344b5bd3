//! Force distribution, as Python sees it. The docstrings of its methods are in `docs/`.
//!
//! - [`distributor`]: `ForceDistributor`; [`construction`]: how it is made; [`distribution_options`]: its options;
//!   [`squares_arguments`]: those of least squares; [`shared`]: its workspace, for one thread at a time; [`solve`]: its
//!   calls; [`nearest`]: those where nothing balances.
//! - [`solution`]: `ForceSolution`; [`query`]: what was asked; [`distribution_state`]: its pickle; [`joint_torques`]:
//!   torques that exert the forces; [`batch`]: `ForceBatch`; [`solve_iter`]: the iterator over wrenches;
//!   [`many`]: `forces_many`.

pub(crate) mod batch;
pub(crate) mod construction;
pub(crate) mod distribution_options;
pub(crate) mod distribution_state;
pub(crate) mod distributor;
pub(crate) mod joint_torques;
pub(crate) mod many;
pub(crate) mod nearest;
pub(crate) mod query;
pub(crate) mod shared;
pub(crate) mod solution;
pub(crate) mod solve;
pub(crate) mod solve_iter;
pub(crate) mod squares_arguments;
