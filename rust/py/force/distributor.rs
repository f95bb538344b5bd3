//! `graspforce.ForceDistributor`.

use std::sync::{RwLock, RwLockReadGuard, TryLockError};

use graspforce::{DistributionOptions, ForceDistributor, Method, check_room};
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};

use crate::convert::arrays::{contents, float_array, read_only, shaped};
use crate::convert::dimension::AnyGrasp;
use crate::convert::errors::{busy, invalid_input, to_python};
use crate::convert::quality_options::parse_criterion;
use crate::force::batch::PyForceBatch;
use crate::force::shared::SharedDistributor;
use crate::force::solution::PyForceSolution;
use crate::force::solve::{solve, solve_into, solve_many};
use crate::force::solve_iter::PyForceSteps;
use crate::grasp::PyGrasp;
use crate::runtime::interrupt::{detached, keep};

#[derive(Clone)]
enum Any {
    Planar(SharedDistributor<3>),
    Spatial(SharedDistributor<6>),
}

/// Runs the same expression on a distributor of either dimension.
macro_rules! with_distributor {
    ($any:expr, $distributor:ident => $body:expr) => {
        match $any {
            Any::Planar($distributor) => $body,
            Any::Spatial($distributor) => $body,
        }
    };
}

impl Any {
    fn update(&mut self, grasp: &AnyGrasp) -> Option<graspforce::Result<()>> {
        match (self, grasp) {
            (Self::Planar(distributor), AnyGrasp::Planar(grasp)) => Some(distributor.update(grasp)),
            (Self::Spatial(distributor), AnyGrasp::Spatial(grasp)) => Some(distributor.update(grasp)),
            _ => None,
        }
    }
}

/// What `update` replaces.
struct State {
    inner: Any,
    grasp: Py<PyGrasp>,
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
/// method : {"implicit", "enumerated", "reduced"}, optional
///     "implicit" is a simplex method that asks the support oracle for its columns. "enumerated" is the paper's:
///     all points of the wrench set listed in advance, ``z_b`` of Eq. 26 by an interior-point solver, forces
///     from the points on its hyperplane. "reduced" keeps only the points that ``samples`` need, completed until
///     the origin is interior (section 4.2), and asks the whole set where these do not suffice. The answers agree.
/// weight : float, optional
///     With "max": minimise the maximum plus ``weight`` times the sum, a family that leads from one objective to
///     the other. Zero means the maximum and, among its optima, the least sum; at most 1e6.
/// min_normal : float or array_like, optional
///     Lower bounds on the normalised normal forces ``f_n / f^U``, one for all contacts or (m,), so that no finger
///     loses contact. The forces are then not proportional to the wrench, and no wrench at all needs some, too.
///     Only with "implicit"; zero for contacts with ``extreme_forces``.
/// samples : array_like, optional
///     (S, d) external wrenches that choose the points of "reduced"; only with it.
/// rtol : float, optional
///     Largest relative gap between the objective and its proven lower bound. True cones (``edges=None``) take
///     the longer the smaller it is; 1e-6 is enough for control. Where limits, or the strengths of directions, are
///     spread over so many orders that double precision cannot keep it, it is what rounding leaves, at most 1e-6.
///
/// Raises
/// ------
/// InvalidInputError
///     An option is unknown or out of range.
/// InvalidGraspError
///     "enumerated" or "reduced", and a contact has its true cone, which has no finite set.
/// TooLargeError
///     "enumerated" or "reduced" would list too many points.
///
/// Notes
/// -----
/// The forces are nonnegative combinations of extreme forces up to rounding: no coefficient is below -1e-9 of the
/// objective. The pseudoinverse of Eqs. 27 to 29 does not have this property where more than d points lie on one
/// supporting hyperplane, the normal case in space, and is not used. Every answer is checked at its own wrench (signs,
/// balance, gap); what fails raises `NotConvergedError`.
///
/// With ``extreme_forces`` "normalised normal force" means the sum of a contact's coefficients, whatever their normal
/// forces are.
///
/// The forces depend on the wrench alone: where objective and tie-break leave a choice, the least
/// ``sum |f_i|^2 / f_i^U^2`` decides. Over linearised cones they are continuous along a continuous path of wrenches.
/// Over true cones they are the same to 1e-9 whatever was solved before, but for a few wrenches of symmetric grasps
/// where contacts are about to slip or to lift off; the guide on forces counts them.
///
/// Two threads that use one distributor at once get right answers or a `BusyError`, never a wait. Copies and pickles
/// start without a basis; `copy.copy` shares what does not change while solving.
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
    state: RwLock<State>,
    /// "max" or "sum".
    #[pyo3(get)]
    objective: &'static str,
    /// "implicit", "enumerated" or "reduced".
    #[pyo3(get)]
    method: &'static str,
    /// Weight of the sum beside the maximum.
    #[pyo3(get)]
    weight: f64,
    min_normal: Vec<f64>,
    samples: Vec<Vec<f64>>,
    /// Largest relative gap that counts as solved.
    #[pyo3(get)]
    rtol: f64,
}

