//! Forces whose wrench comes nearest to balance, where no forces balance an external wrench, or none within the limits.
//!
//! - [`wrench_projection`]: the nearest wrench that contacts can exert, in the norm of a metric, with a proven distance.
//! - [`exposed_face`], [`face_newton`]: the same to machine precision, once the forces that reach furthest are known.
//! - [`on_faces`]: the least forces among those.
//! - [`limited_sum`]: the least sum of shares where the least sum without limits would break them; [`sum_by_weights`]: the
//!   same where shares are not linear in the forces.
//! - [`by_price`], [`price_bounds`], [`price_caps`]: both at once in 32 digits, for grasps that are degenerate but for
//!   noise; exact over finitely many extreme forces by [`vertices`].
//! - [`answer`]: the least forces among those that reach the nearest wrench, with [`options`] and a [`workspace`].

pub(crate) mod answer;
pub(crate) mod by_price;
pub(crate) mod exposed_face;
pub(crate) mod face_newton;
pub(crate) mod limited_sum;
pub(crate) mod on_faces;
pub(crate) mod options;
pub(crate) mod price_bounds;
pub(crate) mod price_caps;
pub(crate) mod sum_by_weights;
pub(crate) mod vertices;
pub(crate) mod workspace;
pub(crate) mod wrench_projection;
