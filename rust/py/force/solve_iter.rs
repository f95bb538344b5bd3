//! The iterator that `graspforce.ForceDistributor.solve_iter` returns.

use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyTuple};

use crate::force::distributor::PyForceDistributor;
use crate::force::solution::PyForceSolution;

/// What `ForceDistributor.solve_iter` returns: an iterator of solutions.
///
/// One thread at a time takes from it. It can be copied and pickled where the wrenches' own iterator can: one of a
/// list, not a generator.
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

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let solve_iter = this.distributor.bind(py).getattr("solve_iter")?;
        Ok((solve_iter, (&this.wrenches,).into_pyobject(py)?))
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyForceSolution>> {
        let mut wrenches = self.wrenches.bind(py).clone();
        match wrenches.next() {
            None => Ok(None),
            Some(wrench) => self.distributor.get().solve(py, &wrench?).map(Some),
        }
    }
}
