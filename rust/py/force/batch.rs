//! `graspforce.ForceBatch`.

use graspforce::{DistributionBatch, Grasp};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::convert::arrays::{as_array, read_only, vector};
use crate::convert::errors::invalid_input;
use crate::convert::restored::{Checked, copied, expect, within};

/// Least contact forces for many wrenches.
///
/// Threads may share it; it can be copied and pickled. `numpy.asarray` gives its forces.
///
/// Attributes
/// ----------
/// forces : numpy.ndarray
///     (T, m, k) contact forces in the contact frames; NaN, as all other numbers, where there are none. Nearest forces
///     are there, but not converged, where ``gap`` is above ``rtol`` and 1e-9.
/// sigma_max : numpy.ndarray
///     (T,) largest normalised normal force (Eq. 7).
/// sigma_sum : numpy.ndarray
///     (T,) sum of normalised normal forces (Eq. 6).
/// residual : numpy.ndarray
///     (T, d) what the forces leave unbalanced, ``external_wrench + sum_i G_i f_i``.
/// balanced : numpy.ndarray
///     (T,) whether the residual is within `FEASIBILITY_TOLERANCE`; False where there are no forces.
/// distance : numpy.ndarray
///     (T,) norm of the residual, in that of the grasp's ``length_scale``.
/// gap : numpy.ndarray
///     (T,) relative gap between the objective and its proven lower bound; of nearest forces as in
///     `ForceDistributor.nearest`.
/// status : numpy.ndarray
///     (T,) int8 of `Status`: ``SOLVED`` (0), ``INFEASIBLE`` (1), ``INVALID`` (2, not finite, or too large or too small
///     to compute with) or ``NOT_CONVERGED`` (3).
#[pyclass(name = "ForceBatch", module = "graspforce", frozen)]
pub struct PyForceBatch {
    /// (T, m, k) contact forces in the contact frames; NaN where there are none.
    #[pyo3(get)]
    forces: Py<PyArray3<f64>>,
    /// (T,) largest normalised normal force (Eq. 7).
    #[pyo3(get)]
    sigma_max: Py<PyArray1<f64>>,
    /// (T,) sum of normalised normal forces (Eq. 6).
    #[pyo3(get)]
    sigma_sum: Py<PyArray1<f64>>,
    /// (T, d) what the forces leave unbalanced.
    #[pyo3(get)]
    residual: Py<PyArray2<f64>>,
    /// (T,) whether the residual is within `FEASIBILITY_TOLERANCE`.
    #[pyo3(get)]
    balanced: Py<PyArray1<bool>>,
    /// (T,) norm of the residual.
    #[pyo3(get)]
    distance: Py<PyArray1<f64>>,
    /// (T,) relative gap between the objective and its proven lower bound, or of nearest forces.
    #[pyo3(get)]
    gap: Py<PyArray1<f64>>,
    /// (T,) int8 of `Status`: 0 solved, 1 infeasible, 2 invalid, 3 not converged.
    #[pyo3(get)]
    status: Py<PyArray1<i8>>,
}

