//! The iterator that `graspforce.ForceDistributor.solve_iter` returns.

use std::sync::atomic::{AtomicUsize, Ordering};

use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyTuple};

use crate::convert::errors::say_which_row;

/// What `ForceDistributor.solve_iter` returns: an iterator of solutions.
///
/// One thread at a time takes from it. It can be copied and pickled where the wrenches' own iterator can: one of a
/// list, not a generator.
#[pyclass(name = "ForceSteps", module = "graspforce", frozen)]
pub struct PyForceSteps {
    /// A `ForceDistributor`.
    distributor: Py<PyAny>,
    wrenches: Py<PyIterator>,
    /// Wrenches that were taken.
    taken: AtomicUsize,
}

impl PyForceSteps {
    pub fn new(distributor: Py<PyAny>, wrenches: Py<PyIterator>) -> Self {
        Self { distributor, wrenches, taken: AtomicUsize::new(0) }
    }
}

#[pymethods]
impl PyForceSteps {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __setstate__(&self, taken: usize) {
        self.taken.store(taken, Ordering::Relaxed);
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>, usize)> {
        let (py, this) = (slf.py(), slf.get());
        let solve_iter = this.distributor.bind(py).getattr("solve_iter")?;
        Ok((solve_iter, (&this.wrenches,).into_pyobject(py)?, this.taken.load(Ordering::Relaxed)))
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let mut wrenches = self.wrenches.bind(py).clone();
        let Some(wrench) = wrenches.next().transpose()? else { return Ok(None) };
        let row = self.taken.fetch_add(1, Ordering::Relaxed);
        let solved = self.distributor.bind(py).call_method1("solve", (wrench,));
        solved
            .map(Some)
            .map_err(|error| say_which_row(py, error, "external_wrench", "external_wrenches", row))
    }
}
