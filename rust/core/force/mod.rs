//! Which least contact forces balance an external wrench (section 4, Appendix B)?
//!
//! A [`distributor`] holds one grasp and one objective. It solves in a [`workspace`] and does not change while it does.
//! Below both, a [`problem`] pairs the grasp with the [`program`] of its objective, without the [`limits`] that a
//! controller changes. A [`share_program`] is the least maximum or sum: [`linear_cones`] for finitely many extreme
//! forces, [`true_cones`] for second-order cones, [`preload`] for contacts with lower bounds. All three use
//! [`simplex`], whose columns are priced by the support oracle. [`squares`] is the least sum of squares, over cones of any
//! kind. [`nearest`] answers where no forces balance a wrench.
//!
//! - [`solution`]: forces with their certificate, and the options; [`batch`]: many wrenches in one call;
//!   [`grasp_batch`]: many grasps.
//! - [`pyramid_hull`]: tells early that nothing balances a wrench.
//! - [`gradient`]: how least forces, and the distance from balance, change with contacts and wrench.
//! - [`certificate`]: checks lower bounds, balance and duality gap of the forces; [`balance`]: asks for balance alone.
//! - [`equilibration`]: coordinates in which all rows of the wrenches are of order one.
//! - [`least_norm`]: chooses among forces that are equally good.
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
pub(crate) mod solution;
pub(crate) mod squares;
pub(crate) mod true_cones;
pub(crate) mod workspace;
