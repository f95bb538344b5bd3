//! Least squares of contact forces: `min sum_i weight_i |f_i - reference_i|^2 / 2` subject to balance and cones, or with a
//! price on what stays unbalanced.
//!
//! The dual has as many unknowns as the wrench, whatever the number of contacts: the multiplier `z` of the balance. It
//! determines the forces,
//!
//! ```text
//! f_i(z) = projection onto K_i of reference_i + G_i^T z / weight_i
//! F(z)   = sum_i G_i f_i(z) - b + S^-1 z = 0,   b = -w_ext       (the last term with a price S of the residual)
//! ```
//!
//! `F` is the gradient of a convex function. Newton's method with a line search finds its root. For any `z` the forces are
//! optimal for the wrench that they balance, so that the residual of `F` is the whole error. The answer is unique, and
//! Lipschitz continuous in the wrench.
//!
//! - [`options`]: the options and their checks.
//! - [`projection`], [`pyramid`], [`polytope`]: projections onto cones, pyramids and hulls of extreme forces, cut or not,
//!   with derivatives.
//! - [`whitening`]: coordinates of wrenches in which Newton's matrix is at most the identity.
//! - [`dual`]: the dual function of a grasp; [`newton`]: its minimiser.
//! - [`program`]: the answer with its certificate; [`steep_price`]: in 32 digits, where doubles lose the forces beside a
//!   high price of the residual; [`by_price`]: up to the feasibility tolerance, where exact balance has no multiplier.
//! - [`last_resorts`]: where Newton's method ends without an answer, with [`interior_point_qp`]: Clarabel.

pub(crate) mod by_price;
pub(crate) mod dual;
pub(crate) mod interior_point_qp;
pub(crate) mod last_resorts;
pub(crate) mod newton;
pub(crate) mod options;
pub(crate) mod polytope;
pub(crate) mod program;
pub(crate) mod projection;
pub(crate) mod pyramid;
pub(crate) mod steep_price;
pub(crate) mod whitening;