#[pymethods]
impl PyForceDistributor {
    #[new]
    #[pyo3(signature = (grasp, objective="max", method="implicit", weight=0.0, min_normal=None, samples=None, rtol=1e-9))]
    #[allow(clippy::too_many_arguments, reason = "the contract with Python")]
    fn new(
        py: Python<'_>,
        grasp: Py<PyGrasp>,
        objective: &str,
        method: &str,
        weight: f64,
        min_normal: Option<&Bound<'_, PyAny>>,
        samples: Option<&Bound<'_, PyAny>>,
        rtol: f64,
    ) -> PyResult<Self> {
        let criterion =
            parse_criterion("objective", objective).map_err(|message| invalid_input(py, message))?;
        let (method, name) = match method {
            "implicit" => (Method::Implicit, "implicit"),
            "enumerated" => (Method::Enumerated, "enumerated"),
            "reduced" => (Method::Reduced, "reduced"),
            other => {
                let message =
                    format!("method: {other:?} is none of \"implicit\", \"enumerated\" and \"reduced\"");
                return Err(invalid_input(py, message));
            }
        };
        let mut options = DistributionOptions::default();
        options.method = method;
        options.weight = weight;
        options.rtol = rtol;
        if let Some(min_normal) = min_normal {
            let contacts = grasp.get().num_contacts();
            options.min_normal =
                lower_bounds(min_normal, contacts).map_err(|message| invalid_input(py, message))?;
        }
        if let Some(samples) = samples {
            options.samples = rows("samples", samples).map_err(|message| invalid_input(py, message))?;
        }
        let (samples, min_normal) = (options.samples.clone(), options.min_normal.clone());
        let inner = detached(py, || match &grasp.get().inner {
            AnyGrasp::Planar(g) => ForceDistributor::with_options(g, criterion, options)
                .map(|distributor| Any::Planar(SharedDistributor::new(distributor))),
            AnyGrasp::Spatial(g) => ForceDistributor::with_options(g, criterion, options)
                .map(|distributor| Any::Spatial(SharedDistributor::new(distributor))),
        })?;
        let inner = inner.map_err(|error| to_python(py, &error))?;
        let objective = if objective == "max" { "max" } else { "sum" };
        Ok(Self {
            state: RwLock::new(State { inner, grasp }),
            objective,
            method: name,
            weight,
            min_normal,
            samples,
            rtol,
        })
    }

    /// The grasp whose forces are distributed.
    #[getter]
    fn grasp(&self, py: Python<'_>) -> PyResult<Py<PyGrasp>> {
        Ok(self.state(py)?.grasp.clone_ref(py))
    }

