//! The iterator that `graspforce.ForceDistributor.step` returns.

use pyo3::prelude::*;
use pyo3::types::PyIterator;

use crate::force_distributor::PyForceDistributor;
use crate::force_solution::PyForceSolution;

/// What `ForceDistributor.step` returns.
#[pyclass(name = "ForceSteps", module = "graspforce", frozen)]
pub struct PyForceSteps {
    pub distributor: Py<PyForceDistributor>,
    pub wrenches: Py<PyIterator>,
}

#[pymethods]
impl PyForceSteps {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyForceSolution>> {
        let mut wrenches = self.wrenches.bind(py).clone();
        match wrenches.next() {
            None => Ok(None),
            Some(wrench) => self.distributor.get().solve(py, &wrench?).map(Some),
        }
    }
}