#[pymethods]
impl PyForceBatch {
    /// Everything as plain Python numbers and lists, ready for JSON; None in place of NaN.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("forces_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("forces_html", (slf,))
    }

    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        as_array(self.forces.bind(py).as_any(), dtype, copy)
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the state of a pickle, item by item")]
    fn _restore<'py>(
        forces: Bound<'py, PyArray3<f64>>,
        sigma_max: Bound<'py, PyArray1<f64>>,
        sigma_sum: Bound<'py, PyArray1<f64>>,
        residual: Bound<'py, PyArray2<f64>>,
        balanced: Bound<'py, PyArray1<bool>>,
        distance: Bound<'py, PyArray1<f64>>,
        gap: Bound<'py, PyArray1<f64>>,
        status: Bound<'py, PyArray1<i8>>,
        py: Python<'py>,
    ) -> PyResult<Self> {
        let components = forces.shape()[2];
        let ((numbers, forces), (largest, sigma_max)) = (copied(&forces)?, copied(&sigma_max)?);
        let ((sums, sigma_sum), (ends, status)) = (copied(&sigma_sum)?, copied(&status)?);
        let (rest, residual) = copied(&residual)?;
        let ((held, balanced), (lengths, distance)) = (copied(&balanced)?, copied(&distance)?);
        let (gaps, gap) = copied(&gap)?;
        let dim = residual.shape()[1];
        let rows = [largest.len(), sums.len(), ends.len(), residual.shape()[0], held.len(), lengths.len()];
        let check = || -> Checked {
            expect(rows == [gaps.len(); 6], "rows", format!("{rows:?}"), "as many of each")?;
            expect(gaps.len() == forces.shape()[0], "gap", gaps.len(), "as many as forces")?;
            within("components of a force", components, 2..=4)?;
            expect(matches!(dim, 3 | 6), "components of a wrench", dim, "3 or 6")?;
            let stride = forces.shape()[1] * components;
            for (row, &end) in ends.iter().enumerate() {
                within("status", end, 0..=3)?;
                let forces = &numbers[row * stride..(row + 1) * stride];
                let all = || {
                    forces.iter().chain(&rest[row * dim..(row + 1) * dim]).chain([
                        &largest[row],
                        &sums[row],
                        &lengths[row],
                        &gaps[row],
                    ])
                };
                let (known, none) = (all().all(|x| x.is_finite()), all().all(|x| x.is_nan()));
                // Nearest forces whose gap is too wide are there.
                let whole = (known && matches!(end, 0 | 3)) || (none && end != 0);
                expect(whole, "row", row, "numbers where the status is 0 or 3, NaN elsewhere")?;
                expect(known || !held[row], "row", row, "balanced only where the status is 0")?;
            }
            Ok(())
        };
        check().map_err(|message| invalid_input(py, message))?;
        Ok(Self {
            forces: forces.unbind(),
            sigma_max: sigma_max.unbind(),
            sigma_sum: sigma_sum.unbind(),
            residual: residual.unbind(),
            balanced: balanced.unbind(),
            distance: distance.unbind(),
            gap: gap.unbind(),
            status: status.unbind(),
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let Self { forces, sigma_max, sigma_sum, residual, balanced, distance, gap, status } = this;
        let state = (forces, sigma_max, sigma_sum, residual, balanced, distance, gap, status);
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.status.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let status = self.status.bind(py).try_readonly()?;
        let solved = status.as_array().iter().filter(|&&status| status == 0).count();
        let balanced = self.balanced.bind(py).try_readonly()?;
        let apart = solved - balanced.as_array().iter().filter(|&&balanced| balanced).count();
        let apart = if apart == 0 { String::new() } else { format!(", {apart} not balanced") };
        Ok(format!("ForceBatch({} wrenches, {solved} solved{apart})", status.len()))
    }
}

impl PyForceBatch {
    pub fn new<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, batch: DistributionBatch) -> PyResult<Self> {
        let shape = [batch.status.len(), grasp.num_contacts(), grasp.force_dim()];
        Ok(Self {
            forces: read_only(PyArray1::from_vec(py, batch.forces)).reshape(shape)?.unbind(),
            sigma_max: read_only(PyArray1::from_vec(py, batch.sigma_max)).unbind(),
            sigma_sum: read_only(PyArray1::from_vec(py, batch.sigma_sum)).unbind(),
            residual: read_only(PyArray1::from_vec(py, batch.residual)).reshape([shape[0], D])?.unbind(),
            balanced: read_only(PyArray1::from_vec(py, batch.balanced)).unbind(),
            distance: read_only(PyArray1::from_vec(py, batch.distance)).unbind(),
            gap: read_only(PyArray1::from_vec(py, batch.gap)).unbind(),
            status: vector(py, "status", shape[0], batch.status.iter().map(|&status| status as i8))?.unbind(),
        })
    }
}
