//! Which least contact forces balance an external wrench (section 4, Appendix B)?
//!
//! From the outside in:
//!
//! 1. [`distributor`]: the public type, one grasp and one objective; its buffers are a [`workspace`].
//! 2. [`limits`]: limits that a controller changes. They make a problem of the contacts that are on.
//! 3. [`problem`]: a grasp with the program of its objective.
//! 4. [`program`]: an objective. [`squares`] is the least sum of squares, a [`share_program`] the least maximum or sum.
//! 5. [`share_program`]: [`linear_cones`] for finitely many extreme forces, [`true_cones`] for second-order cones,
//!    [`preload`] for contacts with lower bounds. All three use [`simplex`], whose columns the support oracle prices.
//!
//! Beside them:
//!
//! - [`nearest`]: forces where none balance a wrench.
//! - [`solution`]: forces with their certificate, and the options; [`batch`]: many wrenches in one call;
//!   [`grasp_batch`]: many grasps.
//! - [`slip_margin`]: the share of a contact's friction that a force leaves unused.
//! - [`pyramid_hull`]: tells early that nothing balances a wrench.
//! - [`gradient`]: how least forces, and the distance from balance, change with contacts and wrench.
//! - [`certificate`]: checks lower bounds, balance and duality gap of the forces; [`balance`]: asks for balance alone.
//! - [`equilibration`]: coordinates in which all rows of the wrenches are of order one.
//! - [`least_norm`]: chooses among forces that are equally good.
//! - [`interior_point`]: Clarabel, where own methods end without an answer, and for the enumerated method.
//! - [`double_double`]: solves in 32 digits where doubles cannot decide.
//! - [`resistance`]: the largest wrench along given directions.

pub(crate) mod balance;
pub(crate) mod batch;
pub(crate) mod certificate;
pub(crate) mod distributor;
pub(crate) mod double_double;
pub(crate) mod equilibration;
pub(crate) mod gradient;
pub(crate) mod grasp_batch;
pub(crate) mod interior_point;
pub(crate) mod least_norm;
pub(crate) mod limits;
pub(crate) mod linear_cones;
pub(crate) mod nearest;
pub(crate) mod preload;
pub(crate) mod problem;
pub(crate) mod program;
pub(crate) mod pyramid_hull;
pub(crate) mod resistance;
pub(crate) mod share_program;
pub(crate) mod simplex;
pub(crate) mod slip_margin;
pub(crate) mod solution;
pub(crate) mod squares;
pub(crate) mod true_cones;
pub(crate) mod workspace;
