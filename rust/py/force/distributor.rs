//! `graspforce.ForceDistributor`.

use std::iter::repeat_n;
use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError, TryLockResult};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};

use crate::convert::arrays::{float_vector, matrix, read_only, vector};
use crate::convert::dimension::{Dimensional, by_dimension, map_dimension};
use crate::convert::errors::{busy, invalid_input, to_python};
use crate::convert::scalars::{Given, choice, flag, instance, shown};
use crate::force::batch::PyForceBatch;
use crate::force::construction::{
    check_distributor, distributor, one_or_each, other_dimension, refuse_beside_squares,
};
use crate::force::distribution_options::{distribution_options, gap_flag, limits_flag, parse_objective};
use crate::force::nearest::{nearest, nearest_into};
use crate::force::query::ForceQuery;
use crate::force::shared::SharedDistributor;
use crate::force::solution::PyForceSolution;
use crate::force::solve::{solve, solve_into, solve_many};
use crate::force::solve_iter::PyForceSteps;
use crate::force::squares_arguments::{SquaresArguments, reference_of, reference_rows, references};
use crate::grasp::PyGrasp;
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_work};

type AnyDistributor = Dimensional<SharedDistributor<3>, SharedDistributor<6>>;

/// The class, its arguments, and limits that were set.
type Pickled<'py> = (Bound<'py, PyType>, Bound<'py, PyTuple>, Option<Vec<f64>>);

/// What `update` replaces.
struct State {
    inner: AnyDistributor,
    grasp: Py<PyGrasp>,
}

