//! `graspforce.ForceDistributor` and its results.

use graspforce::{ContactForce, Distribution, DistributionOptions, ForceDistributor, Grasp, Method, Wrench};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::{float_vector, matrix};
use crate::errors::{invalid_input, to_python};
use crate::grasp::{AnyGrasp, PyGrasp};
use crate::quality::parse_criterion;

enum Any {
    Planar(ForceDistributor<3>),
    Spatial(ForceDistributor<6>),
}

/// Least contact forces for one grasp and any number of external wrenches.
///
/// Parameters
/// ----------
/// grasp : Grasp
///     Whose forces are distributed. Force closure is not needed: what its cones can balance is balanced.
/// objective : {"max", "sum"}, optional
///     Minimise the maximum of normalised normal forces (Eq. 7; among its optima, then the sum) or their sum
///     (Eq. 6).
/// method : {"implicit", "enumerated"}, optional
///     "implicit" is a simplex method that asks the support oracle for its columns. "enumerated" is the paper's:
///     all points of the wrench set listed in advance, ``z_b`` of Eq. 26 by an interior-point solver, forces
///     from the points on its hyperplane. The answers agree.
/// tol : float, optional
///     Largest relative gap between the objective and its proven lower bound.
///
/// Raises
/// ------
/// InvalidInputError
///     An option is unknown or out of range.
/// InvalidGraspError
///     A contact has its true cone, which has no finite set.
/// TooLargeError
///     "enumerated" would list too many points.
///
/// Notes
/// -----
/// The forces are always a basic solution of the linear program, so no component of it is negative. The
/// pseudoinverse of Eqs. 27 to 29 does not have this property where more than d points lie on one supporting
/// hyperplane, the normal case in space, and is not used.
///
/// Two threads that use one distributor at once get right answers or a `BusyError`, never a wait.
///
/// Examples
/// --------
/// Two fingers squeeze a disc and carry 1 N of weight.
///
/// >>> import graspforce as gf
/// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
/// >>> s = gf.ForceDistributor(grasp, "max").solve([0, -1, 0])
/// >>> round(s.sigma_max, 9)
/// 0.25
/// >>> s.forces.round(9).tolist()
/// [[1.0, 0.5], [1.0, -0.5]]
#[pyclass(name = "ForceDistributor", module = "graspforce", frozen)]
pub struct PyForceDistributor {
    inner: Any,
    grasp: Py<PyGrasp>,
    /// "max" or "sum".
    #[pyo3(get)]
    objective: &'static str,
    /// "implicit" or "enumerated".
    #[pyo3(get)]
    method: &'static str,
}

#[pymethods]
impl PyForceDistributor {
    #[new]
    #[pyo3(signature = (grasp, objective="max", method="implicit", tol=1e-9))]
    fn new(py: Python<'_>, grasp: Py<PyGrasp>, objective: &str, method: &str, tol: f64) -> PyResult<Self> {
        let criterion =
            parse_criterion("objective", objective).map_err(|message| invalid_input(py, message))?;
        let (method, name) = match method {
            "implicit" => (Method::Implicit, "implicit"),
            "enumerated" => (Method::Enumerated, "enumerated"),
            other => {
                let message = format!("method: {other:?} is neither \"implicit\" nor \"enumerated\"");
                return Err(invalid_input(py, message));
            }
        };
        let mut options = DistributionOptions::default();
        options.method = method;
        options.tolerance = tol;
        let inner = py.detach(|| match &grasp.get().inner {
            AnyGrasp::Planar(g) => ForceDistributor::with_options(g, criterion, options).map(Any::Planar),
            AnyGrasp::Spatial(g) => ForceDistributor::with_options(g, criterion, options).map(Any::Spatial),
        });
        let inner = inner.map_err(|error| to_python(py, &error))?;
        let objective = if objective == "max" { "max" } else { "sum" };
        Ok(Self { inner, grasp, objective, method: name })
    }

    /// The grasp whose forces are distributed.
    #[getter]
    fn grasp(&self, py: Python<'_>) -> Py<PyGrasp> {
        self.grasp.clone_ref(py)
    }

    /// Least contact forces that balance an external wrench (Eq. 11).
    ///
    /// Parameters
    /// ----------
    /// external_wrench : array_like
    ///     (d,) wrench on the object, in N and N m about the grasp's origin.
    ///
    /// Returns
    /// -------
    /// ForceSolution
    ///     Forces with ``sum_i G_i f_i = -external_wrench``, and their certificate.
    ///
    /// Raises
    /// ------
    /// InfeasibleWrenchError
    ///     No forces inside the friction cones balance the wrench, however strong they are; ``direction`` holds
    ///     the witness.
    /// InvalidInputError
    ///     The wrench has the wrong shape or is not finite.
    /// BusyError
    ///     Another thread is using this distributor.
    fn solve(&self, py: Python<'_>, external_wrench: &Bound<'_, PyAny>) -> PyResult<PyForceSolution> {
        match &self.inner {
            Any::Planar(distributor) => solve(py, &self.grasp, distributor, external_wrench),
            Any::Spatial(distributor) => solve(py, &self.grasp, distributor, external_wrench),
        }
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let grasp = self.grasp.bind(py).repr().map_or_else(|_| "Grasp".into(), |text| text.to_string());
        format!("ForceDistributor({grasp}, objective='{}', method='{}')", self.objective, self.method)
    }
}

fn solve<const D: usize>(
    py: Python<'_>,
    grasp: &Py<PyGrasp>,
    distributor: &ForceDistributor<D>,
    external_wrench: &Bound<'_, PyAny>,
) -> PyResult<PyForceSolution> {
    let wrench =
        float_vector("external_wrench", external_wrench, D).map_err(|message| invalid_input(py, message))?;
    let wrench = Wrench::<D>::from_column_slice(&wrench);
    let distribution = distributor.solve(&wrench).map_err(|error| to_python(py, &error))?;
    Ok(PyForceSolution::new(py, grasp, distributor.grasp(), distribution))
}

/// Least contact forces for one external wrench, with their certificate.
///
/// Attributes
/// ----------
/// forces : numpy.ndarray
///     (m, k) contact forces in the contact frames, ``[n, (o,) t, (torsion)]``, in N (torsion in N m).
/// world_forces : numpy.ndarray
///     (m, dim) the same in world axes, without torsion.
/// contact_wrenches : numpy.ndarray
///     (m, d) wrench of each contact; they sum to ``-external_wrench``.
/// sigma_max, sigma_sum : float
///     Largest normalised normal force (Eq. 7) and their sum (Eq. 6).
/// dual : numpy.ndarray
///     (d,) ``z_b`` of Eq. 26: the objective changes by ``-dual`` with the external wrench.
/// gap : float
///     Relative distance between the objective and the lower bound that ``dual`` proves.
/// pivots : int
///     Simplex pivots this solve took.
/// within_limits : bool
///     ``sigma_max <= 1``: no normal force exceeds its upper bound.
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

    /// (m,) unused share of each contact's friction.
    #[getter]
    fn slip_margin<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.slip_margin)
    }

    fn __repr__(&self) -> String {
        format!(
            "ForceSolution(sigma_max={:.6}, sigma_sum={:.6}, gap={:.1e})",
            self.sigma_max, self.sigma_sum, self.gap
        )
    }
}

impl PyForceSolution {
    fn new<const D: usize>(
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
            sigma_max: distribution.sigma_max,
            sigma_sum: distribution.sigma_sum,
            gap: distribution.gap,
            pivots: distribution.pivots,
            within_limits: distribution.within_limits(),
            forces: distribution.forces,
        }
    }
}
