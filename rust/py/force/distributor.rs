//! `graspforce.ForceDistributor`.

use std::sync::{RwLock, RwLockReadGuard, TryLockError};

use graspforce::{Criterion, DistributionOptions, ForceDistributor, Grasp, Method, check_room};
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};

use crate::convert::arrays::{contents, float_array, float_vector, read_only, shaped};
use crate::convert::dimension::{AnyGrasp, by_dimension};
use crate::convert::errors::{busy, invalid_input, to_python};
use crate::force::batch::PyForceBatch;
use crate::force::nearest::{nearest, nearest_into};
use crate::force::shared::SharedDistributor;
use crate::force::solution::PyForceSolution;
use crate::force::solve::{solve, solve_into, solve_many};
use crate::force::solve_iter::PyForceSteps;
use crate::force::squares_arguments::SquaresArguments;
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

/// The class, its arguments, and limits that were set.
type Pickled<'py> = (Bound<'py, PyType>, Bound<'py, PyTuple>, Option<Vec<f64>>);

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
/// objective : {"max", "sum", "squares"}, optional
///     Minimise the maximum of normalised normal forces (Eq. 7; among its optima, then the sum), their sum (Eq. 6), or
///     ``sum_i weights_i |f_i - reference_i|^2 / 2`` in N (torsion in N m). The forces of "squares" are the only ones, and
///     change continuously with wrench, limits and reference.
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
/// reference : array_like, optional
///     (m, k) forces in the contact frames that "squares" stays close to; zero by default.
/// weights : float or array_like, optional
///     (m,) positive weights of "squares", or one for all; 1 by default.
/// slack : float or array_like, optional
///     Price S of what stays unbalanced: a number, (d,) for each component, or (d, d). "squares" then adds
///     ``residual @ S @ residual / 2`` to the objective, and every wrench has an answer.
/// limits : bool, optional
///     True cuts the cones of "squares" at ``max_normal_force``. A wrench that only stronger forces balance then raises
///     `InfeasibleWrenchError`, without ``slack``.
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
/// Over linearised cones the forces depend on the wrench alone: where objective and tie-break leave a choice, the
/// least ``sum |f_i|^2 / f_i^U^2`` decides. They are continuous along a continuous path of wrenches. For true
/// cones there is no exact tie-break; a small ``weight`` prefers a small sum.
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
    /// "max", "sum" or "squares".
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
    squares: SquaresArguments,
    /// Largest relative gap that counts as solved.
    #[pyo3(get)]
    rtol: f64,
}

