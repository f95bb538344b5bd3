//! `graspforce.Gradient`.

use graspforce::{Gradient, Grasp, QualityOptions, QualityWorkspace};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::convert::arrays::{matrix, read_only, vector};
use crate::convert::errors::{invalid_input, to_python};
use crate::convert::restored::{Checked, expect, finite, within};
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_work};
use crate::runtime::workspace::Workspace;

/// How epsilon changes as contacts do.
///
/// It is immutable and may be shared between threads, copied and pickled.
///
/// Attributes
/// ----------
/// positions : numpy.ndarray
///     (m, dim) change of epsilon by m of displacement of each contact.
/// normals : numpy.ndarray
///     (m, dim) change of epsilon by rad that each normal turns, orthogonal to it; the contact frame turns with
///     it by the smallest rotation.
/// spins : numpy.ndarray
///     (m,) change of epsilon by rad that each contact frame spins about its normal: edges turn with it. Zero for
///     planar contacts, and for true cones.
/// friction : numpy.ndarray
///     (m,) change of epsilon by each friction coefficient (before ``friction_margin``), to the right where it is zero. Zero
///     where extreme forces are given.
/// max_normal_force : numpy.ndarray
///     (m,) change of epsilon by N of each limit. Zero where extreme forces are given.
/// unique : bool
///     True where epsilon is differentiable, as far as rounding can tell. Where several directions are equally bad
///     (symmetric grasps), or several forces reach the same boundary wrench and would change otherwise, it is False,
///     and this is one element of the subdifferential.
#[pyclass(name = "Gradient", module = "graspforce", frozen)]
pub struct PyGradient {
    gradient: Gradient,
    dim: usize,
}

#[pymethods]
impl PyGradient {
    /// (m, dim) change of epsilon by m of displacement of each contact.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, &self.gradient.positions)
    }

    /// (m, dim) change of epsilon by rad that each normal turns.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, &self.gradient.normals)
    }

    /// (m,) change of epsilon by rad that each contact frame spins about its normal.
    #[getter]
    fn spins<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        vector(py, "spins", self.gradient.spins.len(), self.gradient.spins.iter().copied())
    }

    /// (m,) change of epsilon by each friction coefficient.
    #[getter]
    fn friction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        vector(py, "friction", self.gradient.friction.len(), self.gradient.friction.iter().copied())
    }

    /// (m,) change of epsilon by N of each limit.
    #[getter]
    fn max_normal_force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let values = &self.gradient.max_normal_force;
        vector(py, "max_normal_force", values.len(), values.iter().copied())
    }

    /// Whether epsilon is differentiable here.
    #[getter]
    fn unique(&self) -> bool {
        self.gradient.unique
    }

    /// Everything as plain Python numbers and lists, ready for JSON.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("gradient_dict", (slf,))
    }

    #[staticmethod]
    fn _restore(
        positions: Vec<[f64; 3]>,
        normals: Vec<[f64; 3]>,
        numbers: [Vec<f64>; 3],
        unique: bool,
        dim: usize,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let vectors = |rows: Vec<[f64; 3]>| rows.into_iter().map(Vector3::from).collect();
        let [spins, friction, max_normal_force] = numbers;
        let (positions, normals) = (vectors(positions), vectors(normals));
        let gradient = Gradient { positions, normals, spins, friction, max_normal_force, unique };
        check(&gradient, dim).map_err(|message| invalid_input(py, message))?;
        Ok(Self { gradient, dim })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let rows = |vectors: &[Vector3<f64>]| vectors.iter().map(|&v| v.into()).collect::<Vec<[f64; 3]>>();
        let Gradient { positions, normals, spins, friction, max_normal_force, unique } = &this.gradient;
        let numbers = [spins.clone(), friction.clone(), max_normal_force.clone()];
        let state = (rows(positions), rows(normals), numbers, *unique, this.dim);
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("gradient_html", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("Gradient({} contacts, unique={})", self.gradient.positions.len(), self.gradient.unique)
    }
}

impl PyGradient {
    /// The gradient of a quality asked with `options`.
    pub fn of<const D: usize>(
        py: Python<'_>,
        grasp: &Grasp<D>,
        options: &QualityOptions<D>,
    ) -> PyResult<Py<Self>>
    where
        QualityWorkspace<D>: Workspace,
    {
        check_work(py, grasp, Work::Gradient)?;
        let gradient =
            detached(py, || QualityWorkspace::<D>::with(|workspace| grasp.gradient(options, workspace)))?;
        let gradient = gradient.map_err(|error| to_python(py, &error))?;
        Py::new(py, Self { gradient, dim: if D == 3 { 2 } else { 3 } })
    }

    fn rows<'py>(&self, py: Python<'py>, vectors: &[Vector3<f64>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let values = vectors.iter().flat_map(|v| v.iter().copied().take(self.dim));
        matrix(py, vectors.len(), self.dim, values).map(read_only)
    }
}

/// Refuses a record whose parts do not belong together.
fn check(gradient: &Gradient, dim: usize) -> Checked {
    let Gradient { positions, normals, spins, friction, max_normal_force, .. } = gradient;
    within("dim", dim, 2..=3)?;
    let lengths = [positions.len(), normals.len(), spins.len(), friction.len(), max_normal_force.len()];
    expect(lengths == [lengths[0]; 5], "rows", format!("{lengths:?}"), "one of each for each contact")?;
    for numbers in [spins, friction, max_normal_force] {
        finite("numbers", numbers)?;
    }
    for vectors in [positions, normals] {
        finite("vectors", vectors.iter().flatten())?;
        let planar = dim == 3 || vectors.iter().all(|vector| vector.z == 0.0);
        expect(planar, "vectors", "with a third component", "two in the plane")?;
    }
    Ok(())
}
