//! The third level: among forces that are equally good, those of least `sum |f_i|^2 / f_i^U^2`.
//!
//! - [`face_program`]: the optimal face of a grasp's program as a small quadratic program.
//! - [`solver`]: `min |A x|^2` subject to `E x = D p`, `C x >= c`.

pub(crate) mod face_program;
pub(crate) mod solver;