#[pymethods]
impl PyForceDistributor {
    #[new]
    #[pyo3(signature = (grasp, objective="max", method="implicit", weight=0.0, min_normal=None, samples=None, rtol=1e-9, reference=None, weights=None, slack=None, limits=false))]
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
        reference: Option<&Bound<'_, PyAny>>,
        weights: Option<&Bound<'_, PyAny>>,
        slack: Option<&Bound<'_, PyAny>>,
        limits: bool,
    ) -> PyResult<Self> {
        let refused = |message: String| invalid_input(py, message);
        let (objective, criterion) = parse_objective(objective).map_err(refused)?;
        let inner = &grasp.get().inner;
        let sizes = by_dimension!(inner, g => [g.num_contacts(), g.force_dim()]);
        let sizes = [sizes[0], sizes[1], inner.wrench_dim()];
        let squares = match criterion {
            Some(_) => SquaresArguments::refuse(reference, weights, slack, limits),
            None => SquaresArguments::parse(reference, weights, slack, limits, sizes),
        };
        let squares = squares.map_err(refused)?;
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
        if criterion.is_none() {
            let excluded = [
                ("method", options.method != Method::Implicit),
                ("weight", weight != 0.0),
                ("samples", !samples.is_empty()),
            ];
            if let Some((name, _)) = excluded.iter().find(|(_, given)| *given) {
                return Err(invalid_input(py, format!("{name}: the objective \"squares\" does not take it")));
            }
        }
        let inner = detached(py, || match &grasp.get().inner {
            AnyGrasp::Planar(g) => distributor(g, criterion, options, &squares)
                .map(|distributor| Any::Planar(SharedDistributor::new(distributor))),
            AnyGrasp::Spatial(g) => distributor(g, criterion, options, &squares)
                .map(|distributor| Any::Spatial(SharedDistributor::new(distributor))),
        })?;
        let inner = inner.map_err(|error| to_python(py, &error))?;
        Ok(Self {
            state: RwLock::new(State { inner, grasp }),
            objective,
            method: name,
            weight,
            min_normal,
            samples,
            squares,
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

    /// (m, k) forces that "squares" stays close to; ``None`` for zero.
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let rows = self.squares.reference.as_ref();
        rows.map(|rows| PyArray2::from_vec2(py, rows).map(read_only)).transpose().map_err(Into::into)
    }

    /// (m,) weights of "squares"; ``None`` for 1.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let contacts = self.state(py)?.grasp.get().num_contacts();
        Ok(self.squares.weights.as_ref().map(|weights| match weights[..] {
            [all] => read_only(PyArray1::from_vec(py, vec![all; contacts])),
            ref each => read_only(PyArray1::from_slice(py, each)),
        }))
    }

    /// (d, d) price of what stays unbalanced; ``None`` without.
    #[getter]
    fn slack<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let rows = self.squares.slack.as_ref();
        rows.map(|rows| PyArray2::from_vec2(py, rows).map(read_only)).transpose().map_err(Into::into)
    }

    /// Whether "squares" keeps the upper bounds of normal forces.
    #[getter]
    fn limits(&self) -> bool {
        self.squares.limits
    }

    /// (m,) upper bounds of the normal forces in force, in N: the grasp's, or those of `set_limits`.
    #[getter]
    fn max_normal_force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let state = self.state(py)?;
        let limits = with_distributor!(&state.inner, shared => shared.distributor.limits());
        Ok(read_only(PyArray1::from_vec(py, limits)))
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

    /// The forces whose wrench comes nearest to balance, the least among those.
    ///
    /// They are those of `solve` where that succeeds within the limits.
    ///
    /// Parameters
    /// ----------
    /// external_wrench : array_like
    ///     (d,) wrench on the object, in N and N m about the grasp's origin.
    /// metric : array_like, optional
    ///     (d, d) matrix M of the norm of the residual, ``sqrt(r @ M @ r)``; by default that of the grasp's length scale.
    /// limits : bool, optional
    ///     True keeps normal forces within ``max_normal_force``.
    ///
    /// Returns
    /// -------
    /// ForceSolution
    ///     ``residual`` is what stays unbalanced and ``distance`` its norm. ``gap`` is the larger of two: the objective's
    ///     at the wrench that the forces balance, and the gap of the distance relative to the norm of the wrench. Where the
    ///     least among the nearest forces cannot be told, ``fell_back`` is True: the forces are nearest, and nearly the
    ///     least.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     The wrench or the metric cannot be used.
    /// BusyError
    ///     Another thread is using this distributor.
    ///
    /// Examples
    /// --------
    /// Two fingers of 4 N and friction 0.5 lift 4 N of a weight of 5 N.
    ///
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> nearest = gf.ForceDistributor(grasp).nearest([0, -5, 0])
    /// >>> round(nearest.distance, 6), nearest.residual.round(6)[1].item()
    /// (1.0, -1.0)
    #[pyo3(signature = (external_wrench, metric=None, limits=true))]
    fn nearest(
        &self,
        py: Python<'_>,
        external_wrench: &Bound<'_, PyAny>,
        metric: Option<&Bound<'_, PyAny>>,
        limits: bool,
    ) -> PyResult<PyForceSolution> {
        let state = self.state(py)?;
        let grasp = state.grasp.clone_ref(py);
        Ok(match &state.inner {
            Any::Planar(of) => {
                PyForceSolution::planar(grasp, nearest(py, of, external_wrench, metric, limits)?)
            }
            Any::Spatial(of) => {
                PyForceSolution::spatial(grasp, nearest(py, of, external_wrench, metric, limits)?)
            }
        })
    }

    /// The same, written into an array of the caller's: for control loops.
    ///
    /// Parameters
    /// ----------
    /// external_wrench : array_like
    ///     (d,) wrench on the object.
    /// forces : numpy.ndarray
    ///     (m, k) C-contiguous float64 array for the forces in the contact frames. Untouched on an error.
    /// metric, limits : optional
    ///     As in `nearest`.
    ///
    /// Returns
    /// -------
    /// float
    ///     The distance from balance in the norm of ``metric``: zero, or rounding, where forces balance the wrench.
    ///
    /// Raises
    /// ------
    /// InvalidInputError, BusyError
    ///     As `nearest` does.
    #[pyo3(signature = (external_wrench, forces, metric=None, limits=true))]
    fn nearest_into(
        &self,
        py: Python<'_>,
        external_wrench: &Bound<'_, PyAny>,
        forces: &Bound<'_, PyAny>,
        metric: Option<&Bound<'_, PyAny>>,
        limits: bool,
    ) -> PyResult<f64> {
        let state = self.state(py)?;
        with_distributor!(&state.inner, of => nearest_into(py, of, external_wrench, forces, metric, limits))
    }

    /// Replaces the upper bounds of the normal forces, for contacts that come and go.
    ///
    /// What earlier wrenches taught it goes on. Shares, and with "squares" and ``limits=True`` the cut of the cones, follow
    /// the new limits. `update` returns to those of its grasp.
    ///
    /// Parameters
    /// ----------
    /// max_normal_force : array_like
    ///     (m,) limits in N; zero switches a contact off. Listed extreme forces grow and shrink with them.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     A limit is negative or not finite.
    /// BusyError
    ///     Another thread is using this distributor.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> feet = gf.Grasp([(-1, 0), (0, 0), (1, 0)], [(0, 1)] * 3, friction=0.5)
    /// >>> distributor = gf.ForceDistributor(feet)
    /// >>> distributor.set_limits([1, 0, 1])
    /// >>> distributor.solve([0, -1, 0]).shares.round(9).tolist()
    /// [0.5, 0.0, 0.5]
    fn set_limits(&self, py: Python<'_>, max_normal_force: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut state = match self.state.try_write() {
            Ok(state) => state,
            Err(TryLockError::WouldBlock) => return Err(busy(py)),
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        };
        let contacts = state.grasp.get().num_contacts();
        let limits = float_vector("max_normal_force", max_normal_force, contacts)
            .map_err(|message| invalid_input(py, message))?;
        let inner = &mut state.inner;
        let set = detached(py, || with_distributor!(inner, shared => shared.set_limits(&limits)))?;
        set.map_err(|error| to_python(py, &error))
    }

    /// Least contact forces for many wrenches in one call.
    ///
    /// Parameters
    /// ----------
    /// external_wrenches : array_like
    ///     (T, d) wrenches. Along a trajectory each row starts from the one before.
    /// parallel : bool, optional
    ///     Cut the rows into chunks for all cores, for wrenches that have nothing to do with each other.
    /// infeasible : {"raise", "nearest"}, optional
    ///     What to do with wrenches that nothing balances: "raise" says so in ``status``, "nearest" gives the forces that
    ///     `nearest` finds, within the limits, to every row.
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
    #[pyo3(signature = (external_wrenches, parallel=false, infeasible="raise"))]
    fn solve_many(
        &self,
        py: Python<'_>,
        external_wrenches: &Bound<'_, PyAny>,
        parallel: bool,
        infeasible: &str,
    ) -> PyResult<PyForceBatch> {
        let nearest = match infeasible {
            "raise" => false,
            "nearest" => true,
            other => {
                let message = format!("infeasible: {other:?} is neither \"raise\" nor \"nearest\"");
                return Err(invalid_input(py, message));
            }
        };
        let state = self.state(py)?;
        with_distributor!(&state.inner, of => solve_many(py, of, external_wrenches, parallel, nearest))
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

    /// Goes on with another grasp, in which contacts have rolled or slid a little, or with more or fewer contacts.
    ///
    /// The answers are those of a new distributor; over linearised cones without ``min_normal`` the last basis is kept
    /// where contacts and edges are as many as before, and with "squares" the multiplier of the last wrench always, which
    /// makes the next solve cheaper. Arguments with a value for each contact (``min_normal``, ``weights``,
    /// ``reference``) need as many contacts as before.
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
        let (min_normal, squares) = (self.min_normal.clone(), self.squares.clone());
        let state = RwLock::new(state);
        Ok(Self { state, objective, method, weight, min_normal, samples, squares, rtol })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickled<'py>> {
        let samples = (!self.samples.is_empty()).then(|| self.samples.clone());
        let min_normal = match self.min_normal[..] {
            [] => None,
            [all] => Some(all.into_pyobject(py)?.into_any()),
            ref each => Some(each.into_pyobject(py)?.into_any()),
        };
        let weights = match &self.squares.weights {
            None => None,
            Some(weights) => match weights[..] {
                [all] => Some(all.into_pyobject(py)?.into_any()),
                ref each => Some(each.into_pyobject(py)?.into_any()),
            },
        };
        let (reference, slack) = (self.squares.reference.clone(), self.squares.slack.clone());
        let arguments = (
            self.grasp(py)?,
            self.objective,
            self.method,
            self.weight,
            min_normal,
            samples,
            self.rtol,
            reference,
            weights,
            slack,
            self.squares.limits,
        );
        let state = self.state(py)?;
        let limits = with_distributor!(&state.inner, shared => shared.distributor.set_of_limits());
        Ok((py.get_type::<Self>(), arguments.into_pyobject(py)?, limits))
    }

    /// Limits that were set.
    fn __setstate__(&self, py: Python<'_>, limits: &Bound<'_, PyAny>) -> PyResult<()> {
        self.set_limits(py, limits)
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

/// The name of an objective, and the criterion that it minimises: none for least squares.
fn parse_objective(objective: &str) -> Result<(&'static str, Option<Criterion>), String> {
    match objective {
        "max" => Ok(("max", Some(Criterion::Max))),
        "sum" => Ok(("sum", Some(Criterion::Sum))),
        "squares" => Ok(("squares", None)),
        other => Err(format!("objective: {other:?} is none of \"max\", \"sum\" and \"squares\"")),
    }
}

/// A distributor of either kind.
fn distributor<const D: usize>(
    grasp: &Grasp<D>,
    criterion: Option<Criterion>,
    options: DistributionOptions,
    squares: &SquaresArguments,
) -> graspforce::Result<ForceDistributor<D>> {
    match criterion {
        Some(criterion) => ForceDistributor::with_options(grasp, criterion, options),
        None => ForceDistributor::squares(grasp, squares.options(grasp, options.min_normal, options.rtol)?),
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
