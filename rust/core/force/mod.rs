//! How hard must each finger press? Least contact forces that balance an external wrench (section 4, Appendix B).
//!
//! A [`distributor`] keeps one grasp and one objective, and solves in a [`workspace`]. Its program is one of three: [`linear_cones`] for finitely
//! many extreme forces, [`true_cones`] for second-order cones, and [`preload`] where contacts have lower bounds. All
//! three stand on [`simplex`], whose columns are priced by the support oracle.
//!
//! - [`solution`]: what comes back, and the options; [`batch`]: many wrenches at once.
//! - [`certificate`]: the last check of signs, balance and duality gap.
//! - [`equilibration`]: coordinates in which all rows of the wrenches are of order one.
//! - [`least_norm`]: the choice among forces that are equally good; [`double_double`]: 32 digits where doubles cannot decide.
//! - [`resistance`]: the largest wrench along given directions.

pub(crate) mod batch;
pub(crate) mod certificate;
pub(crate) mod distributor;
pub(crate) mod double_double;
pub(crate) mod equilibration;
pub(crate) mod least_norm;
pub(crate) mod linear_cones;
pub(crate) mod preload;
pub(crate) mod resistance;
pub(crate) mod simplex;
pub(crate) mod solution;
pub(crate) mod true_cones;
pub(crate) mod workspace;
