//! Calls of a distributor that find the forces nearest to balance.

use graspforce::{Distribution, Metric, NearestOptions, Wrench};
use pyo3::prelude::*;

use crate::convert::arrays::{float_vector, output_array};
use crate::convert::errors::{invalid_input, to_python};
use crate::convert::quality_options::parse_metric;
use crate::force::shared::{SharedDistributor, unless_busy};
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

/// The same, written into an array of the caller's; returns the distance.
pub fn nearest_into<const D: usize>(
    py: Python<'_>,
    shared: &SharedDistributor<D>,
    external_wrench: &Bound<'_, PyAny>,
    forces: &Bound<'_, PyAny>,
    metric: Option<&Bound<'_, PyAny>>,
    limits: bool,
) -> PyResult<f64> {
    let refused = |message: String| invalid_input(py, message);
    let wrench = float_vector("external_wrench", external_wrench, D).map_err(refused)?;
    let wrench = Wrench::<D>::from_column_slice(&wrench);
    let options = nearest_options(metric, limits).map_err(refused)?;
    let grasp = shared.distributor.grasp();
    check_work(py, grasp, Work::Nearest)?;
    let (m, k) = (grasp.num_contacts(), grasp.force_dim());
    let mut forces = output_array(forces, m, k).map_err(refused)?;
    let Ok(forces) = forces.as_slice_mut() else { return Err(refused("forces: not C-contiguous".into())) };
    let work = || {
        shared.solve(|distributor, workspace| distributor.nearest_into(workspace, &wrench, &options, forces))
    };
    unless_busy(py, watched(work)?)?.map_err(|error| to_python(py, &error))
}