    /// (m,) lower bounds on the normalised normal forces; ``None`` without.
    #[getter]
    fn min_normal<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        Ok(match self.min_normal[..] {
            [] => None,
            [all] => {
                let contacts = self.state(py)?.grasp.get().num_contacts();
                Some(read_only(PyArray1::from_vec(py, vec![all; contacts])))
            }
            ref each => Some(read_only(PyArray1::from_slice(py, each))),
        })
    }

    /// Indices of the points that "reduced" keeps, into `Grasp.minkowski_sum`; ``None`` with other methods.
    #[getter]
    fn reduced_points<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<u32>>>> {
        let state = self.state(py)?;
        let points = with_distributor!(&state.inner, shared => shared.distributor.reduced_points());
        Ok(points.map(|points| read_only(PyArray1::from_slice(py, points))))
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
    /// NotConvergedError
    ///     Rounding leaves no answer that balances the wrench and meets the tolerance.
    /// BusyError
    ///     Another thread is using this distributor.
    pub fn solve(&self, py: Python<'_>, external_wrench: &Bound<'_, PyAny>) -> PyResult<PyForceSolution> {
        let state = self.state(py)?;
        let grasp = state.grasp.clone_ref(py);
        Ok(match &state.inner {
            Any::Planar(of) => PyForceSolution::planar(grasp, solve(py, of, external_wrench)?),
            Any::Spatial(of) => PyForceSolution::spatial(grasp, solve(py, of, external_wrench)?),
        })
    }

    /// The same, written into an array of the caller's: for control loops.
    ///
    /// Parameters
    /// ----------
    /// external_wrench : array_like
    ///     (d,) wrench on the object; a float64 array is read without a copy.
    /// forces : numpy.ndarray
    ///     (m, k) C-contiguous float64 array for the forces in the contact frames. Untouched on an error.
    ///
    /// Returns
    /// -------
    /// float
    ///     The objective: ``sigma_max``, ``sigma_sum``, or their weighted sum.
    ///
    /// Raises
    /// ------
    /// InfeasibleWrenchError, InvalidInputError, NotConvergedError, BusyError
    ///     As `solve` does.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> import numpy as np
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> distributor = gf.ForceDistributor(grasp, "max")
    /// >>> forces = np.empty((2, 2))
    /// >>> round(distributor.solve_into(np.array([0.0, -1.0, 0.0]), forces), 9)
    /// 0.25
    /// >>> forces.round(9).tolist()
    /// [[1.0, 0.5], [1.0, -0.5]]
    fn solve_into(
        &self,
        py: Python<'_>,
        external_wrench: &Bound<'_, PyAny>,
        forces: &Bound<'_, PyAny>,
    ) -> PyResult<f64> {
        let state = self.state(py)?;
        with_distributor!(&state.inner, distributor => solve_into(py, distributor, external_wrench, forces))
    }

    /// Least contact forces for many wrenches in one call.
    ///
    /// Parameters
    /// ----------
    /// external_wrenches : array_like
    ///     (T, d) wrenches. Along a trajectory each row starts from the one before.
    /// parallel : bool, optional
    ///     Cut the rows into chunks for all cores, for wrenches that have nothing to do with each other.
    ///
    /// Returns
    /// -------
    /// ForceBatch
    ///     Arrays over the rows. Rows that cannot be solved say so in ``status`` and hold NaN.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> batch = gf.ForceDistributor(grasp).solve_many([[0, -1, 0], [0, -2, 0]])
    /// >>> batch.sigma_max.round(9).tolist(), batch.status.tolist(), batch.forces.shape
    /// ([0.25, 0.5], [0, 0], (2, 2, 2))
    #[pyo3(signature = (external_wrenches, parallel=false))]
    fn solve_many(
        &self,
        py: Python<'_>,
        external_wrenches: &Bound<'_, PyAny>,
        parallel: bool,
    ) -> PyResult<PyForceBatch> {
        let state = self.state(py)?;
        with_distributor!(&state.inner, distributor => solve_many(py, distributor, external_wrenches, parallel))
    }

    /// Solves for each wrench that an iterable yields, when it yields it.
    ///
    /// Parameters
    /// ----------
    /// external_wrenches : iterable of array_like
    ///     (d,) wrenches, for instance from a generator that reads a sensor.
    ///
    /// Returns
    /// -------
    /// iterator of ForceSolution
    ///     One solution for each wrench; a wrench that cannot be balanced raises when its turn comes.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> weights = ([0, -weight, 0] for weight in (1, 2))
    /// >>> [round(s.sigma_max, 9) for s in gf.ForceDistributor(grasp).solve_iter(weights)]
    /// [0.25, 0.5]
    fn solve_iter(slf: Py<Self>, external_wrenches: &Bound<'_, PyAny>) -> PyResult<PyForceSteps> {
        Ok(PyForceSteps { distributor: slf.into_any(), wrenches: external_wrenches.try_iter()?.unbind() })
    }

    /// Goes on with another grasp, in which contacts have rolled or slid a little.
    ///
    /// The answers are those of a new distributor; over linearised cones without ``min_normal`` the last basis is kept
    /// where contacts and edges are as many as before, which makes the next solve cheaper.
    ///
    /// Parameters
    /// ----------
    /// grasp : Grasp
    ///     Of the same dimension.
    fn update(&self, py: Python<'_>, grasp: Py<PyGrasp>) -> PyResult<()> {
        let mut state = match self.state.try_write() {
            Ok(state) => state,
            Err(TryLockError::WouldBlock) => return Err(busy(py)),
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        };
        let inner = &mut state.inner;
        match detached(py, || inner.update(&grasp.get().inner))? {
            Some(updated) => updated.map_err(|error| to_python(py, &error))?,
            None => return Err(invalid_input(py, "grasp: its dimension is not this distributor's")),
        }
        state.grasp = grasp;
        Ok(())
    }

    /// Its grasp and its options as plain Python numbers and lists, ready for JSON.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("distributor_dict", (slf,))
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        let state = self.state(py)?;
        let state = State { inner: state.inner.clone(), grasp: state.grasp.clone_ref(py) };
        let (objective, method) = (self.objective, self.method);
        let (weight, samples, rtol) = (self.weight, self.samples.clone(), self.rtol);
        let min_normal = self.min_normal.clone();
        Ok(Self { state: RwLock::new(state), objective, method, weight, min_normal, samples, rtol })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyType>, Bound<'py, PyTuple>)> {
        let samples = (!self.samples.is_empty()).then(|| self.samples.clone());
        let min_normal = match self.min_normal[..] {
            [] => None,
            [all] => Some(all.into_pyobject(py)?.into_any()),
            ref each => Some(each.into_pyobject(py)?.into_any()),
        };
        let arguments =
            (self.grasp(py)?, self.objective, self.method, self.weight, min_normal, samples, self.rtol);
        Ok((py.get_type::<Self>(), arguments.into_pyobject(py)?))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let state = self.state(py)?;
        let grasp = state.grasp.bind(py).repr().map_or_else(|_| "Grasp".into(), |text| text.to_string());
        Ok(format!("ForceDistributor({grasp}, objective='{}', method='{}')", self.objective, self.method))
    }
}

