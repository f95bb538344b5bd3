//! Between Python's objects and the core's.
//!
//! - [`raw_arguments`]: the arguments that describe a grasp, by name; [`grasp_arguments`]: their shapes and values;
//!   [`views`]: large arrays where they lie; [`broadcast`]: values that contacts share; [`force_models`]: edges and
//!   extreme forces; [`quality_options`]: the arguments of a quality query.
//! - [`arrays`]: views of NumPy arrays; [`read_only`]: arrays that results own; [`restored`]: checks of pickles.
//! - [`scalars`]: single values, refused by name; [`significant`]: numbers as far as they are proven.
//! - [`dimension`]: planar and spatial behind one name; [`errors`]: the core's errors as Python's exceptions.

pub(crate) mod arrays;
pub(crate) mod broadcast;
pub(crate) mod dimension;
pub(crate) mod errors;
pub(crate) mod force_models;
pub(crate) mod grasp_arguments;
pub(crate) mod quality_options;
pub(crate) mod raw_arguments;
pub(crate) mod read_only;
pub(crate) mod restored;
pub(crate) mod scalars;
pub(crate) mod significant;
pub(crate) mod views;
