//! Python bindings: every function converts, calls, and maps the error. No algorithm lives here.
#![forbid(unsafe_code)]
#![allow(missing_docs, unreachable_pub, reason = "docstrings are Python's; the crate has no Rust callers")]
#![allow(
    clippy::doc_markdown,
    clippy::doc_link_with_quotes,
    clippy::doc_lazy_continuation,
    reason = "docstrings are Python's, in reStructuredText"
)]
#![allow(clippy::needless_pass_by_value, reason = "extracted arguments arrive by value")]
#![allow(clippy::unused_self, reason = "getters take self")]
#![allow(clippy::large_enum_variant, reason = "the larger variant, spatial, is the usual one")]

mod convert;
mod force;
mod grasp;
mod planning;
mod quality;
mod runtime;
mod support_region;
mod surrogates;

use pyo3::prelude::*;

/// The compiled part of graspforce.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("TIE", graspforce::TIE)?;
    module.add_class::<grasp::PyGrasp>()?;
    module.add_class::<quality::PyQuality>()?;
    module.add_class::<quality::gradient::PyGradient>()?;
    module.add_class::<grasp::minkowski_sum::PyMinkowskiSum>()?;
    module.add_class::<force::distributor::PyForceDistributor>()?;
    module.add_class::<force::solution::PyForceSolution>()?;
    module.add_class::<force::batch::PyForceBatch>()?;
    module.add_class::<force::solve_iter::PyForceSteps>()?;
    module.add_class::<quality::batch::PyQualityBatch>()?;
    module.add_class::<planning::candidate_search::PyCandidateSearch>()?;
    module.add_class::<planning::box_bound::PyBoxBound>()?;
    module.add_class::<planning::product_bound::PyProductBound>()?;
    module.add_class::<planning::triangle_tree::PyTriangleTree>()?;
    // Not among the module's public names.
    module.setattr("unwarned_grasp", wrap_pyfunction!(grasp::unwarned_grasp, module)?)?;
    module.setattr("unwarned_grasp_of", wrap_pyfunction!(grasp::unwarned_grasp_of, module)?)?;
    module.setattr("least_friction", wrap_pyfunction!(quality::least_friction::least_friction, module)?)?;
    module.setattr(
        "least_friction_many",
        wrap_pyfunction!(quality::least_friction::least_friction_many, module)?,
    )?;
    module.setattr("support_region", wrap_pyfunction!(support_region::support_region, module)?)?;
    module.setattr("polygon_margins", wrap_pyfunction!(support_region::polygon_margins, module)?)?;
    module.setattr("forces_many_arrays", wrap_pyfunction!(force::many::forces_many, module)?)?;
    module.setattr("surrogate_arrays", wrap_pyfunction!(surrogates::surrogate_arrays, module)?)?;
    module.add_function(wrap_pyfunction!(grasp::torque_limits::torque_limited_forces, module)?)?;
    module.add_function(wrap_pyfunction!(quality::batch::quality_many, module)?)
}
