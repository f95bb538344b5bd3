//! Calls of a distributor that find the forces nearest to balance.

use graspforce::{Distribution, ForceDistributor, Metric, NearestOptions, Wrench};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;

use crate::convert::errors::{invalid_input, to_python};
use crate::convert::quality_options::parse_metric;
use crate::force::shared::{SharedDistributor, unless_busy};
use crate::force::solve::written;
use crate::runtime::interrupt::watched;
use crate::runtime::memory::{Work, check_work};

/// The options of `nearest`, or what is wrong with them.
pub fn nearest_options<const D: usize>(
    metric: Option<&Bound<'_, PyAny>>,
    limits: bool,
) -> Result<NearestOptions<D>, String> {
    let matrix = metric.map(parse_metric).transpose()?;
    let metric = matrix.as_ref().map(Metric::from_matrix).transpose().map_err(|error| error.to_string())?;
    Ok(NearestOptions { metric, limits })
}

/// The forces that come nearest to balancing one wrench.
pub fn nearest<const D: usize>(
    py: Python<'_>,
    shared: &SharedDistributor<D>,
    external_wrench: &[f64],
    metric: Option<&Bound<'_, PyAny>>,
    limits: bool,
) -> PyResult<Distribution<D>> {
    let refused = |message: String| invalid_input(py, message);
    let wrench = Wrench::<D>::from_column_slice(external_wrench);
    let options = nearest_options(metric, limits).map_err(refused)?;
    check_work(py, shared.distributor.grasp(), Work::Nearest)?;
    let work = || shared.solve(|distributor, workspace| distributor.nearest(workspace, &wrench, &options));
    unless_busy(py, watched(work)?)?.map_err(|error| to_python(py, &error))
}

/// The same, written into an array of the caller's; returns the distance, and the gap if asked for.
pub fn nearest_into<'py, const D: usize>(
    py: Python<'py>,
    shared: &SharedDistributor<D>,
    external_wrench: &Bound<'py, PyAny>,
    forces: &Bound<'py, PyAny>,
    metric: Option<&Bound<'py, PyAny>>,
    (limits, with_gap): (bool, bool),
) -> PyResult<Bound<'py, PyAny>> {
    let options = nearest_options(metric, limits).map_err(|message| invalid_input(py, message))?;
    let solve = |distributor: &ForceDistributor<D>, workspace: &mut _, wrench: &_, rows: &mut _| {
        distributor.nearest_into_with_gap(workspace, wrench, &options, rows)
    };
    let found = written(py, shared, (external_wrench, forces), Work::Nearest, solve)?
        .map_err(|error| to_python(py, &error))?;
    if with_gap { found.into_bound_py_any(py) } else { found.0.into_bound_py_any(py) }
}