#[doc = include_str!("docs/distributor.rst")]
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
    #[pyo3(
        signature = (grasp, objective=Given::default(), method=Given::default(), weight=Given::default(),
            min_normal=None, samples=None, rtol=Given::default(), reference=None, weights=None, slack=None,
            limits=Given::default()),
        text_signature = "(grasp, objective='max', method='implicit', weight=0.0, min_normal=None, samples=None, \
            rtol=1e-9, reference=None, weights=None, slack=None, limits=False)"
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
        reference: Option<&Bound<'_, PyAny>>,
        weights: Option<&Bound<'_, PyAny>>,
        slack: Option<&Bound<'_, PyAny>>,
        limits: Given<'_>,
    ) -> PyResult<Self> {
        let refused = |message: String| invalid_input(py, message);
        let grasp = instance::<PyGrasp>("grasp", grasp).map_err(refused)?.clone().unbind();
        let (objective, criterion) = parse_objective(&objective).map_err(refused)?;
        let limits = limits.or(false, |value| flag("limits", value)).map_err(refused)?;
        let sizes = by_dimension!(&grasp.get().inner, g => [g.num_contacts(), g.force_dim()]);
        let sizes = [sizes[0], sizes[1], grasp.get().inner.wrench_dim()];
        let squares = match criterion {
            Some(_) => SquaresArguments::refuse(reference, weights, slack, limits).map_err(refused)?,
            None => SquaresArguments::parse(reference, weights, slack, limits, sizes).map_err(refused)?,
        };
        let options = distribution_options(&method, &weight, min_normal, samples, &rtol, sizes[0]);
        let (options, method) = options.map_err(refused)?;
        let (weight, rtol) = (options.weight, options.rtol);
        let (samples, min_normal) = (options.samples.clone(), options.min_normal.clone());
        if criterion.is_none() {
            refuse_beside_squares(&options).map_err(refused)?;
        }
        let inner = map_dimension!(&grasp.get().inner, of => {
            check_distributor(py, of, options.method)?;
            let made = detached(py, || distributor(of, criterion, options, &squares))?;
            SharedDistributor::new(made.map_err(|error| to_python(py, &error))?)
        });
        Ok(Self {
            state: RwLock::new(State { inner, grasp }),
            objective,
            method,
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
                let m = self.state(py)?.grasp.get().num_contacts();
                Some(vector(py, "min_normal", m, repeat_n(all, m))?)
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

    /// (m, k) forces that "squares" stays close to; ``None`` for zero.
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let state = self.state(py)?;
        let rows = by_dimension!(&state.inner, shared => reference_of(&shared.distributor));
        rows.map(|rows| PyArray2::from_vec2(py, &rows).map(read_only)).transpose().map_err(Into::into)
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
        let limits = by_dimension!(&self.state(py)?.inner, of => of.distributor.limits());
        Ok(read_only(PyArray1::from_vec(py, limits)))
    }

    /// Indices of the points that "reduced" keeps, into `Grasp.minkowski_sum`; ``None`` with other methods.
    #[getter]
    fn reduced_points<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<u32>>>> {
        let state = self.state(py)?;
        let points = by_dimension!(&state.inner, shared => shared.distributor.reduced_points());
        points.map(|points| vector(py, "points", points.len(), points.iter().copied())).transpose()
    }

    #[doc = include_str!("docs/solve.rst")]
    pub fn solve(&self, py: Python<'_>, external_wrench: &Bound<'_, PyAny>) -> PyResult<PyForceSolution> {
        let state = self.state(py)?;
        let query = self.query(py, &state, external_wrench)?;
        let distribution = map_dimension!(&state.inner, of => solve(py, of, &query.external_wrench)?);
        Ok(PyForceSolution::new(state.grasp.clone_ref(py), distribution, query))
    }

    #[doc = include_str!("docs/solve_into.rst")]
    fn solve_into(
        &self,
        py: Python<'_>,
        external_wrench: &Bound<'_, PyAny>,
        forces: &Bound<'_, PyAny>,
    ) -> PyResult<f64> {
        let state = self.state(py)?;
        by_dimension!(&state.inner, distributor => solve_into(py, distributor, external_wrench, forces))
    }

    #[doc = include_str!("docs/nearest.rst")]
    #[pyo3(
        signature = (external_wrench, metric=None, limits=Given::default()),
        text_signature = "($self, external_wrench, metric=None, limits=True)"
    )]
    fn nearest(
        &self,
        py: Python<'_>,
        external_wrench: &Bound<'_, PyAny>,
        metric: Option<&Bound<'_, PyAny>>,
        limits: Given<'_>,
    ) -> PyResult<PyForceSolution> {
        let state = self.state(py)?;
        let query = self.query(py, &state, external_wrench)?;
        let distribution = map_dimension!(&state.inner, of => {
            nearest(py, of, &query.external_wrench, metric, limits_flag(py, &limits)?)?
        });
        Ok(PyForceSolution::new(state.grasp.clone_ref(py), distribution, query))
    }

    #[doc = include_str!("docs/nearest_into.rst")]
    #[pyo3(
        signature = (external_wrench, forces, metric=None, limits=Given::default(), return_gap=Given::default()),
        text_signature = "($self, external_wrench, forces, metric=None, limits=True, return_gap=False)"
    )]
    fn nearest_into<'py>(
        &self,
        py: Python<'py>,
        external_wrench: &Bound<'py, PyAny>,
        forces: &Bound<'py, PyAny>,
        metric: Option<&Bound<'py, PyAny>>,
        limits: Given<'py>,
        return_gap: Given<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let state = self.state(py)?;
        let flags = (limits_flag(py, &limits)?, gap_flag(py, &return_gap)?);
        by_dimension!(&state.inner, of => nearest_into(py, of, external_wrench, forces, metric, flags))
    }

    #[doc = include_str!("docs/set_limits.rst")]
    fn set_limits(&self, py: Python<'_>, max_normal_force: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut state = self.state_mut(py)?;
        let m = state.grasp.get().num_contacts();
        let limits = float_vector("max_normal_force", max_normal_force, m);
        let limits = limits.map_err(|message| invalid_input(py, message))?;
        by_dimension!(&mut state.inner, shared => {
            check_work(py, shared.distributor.grasp(), Work::Distributor)?;
            detached(py, || shared.set_limits(&limits))?.map_err(|error| to_python(py, &error))
        })
    }

    #[doc = include_str!("docs/set_reference.rst")]
    fn set_reference(&self, py: Python<'_>, reference: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let mut state = self.state_mut(py)?;
        let sizes = by_dimension!(&state.grasp.get().inner, g => [g.num_contacts(), g.force_dim()]);
        let rows = reference.map(|value| reference_rows(value, sizes)).transpose();
        let rows = rows.map_err(|message| invalid_input(py, message))?;
        by_dimension!(&mut state.inner, shared => {
            check_work(py, shared.distributor.grasp(), Work::Distributor)?;
            let reference = references(shared.distributor.grasp(), rows.iter().flatten());
            detached(py, || shared.set_reference(&reference))?.map_err(|error| to_python(py, &error))
        })
    }

    #[doc = include_str!("docs/solve_many.rst")]
    #[pyo3(
        signature = (external_wrenches, parallel=Given::default(), infeasible=Given::default()),
        text_signature = "($self, external_wrenches, parallel=False, infeasible='raise')"
    )]
    fn solve_many(
        &self,
        py: Python<'_>,
        external_wrenches: &Bound<'_, PyAny>,
        parallel: Given<'_>,
        infeasible: Given<'_>,
    ) -> PyResult<PyForceBatch> {
        let refused = |message| invalid_input(py, message);
        let parallel = parallel.or(false, |value| flag("parallel", value)).map_err(refused)?;
        let infeasible = infeasible.or("raise", |value| choice("infeasible", value, &["raise", "nearest"]));
        let nearest = infeasible.map_err(refused)? == "nearest";
        let state = self.state(py)?;
        by_dimension!(&state.inner, of => solve_many(py, of, external_wrenches, parallel, nearest))
    }

    #[doc = include_str!("docs/solve_iter.rst")]
    fn solve_iter(slf: Py<Self>, external_wrenches: &Bound<'_, PyAny>) -> PyResult<PyForceSteps> {
        let wrenches = external_wrenches.try_iter().map_err(|_| {
            let given = shown(external_wrenches);
            invalid_input(external_wrenches.py(), format!("external_wrenches: {given} is not iterable"))
        })?;
        Ok(PyForceSteps::new(slf.into_any(), wrenches.unbind()))
    }

    #[doc = include_str!("docs/update.rst")]
    fn update(&self, py: Python<'_>, grasp: &Bound<'_, PyAny>) -> PyResult<()> {
        let grasp = instance::<PyGrasp>("grasp", grasp).map_err(|message| invalid_input(py, message))?;
        let mut state = self.state_mut(py)?;
        let both = state.inner.as_mut().with(grasp.get().inner.as_ref());
        let both = both.ok_or_else(|| invalid_input(py, other_dimension(grasp.get())));
        by_dimension!(both?, (shared, grasp) => {
            check_distributor(py, grasp, shared.distributor.options().method)?;
            detached(py, || shared.update(grasp))?.map_err(|error| to_python(py, &error))?;
        });
        state.grasp = grasp.clone().unbind();
        Ok(())
    }

    /// Its grasp and options as plain Python numbers and lists, ready for JSON.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("distributor_dict", (slf,))
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        let of = self.state(py)?;
        let state = RwLock::new(State { inner: of.inner.clone(), grasp: of.grasp.clone_ref(py) });
        let (objective, method) = (self.objective, self.method);
        let (weight, samples, rtol) = (self.weight, self.samples.clone(), self.rtol);
        let (min_normal, squares) = (self.min_normal.clone(), self.squares.clone());
        Ok(Self { state, objective, method, weight, min_normal, samples, squares, rtol })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Pickled<'py>> {
        let samples = (!self.samples.is_empty()).then(|| self.samples.clone());
        let min_normal = one_or_each(py, &self.min_normal)?;
        let weights = one_or_each(py, self.squares.weights.as_deref().unwrap_or_default())?;
        let state = self.state(py)?;
        let reference = by_dimension!(&state.inner, shared => reference_of(&shared.distributor));
        let arguments = (
            state.grasp.clone_ref(py),
            self.objective,
            self.method,
            self.weight,
            min_normal,
            samples,
            self.rtol,
            reference,
            weights,
            self.squares.slack.clone(),
            self.squares.limits,
        );
        let limits = by_dimension!(&state.inner, of => of.distributor.changed_limits());
        Ok((py.get_type::<Self>(), arguments.into_pyobject(py)?, limits))
    }

    fn __setstate__(&self, py: Python<'_>, limits: &Bound<'_, PyAny>) -> PyResult<()> {
        self.set_limits(py, limits)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let state = self.state(py)?;
        let (objective, method) = (self.objective, self.method);
        let grasp = state.grasp.bind(py).repr().map_or_else(|_| "Grasp".into(), |text| text.to_string());
        Ok(format!("ForceDistributor({grasp}, objective='{objective}', method='{method}')"))
    }
}

impl PyForceDistributor {
    /// What is asked about a wrench.
    fn query(&self, py: Python<'_>, state: &State, wrench: &Bound<'_, PyAny>) -> PyResult<ForceQuery> {
        let external_wrench = float_vector("external_wrench", wrench, state.inner.wrench_dim())
            .map_err(|message| invalid_input(py, message))?;
        Ok(ForceQuery {
            external_wrench,
            objective: self.objective,
            weight: self.weight,
            rtol: self.rtol,
            least_share: self.min_normal.iter().copied().fold(0.0, f64::max),
            limits: by_dimension!(&state.inner, shared => shared.distributor.limits()),
        })
    }

    fn state(&self, py: Python<'_>) -> PyResult<RwLockReadGuard<'_, State>> {
        unlocked(py, self.state.try_read())
    }

    fn state_mut(&self, py: Python<'_>) -> PyResult<RwLockWriteGuard<'_, State>> {
        unlocked(py, self.state.try_write())
    }
}

fn unlocked<G>(py: Python<'_>, lock: TryLockResult<G>) -> PyResult<G> {
    match lock {
        Ok(state) => Ok(state),
        Err(TryLockError::WouldBlock) => Err(busy(py)),
        // An update that panicked changed nothing.
        Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
    }
}
