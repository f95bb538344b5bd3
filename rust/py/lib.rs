//! Python bindings: every function converts, calls, and maps the error. No algorithm lives here.
#![forbid(unsafe_code)]
#![allow(missing_docs, unreachable_pub, reason = "docstrings are Python's; the crate has no Rust callers")]
#![allow(
    clippy::doc_markdown,
    clippy::doc_link_with_quotes,
    reason = "docstrings are Python's, in reStructuredText"
)]
#![allow(clippy::needless_pass_by_value, reason = "extracted arguments arrive by value")]
#![allow(clippy::unused_self, reason = "getters take self")]
#![allow(clippy::large_enum_variant, reason = "the larger variant, spatial, is the usual one")]

mod any_grasp;
mod arguments;
mod arrays;
mod box_bound;
mod closest_point;
mod errors;
mod force_batch;
mod force_calls;
mod force_distributor;
mod force_solution;
mod force_steps;
mod gradient;
mod grasp;
mod interrupt;
mod joint_torques;
mod minkowski;
mod quality;
mod quality_many;
mod quality_options;
mod restored;
mod search;
mod threads;
mod workspace;

use pyo3::prelude::*;

/// The compiled part of graspforce.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<grasp::PyGrasp>()?;
    module.add_class::<quality::PyQuality>()?;
    module.add_class::<gradient::PyGradient>()?;
    module.add_class::<minkowski::PyMinkowskiSum>()?;
    module.add_class::<force_distributor::PyForceDistributor>()?;
    module.add_class::<force_solution::PyForceSolution>()?;
    module.add_class::<force_batch::PyForceBatch>()?;
    module.add_class::<force_steps::PyForceSteps>()?;
    module.add_class::<quality_many::PyQualityBatch>()?;
    module.add_class::<search::PyCandidateSearch>()?;
    module.add_class::<box_bound::PyBoxBound>()?;
    module.add_class::<closest_point::PyTriangleTree>()?;
    // Not among the module's public names.
    module.setattr("unwarned_grasp", wrap_pyfunction!(grasp::unwarned_grasp, module)?)?;
    module.add_function(wrap_pyfunction!(joint_torques::torque_limited_forces, module)?)?;
    module.add_function(wrap_pyfunction!(quality_many::quality_many, module)?)
}
