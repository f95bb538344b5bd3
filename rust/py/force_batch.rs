//! `graspforce.ForceBatch`.

use graspforce::{DistributionBatch, Grasp};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

/// Least contact forces for many wrenches.
///
/// Attributes
/// ----------
/// forces : numpy.ndarray
///     (T, m, k) contact forces in the contact frames; NaN where the status is not 0.
/// sigma_max, sigma_sum : numpy.ndarray
///     (T,) largest normalised normal force (Eq. 7) and their sum (Eq. 6).
/// status : numpy.ndarray
///     (T,) int8: 0 solved, 1 infeasible, 2 not finite, 3 tolerance not met.
#[pyclass(name = "ForceBatch", module = "graspforce", frozen)]
pub struct PyForceBatch {
    /// (T, m, k) contact forces in the contact frames; NaN where the status is not 0.
    #[pyo3(get)]
    forces: Py<PyArray3<f64>>,
    /// (T,) largest normalised normal force (Eq. 7).
    #[pyo3(get)]
    sigma_max: Py<PyArray1<f64>>,
    /// (T,) sum of normalised normal forces (Eq. 6).
    #[pyo3(get)]
    sigma_sum: Py<PyArray1<f64>>,
    /// (T,) int8: 0 solved, 1 infeasible, 2 not finite, 3 tolerance not met.
    #[pyo3(get)]
    status: Py<PyArray1<i8>>,
}

impl PyForceBatch {
    pub fn new<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, batch: DistributionBatch) -> PyResult<Self> {
        let shape = [batch.status.len(), grasp.num_contacts(), grasp.force_dim()];
        Ok(Self {
            forces: PyArray1::from_vec(py, batch.forces).reshape(shape)?.unbind(),
            sigma_max: PyArray1::from_vec(py, batch.sigma_max).unbind(),
            sigma_sum: PyArray1::from_vec(py, batch.sigma_sum).unbind(),
            status: PyArray1::from_iter(py, batch.status.iter().map(|status| *status as i8)).unbind(),
        })
    }
}