impl PyForceDistributor {
    fn state(&self, py: Python<'_>) -> PyResult<RwLockReadGuard<'_, State>> {
        match self.state.try_read() {
            Ok(state) => Ok(state),
            Err(TryLockError::WouldBlock) => Err(busy(py)),
            // An update that panicked changed nothing.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        }
    }
}

/// One number for all contacts, or one for each.
fn lower_bounds(value: &Bound<'_, PyAny>, contacts: usize) -> Result<Vec<f64>, String> {
    let array = float_array("min_normal", value)?;
    match (array.shape(), contents(&array)) {
        ([], &[bound]) => Ok(vec![bound]),
        ([m], bounds) if *m == contacts => Ok(bounds.to_vec()),
        (given, _) => Err(format!("min_normal: shape {}, expected a number or ({contacts},)", shaped(given))),
    }
}

fn rows(argument: &str, value: &Bound<'_, PyAny>) -> Result<Vec<Vec<f64>>, String> {
    let array = float_array(argument, value)?;
    match array.shape() {
        &[_, columns] if columns > 0 => {
            // Each row is an allocation of its own.
            let each = size_of::<Vec<f64>>() + size_of_val(contents(&array)) / array.shape()[0].max(1) + 16;
            check_room("samples", array.shape()[0], each).map_err(|error| {
                keep(to_python(value.py(), &error));
                error.to_string()
            })?;
            Ok(contents(&array).chunks_exact(columns).map(<[f64]>::to_vec).collect())
        }
        given => Err(format!("{argument}: shape {}, expected (S, d)", shaped(given))),
    }
}
