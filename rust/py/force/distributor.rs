//! `graspforce.ForceDistributor`.

use std::iter::repeat_n;
use std::sync::{RwLock, RwLockReadGuard, TryLockError};

use graspforce::{DEFAULT_MAX_POINTS, ForceDistributor, Grasp, Method};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};

use crate::convert::arrays::{float_vector, matrix, vector};
use crate::convert::dimension::{Dimensional, by_dimension, map_dimension};
use crate::convert::errors::{busy, invalid_input, to_python};
use crate::convert::quality_options::{criterion_name, parse_criterion};
use crate::convert::scalars::{Given, flag, instance, shown};
use crate::force::batch::PyForceBatch;
use crate::force::distribution_options::distribution_options;
use crate::force::shared::SharedDistributor;
use crate::force::solution::{ForceQuery, PyForceSolution};
use crate::force::solve::{solve, solve_into, solve_many};
use crate::force::solve_iter::PyForceSteps;
use crate::grasp::PyGrasp;
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_points, check_work};

type AnyDistributor = Dimensional<SharedDistributor<3>, SharedDistributor<6>>;

/// What `update` replaces.
struct State {
    inner: AnyDistributor,
    grasp: Py<PyGrasp>,
}

#[doc = include_str!("distributor.rst")]
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
    #[pyo3(
        signature = (grasp, objective=Given::default(), method=Given::default(), weight=Given::default(),
            min_normal=None, samples=None, rtol=Given::default()),
        text_signature = "(grasp, objective='max', method='implicit', weight=0.0, min_normal=None, samples=None, \
            rtol=1e-9)"
    )]
    #[allow(clippy::too_many_arguments, reason = "the contract with Python")]
    fn new(
        py: Python<'_>,
        grasp: &Bound<'_, PyAny>,
        objective: Given<'_>,
        method: Given<'_>,
        weight: Given<'_>,
        min_normal: Option<&Bound<'_, PyAny>>,
        samples: Option<&Bound<'_, PyAny>>,
        rtol: Given<'_>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let grasp = instance::<PyGrasp>("grasp", grasp).map_err(wrong)?.clone().unbind();
        let criterion = parse_criterion("objective", &objective).map_err(wrong)?;
        let contacts = grasp.get().num_contacts();
        let options = distribution_options(&method, &weight, min_normal, samples, &rtol, contacts);
        let (options, method) = options.map_err(wrong)?;
        let (samples, min_normal) = (options.samples.clone(), options.min_normal.clone());
        let (weight, rtol) = (options.weight, options.rtol);
        let inner = map_dimension!(&grasp.get().inner, of => {
            check_distributor(py, of, options.method)?;
            let made = detached(py, || ForceDistributor::with_options(of, criterion, options))?;
            SharedDistributor::new(made.map_err(|error| to_python(py, &error))?)
        });
        Ok(Self {
            state: RwLock::new(State { inner, grasp }),
            objective: criterion_name(criterion),
            method,
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
                Some(vector(py, "min_normal", contacts, repeat_n(all, contacts))?)
            }
            ref each => Some(vector(py, "min_normal", each.len(), each.iter().copied())?),
        })
    }

    /// (S, d) external wrenches that chose the points of "reduced"; ``None`` without.
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(first) = self.samples.first() else { return Ok(None) };
        let numbers = self.samples.iter().flatten().copied();
        matrix(py, self.samples.len(), first.len(), numbers).map(Some)
    }

    /// Indices of the points that "reduced" keeps, into `Grasp.minkowski_sum`; ``None`` with other methods.
    #[getter]
    fn reduced_points<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<u32>>>> {
        let state = self.state(py)?;
        let points = by_dimension!(&state.inner, shared => shared.distributor.reduced_points());
        points.map(|points| vector(py, "points", points.len(), points.iter().copied())).transpose()
    }

    /// Compute the least contact forces that balance an external wrench (Eq. 11).
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
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> solution = gf.ForceDistributor(grasp).solve([0, -1, 0])
    /// >>> solution.world_forces.round(9).tolist()
    /// [[1.0, 0.5], [-1.0, 0.5]]
    /// >>> solution.within_limits
    /// True
    pub fn solve(&self, py: Python<'_>, external_wrench: &Bound<'_, PyAny>) -> PyResult<PyForceSolution> {
        let state = self.state(py)?;
        let wrench = float_vector("external_wrench", external_wrench, state.inner.wrench_dim());
        let external_wrench = wrench.map_err(|message| invalid_input(py, message))?;
        let distribution = map_dimension!(&state.inner, of => solve(py, of, &external_wrench)?);
        let query = ForceQuery {
            external_wrench,
            objective: self.objective,
            weight: self.weight,
            rtol: self.rtol,
            least_share: self.min_normal.iter().copied().fold(0.0, f64::max),
        };
        Ok(PyForceSolution::new(state.grasp.clone_ref(py), distribution, query))
    }

    /// Solve and write the forces into an array of the caller's: for control loops.
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
        by_dimension!(&state.inner, distributor => solve_into(py, distributor, external_wrench, forces))
    }

    /// Compute the least contact forces for many wrenches in one call.
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
    /// Raises
    /// ------
    /// InvalidInputError
    ///     The wrenches are not (T, d) real numbers, or ``parallel`` is no bool.
    /// TooLargeError
    ///     The arrays over the rows do not fit into memory.
    /// BusyError
    ///     Another thread is using this distributor.
    /// KeyboardInterrupt
    ///     Ctrl-C was pressed; nothing is returned.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> batch = gf.ForceDistributor(grasp).solve_many([[0, -1, 0], [0, -2, 0]])
    /// >>> batch.sigma_max.round(9).tolist(), batch.status.tolist(), batch.forces.shape
    /// ([0.25, 0.5], [0, 0], (2, 2, 2))
    #[pyo3(
        signature = (external_wrenches, parallel=Given::default()),
        text_signature = "($self, external_wrenches, parallel=False)"
    )]
    fn solve_many(
        &self,
        py: Python<'_>,
        external_wrenches: &Bound<'_, PyAny>,
        parallel: Given<'_>,
    ) -> PyResult<PyForceBatch> {
        let parallel = parallel.or(false, |value| flag("parallel", value));
        let parallel = parallel.map_err(|message| invalid_input(py, message))?;
        let state = self.state(py)?;
        by_dimension!(&state.inner, distributor => solve_many(py, distributor, external_wrenches, parallel))
    }

    /// Solve for each wrench that an iterable yields, when it yields it.
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
    /// Raises
    /// ------
    /// InvalidInputError
    ///     ``external_wrenches`` is not iterable.
    /// InfeasibleWrenchError, InvalidInputError, NotConvergedError, BusyError
    ///     As `solve` does, from the iterator. The message says which wrench, counted from 0.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> weights = ([0, -weight, 0] for weight in (1, 2))
    /// >>> [round(s.sigma_max, 9) for s in gf.ForceDistributor(grasp).solve_iter(weights)]
    /// [0.25, 0.5]
    fn solve_iter(slf: Py<Self>, external_wrenches: &Bound<'_, PyAny>) -> PyResult<PyForceSteps> {
        let wrenches = external_wrenches.try_iter().map_err(|_| {
            let given = shown(external_wrenches);
            invalid_input(external_wrenches.py(), format!("external_wrenches: {given} is not iterable"))
        })?;
        Ok(PyForceSteps::new(slf.into_any(), wrenches.unbind()))
    }

    /// Go on with another grasp, in which contacts have rolled or slid a little.
    ///
    /// The answers are those of a new distributor; over linearised cones without ``min_normal`` the last basis is kept
    /// where contacts and edges are as many as before, which makes the next solve cheaper.
    ///
    /// Parameters
    /// ----------
    /// grasp : Grasp
    ///     Of the same dimension.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     It is no grasp, has the other dimension, or does not fit the options: ``min_normal`` has another number of
    ///     contacts.
    /// InvalidGraspError, TooLargeError
    ///     As for a new distributor. The old grasp stays.
    /// BusyError
    ///     Another thread is using this distributor.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
    /// >>> distributor = gf.ForceDistributor(grasp)
    /// >>> round(distributor.solve([0, -1, 0]).sigma_max, 9)
    /// 0.25
    /// >>> distributor.update(grasp.replace(friction=0.25))
    /// >>> round(distributor.solve([0, -1, 0]).sigma_max, 9)
    /// 0.5
    fn update(&self, py: Python<'_>, grasp: &Bound<'_, PyAny>) -> PyResult<()> {
        let grasp = instance::<PyGrasp>("grasp", grasp).map_err(|message| invalid_input(py, message))?;
        let mut state = match self.state.try_write() {
            Ok(state) => state,
            Err(TryLockError::WouldBlock) => return Err(busy(py)),
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        };
        let both = state.inner.as_mut().with(grasp.get().inner.as_ref());
        let both = both.ok_or_else(|| invalid_input(py, "grasp: its dimension is not this distributor's"))?;
        by_dimension!(both, (shared, grasp) => {
            check_distributor(py, grasp, shared.distributor.options().method)?;
            detached(py, || shared.update(grasp))?.map_err(|error| to_python(py, &error))?;
        });
        state.grasp = grasp.clone().unbind();
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

/// Bytes for a point of an enumeration and for one of its entries, with the solver's copies.
const LISTED: (usize, usize) = (208, 8);

/// Refuses a distributor that memory would not hold.
fn check_distributor<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, method: Method) -> PyResult<()> {
    check_work(py, grasp, Work::Distributor)?;
    if method == Method::Implicit { Ok(()) } else { check_points(py, grasp, DEFAULT_MAX_POINTS, LISTED) }
}
