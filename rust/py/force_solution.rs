//! `graspforce.ForceSolution`.

use graspforce::{ContactForce, Distribution, Grasp};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{as_array, matrix};
use crate::errors::invalid_input;
use crate::grasp::{AnyGrasp, PyGrasp};

/// Least contact forces for one external wrench, with their certificate.
///
/// It is immutable and may be shared between threads, copied and pickled; `numpy.asarray` gives its forces.
///
/// Attributes
/// ----------
/// forces : numpy.ndarray
///     (m, k) contact forces in the contact frames, ``[n, (o,) t, (torsion)]``, in N (torsion in N m).
/// world_forces : numpy.ndarray
///     (m, dim) the same in world axes, without torsion.
/// contact_wrenches : numpy.ndarray
///     (m, d) wrench of each contact; they sum to ``-external_wrench``.
/// shares : numpy.ndarray
///     (m,) normalised normal force of each contact, ``f_n / f^U``: its share of its limit. With ``extreme_forces``
///     it is the sum of the coefficients of its extreme forces.
/// sigma_max, sigma_sum : float
///     Largest of the shares (Eq. 7) and their sum (Eq. 6).
/// dual : numpy.ndarray
///     (d,) ``z_b`` of Eq. 26: the objective changes by ``-dual`` with the external wrench.
/// gap : float
///     Relative distance between the objective and the lower bound that ``dual`` proves.
/// pivots : int
///     Simplex pivots this solve took; 0 where a known region held the wrench.
/// fell_back : bool
///     "reduced" had to ask the whole set for this answer, or over true cones an interior-point solver gave it.
/// unique : bool
///     The objective and its tie-break alone are known to determine the forces. Forces that extreme forces can
///     make in several ways (soft fingers) do not count as such.
/// within_limits : bool
///     ``sigma_max <= 1``: no contact's share exceeds one.
/// slip_margin : numpy.ndarray
///     (m,) unused share of each contact's friction (before ``friction_margin``): 1 for a purely normal force, 0
///     on the edge of slip; NaN for general extreme forces.
#[pyclass(name = "ForceSolution", module = "graspforce", frozen)]
pub struct PyForceSolution {
    grasp: Py<PyGrasp>,
    forces: Vec<ContactForce>,
    components: &'static [usize],
    world_forces: Vec<f64>,
    contact_wrenches: Vec<f64>,
    slip_margin: Vec<f64>,
    dual: Vec<f64>,
    shares: Vec<f64>,
    /// Largest normalised normal force (Eq. 7).
    #[pyo3(get)]
    sigma_max: f64,
    /// Sum of normalised normal forces (Eq. 6).
    #[pyo3(get)]
    sigma_sum: f64,
    /// Relative distance between the objective and its proven lower bound.
    #[pyo3(get)]
    gap: f64,
    /// Simplex pivots this solve took.
    #[pyo3(get)]
    pivots: usize,
    /// Another solver than the method's own had to give this answer.
    #[pyo3(get)]
    fell_back: bool,
    /// The objective and its tie-break alone determine the forces.
    #[pyo3(get)]
    unique: bool,
    /// ``sigma_max <= 1``: no normal force exceeds its upper bound.
    #[pyo3(get)]
    within_limits: bool,
}

#[pymethods]
impl PyForceSolution {
    /// The grasp that exerts the forces.
    #[getter]
    fn grasp(&self, py: Python<'_>) -> Py<PyGrasp> {
        self.grasp.clone_ref(py)
    }

