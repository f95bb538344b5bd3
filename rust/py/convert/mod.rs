//! Between Python's objects and the core's.
//!
//! - [`grasp_arguments`]: the arguments that describe a grasp; [`quality_options`]: those of a question about quality.
//! - [`arrays`]: views of NumPy arrays; [`dimension`]: planar and spatial behind one name; [`errors`]: the core's errors
//!   as Python's exceptions.

pub(crate) mod arrays;
pub(crate) mod dimension;
pub(crate) mod errors;
pub(crate) mod grasp_arguments;
pub(crate) mod quality_options;
pub(crate) mod restored;