    /// (m, k) contact forces in the contact frames, in N (torsion in N m).
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let values = self.forces.iter().flat_map(|force| self.components.iter().map(|&row| force[row]));
        matrix(py, self.forces.len(), self.components.len(), values)
    }

    /// (m, dim) contact forces in world axes, without torsion, in N.
    #[getter]
    fn world_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, values) = (self.forces.len(), &self.world_forces);
        matrix(py, rows, values.len() / rows, values.iter().copied())
    }

    /// (m, d) wrench of each contact; they sum to the opposite of the external wrench.
    #[getter]
    fn contact_wrenches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, values) = (self.forces.len(), &self.contact_wrenches);
        matrix(py, rows, values.len() / rows, values.iter().copied())
    }

    /// (d,) ``z_b`` of Eq. 26: the objective changes by ``-dual`` with the external wrench.
    #[getter]
    fn dual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.dual)
    }

    /// (m,) normalised normal force of each contact: its share of its limit.
    #[getter]
    fn shares<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.shares)
    }

    /// (m,) unused share of each contact's friction.
    #[getter]
    fn slip_margin<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.slip_margin)
    }

    /// Everything as plain Python numbers and lists, ready for JSON; None in place of NaN.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.records")?.call_method1("solution_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.display")?.call_method1("solution_html", (slf,))
    }

    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // The forces are copied out in any case.
        as_array(self.forces(py)?.as_any(), dtype, copy.filter(|&copy| !copy))
    }

    #[staticmethod]
    fn _restore(
        py: Python<'_>,
        grasp: Py<PyGrasp>,
        forces: Vec<[f64; 4]>,
        vectors: [Vec<f64>; 5],
        numbers: (f64, f64, f64, usize),
        answers: (bool, bool, bool),
    ) -> PyResult<Self> {
        let [world_forces, contact_wrenches, slip_margin, dual, shares] = vectors;
        let (components, d, m) = match &grasp.get().inner {
            AnyGrasp::Planar(grasp) => (grasp.force_components(), 3, grasp.num_contacts()),
            AnyGrasp::Spatial(grasp) => (grasp.force_components(), 6, grasp.num_contacts()),
        };
        let lengths = [&world_forces, &contact_wrenches, &slip_margin, &dual, &shares].map(Vec::len);
        if forces.len() != m || lengths != [m * if d == 3 { 2 } else { 3 }, m * d, m, d, m] {
            return Err(invalid_input(py, format!("state: lengths {lengths:?} are not those of the grasp")));
        }
        Ok(Self {
            grasp,
            forces: forces.into_iter().map(ContactForce::from).collect(),
            components,
            world_forces,
            contact_wrenches,
            slip_margin,
            dual,
            shares,
            sigma_max: numbers.0,
            sigma_sum: numbers.1,
            gap: numbers.2,
            pivots: numbers.3,
            fell_back: answers.0,
            unique: answers.1,
            within_limits: answers.2,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let forces: Vec<[f64; 4]> = this.forces.iter().map(|&force| force.into()).collect();
        let vectors =
            [&this.world_forces, &this.contact_wrenches, &this.slip_margin, &this.dual, &this.shares];
        let numbers = (this.sigma_max, this.sigma_sum, this.gap, this.pivots);
        let answers = (this.fell_back, this.unique, this.within_limits);
        let state = (&this.grasp, forces, vectors.map(Clone::clone), numbers, answers);
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn __repr__(&self) -> String {
        format!(
            "ForceSolution(sigma_max={:.6}, sigma_sum={:.6}, gap={:.1e})",
            self.sigma_max, self.sigma_sum, self.gap
        )
    }
}

impl PyForceSolution {
    pub fn new<const D: usize>(
        py: Python<'_>,
        owner: &Py<PyGrasp>,
        grasp: &Grasp<D>,
        distribution: Distribution<D>,
    ) -> Self {
        let dim = if D == 3 { 2 } else { 3 };
        let world = distribution.world_forces(grasp);
        let wrenches = distribution.contact_wrenches(grasp);
        Self {
            grasp: owner.clone_ref(py),
            components: grasp.force_components(),
            world_forces: world.iter().flat_map(|force| force.iter().copied().take(dim)).collect(),
            contact_wrenches: wrenches.iter().flat_map(|wrench| wrench.iter().copied()).collect(),
            slip_margin: distribution.slip_margin(grasp),
            dual: distribution.dual.as_slice().to_vec(),
            shares: distribution.shares,
            sigma_max: distribution.sigma_max,
            sigma_sum: distribution.sigma_sum,
            gap: distribution.gap,
            pivots: distribution.pivots,
            unique: distribution.unique,
            fell_back: distribution.fell_back,
            within_limits: distribution.sigma_max <= 1.0,
            forces: distribution.forces,
        }
    }
}
