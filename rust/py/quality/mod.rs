//! `graspforce.Quality`. [`gradient`]: its `Gradient`; [`batch`]: `quality_many`, with [`gradient_batch`] and
//! [`bundle_batch`]; [`least_friction`]: brackets of the least friction.

pub(crate) mod batch;
pub(crate) mod bundle_batch;
pub(crate) mod gradient;
pub(crate) mod gradient_batch;
pub(crate) mod least_friction;

use graspforce::Closure;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::read_only;
use crate::convert::dimension::{by_dimension, map_dimension};
use crate::convert::errors::invalid_input;
use crate::convert::quality_options::{AnyQuery, Query, RawOptions, criterion_name};
use crate::convert::restored;
use crate::convert::scalars::Given;
use crate::convert::significant::{proven, significant};
use crate::grasp::PyGrasp;
use crate::quality::gradient::PyGradient;
use crate::runtime::workspace::quality_of;

/// The quality of a grasp, with its certificate.
///
/// It is immutable and may be shared between threads, copied and pickled.
///
/// Attributes
/// ----------
/// grasp : Grasp
///     Whose quality it is.
/// criterion : {"max", "sum"}
///     What is limited to 1: each normalised normal force, or their sum.
/// external_wrench : numpy.ndarray or None
///     (d,) the external wrench that was given.
/// metric : numpy.ndarray or None
///     (d, d) the metric that was given; None where the norm is that of ``grasp.length_scale``.
/// rtol : float or None
///     The relative width of the bracket that was asked for; None for the default.
/// max_facets : int or None
///     The largest number of facets that was allowed; None for the default.
/// rho : float
///     -epsilon, with the paper's sign: negative means force closure, smaller is better.
/// epsilon : float
///     The field's quality number: the largest wrench norm that is resisted in every direction, as far as it is
///     proven: epsilon_lower (0 where the closure is "partial").
/// epsilon_lower, epsilon_upper : float
///     The exact epsilon lies between them, proven, rounding included.
/// lower, upper : float
///     The same of rho: ``lower == -epsilon_upper`` and ``upper == -epsilon_lower``.
/// converged : bool
///     Whether the bracket is as narrow as asked for, or as rounding allows; if not, ``max_facets`` was
///     reached or rounding stalled the search.
/// closure : {"force", "partial", "none"}
///     The class of Propositions 1 and 2, whatever the criterion, metric, limits and external wrench. It is decided on
///     wrenches of unit length, torques about the contacts' centroid in units of their spread, beyond what rounding
///     may have done to them (16 times the machine epsilon for each product on the way). What rounding leaves
///     undecided is "partial": rho is then exactly 0, and the bracket says what is possible.
/// direction : numpy.ndarray
///     (d,) physical wrench of unit norm: the grasp is weakest along it, a disturbance is worst along its
///     opposite. Where ``rho >= 0`` no wrench of the grasp has a positive component along it, but for rounding.
/// wrench : numpy.ndarray
///     (d,) nearest boundary wrench, ``-rho * direction``, in N and N m.
/// supports : int
///     How many times the support oracle was asked.
/// hint : str or None
///     Advice where the length scale is ten times the contacts' extent or more; torques alone then decide epsilon.
/// gradient : Gradient
///     How epsilon changes as contacts move; computed when first asked for.
#[pyclass(name = "Quality", module = "graspforce", frozen)]
pub struct PyQuality {
    /// The grasp it belongs to.
    #[pyo3(get)]
    grasp: Py<PyGrasp>,
    /// "max" or "sum".
    #[pyo3(get)]
    criterion: &'static str,
    query: AnyQuery,
    gradient: PyOnceLock<Py<PyGradient>>,
    /// -epsilon, with the paper's sign: negative means force closure, smaller is better.
    #[pyo3(get)]
    rho: f64,
    /// Proven: ``lower <= rho``.
    #[pyo3(get)]
    lower: f64,
    /// Proven: ``rho <= upper``.
    #[pyo3(get)]
    upper: f64,
    /// Whether the bracket is as narrow as asked for, or as rounding allows.
    #[pyo3(get)]
    converged: bool,
    /// "force", "partial" or "none": the class of Propositions 1 and 2.
    #[pyo3(get)]
    closure: &'static str,
    /// How many times the support oracle was asked.
    #[pyo3(get)]
    supports: usize,
    direction: Vec<f64>,
    wrench: Vec<f64>,
}

#[pymethods]
impl PyQuality {
    /// The field's quality number, ``-rho``: what is proven of it.
    #[getter]
    fn epsilon(&self) -> f64 {
        // Zero rather than minus zero where the closure is partial.
        0.0 - self.rho
    }

    /// Proven: ``epsilon_lower`` is at most the exact epsilon.
    #[getter]
    fn epsilon_lower(&self) -> f64 {
        0.0 - self.upper
    }

    /// Proven: the exact epsilon is at most ``epsilon_upper``.
    #[getter]
    fn epsilon_upper(&self) -> f64 {
        0.0 - self.lower
    }

    /// (d,) the external wrench that was given, or None.
    #[getter]
    fn external_wrench<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        self.query.external_wrench(py)
    }

    /// (d, d) the metric that was given; None where the norm is that of the grasp's length scale.
    #[getter]
    fn metric<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.query.metric(py)
    }

    /// Relative width of the bracket that was asked for; None for the default.
    #[getter]
    fn rtol(&self) -> Option<f64> {
        self.query.rtol()
    }

    /// Largest number of facets that was allowed; None for the default.
    #[getter]
    fn max_facets(&self) -> Option<usize> {
        self.query.max_facets()
    }

    /// Advice where the length scale is ten times the contacts' extent or more, else None.
    ///
    /// The extent is the largest distance between two contacts. With a ``metric`` of its own there is no hint.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> contacts = [(-0.04, 0), (0.04, 0)], [(1, 0), (-1, 0)]
    /// >>> print(gf.Grasp(*contacts, length_scale=0.04).quality().hint)
    /// None
    /// >>> gf.Grasp(*contacts, length_scale=1.0).quality().hint[:46]
    /// "the length scale of 1 m is 12 times the contac"
    #[getter]
    fn hint(&self) -> Option<String> {
        if !self.query.by_length_scale() {
            return None;
        }
        by_dimension!(&self.grasp.get().inner, grasp => grasp.length_scale_hint())
    }

    /// (d,) physical wrench of unit norm along which the grasp is weakest.
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(PyArray1::from_slice(py, &self.direction))
    }

    /// (d,) nearest boundary wrench, ``-rho * direction``, in N and N m.
    #[getter]
    fn wrench<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(PyArray1::from_slice(py, &self.wrench))
    }

    /// How epsilon changes as contacts move.
    ///
    /// By the envelope theorem at the worst direction. It describes the exact epsilon, so its direction is
    /// computed more precisely than ``rtol`` asked for.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0.1), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    /// >>> gradient = grasp.quality("max").gradient
    /// >>> bool(gradient.positions[0, 1] < gradient.positions[1, 1])  # bringing the fingers in line is better
    /// True
    #[getter]
    fn gradient(&self, py: Python<'_>) -> PyResult<Py<PyGradient>> {
        if let Some(known) = self.gradient.get(py) {
            return Ok(known.clone_ref(py));
        }
        // Not inside the cell: a signal handler that runs meanwhile may ask for the same gradient.
        let both = self.grasp.get().inner.as_ref().with(self.query.as_ref());
        let both =
            both.ok_or_else(|| invalid_input(py, "the quality belongs to a grasp of another dimension"))?;
        let computed = by_dimension!(both, (grasp, query) => PyGradient::of(py, grasp, &query.options)?);
        Ok(self.gradient.get_or_init(py, || computed).clone_ref(py))
    }

    /// Everything but the gradient as plain Python numbers, strings and lists, ready for JSON.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    /// >>> grasp.quality("max").to_dict()["closure"]
    /// 'force'
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("quality_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("quality_html", (slf,))
    }

    /// Draw the grasp with its quality and its weakest wrench: a figure that notebooks show and ``savefig``
    /// writes. Needs the ``plot`` extra.
    ///
    /// Parameters
    /// ----------
    /// **options
    ///     As for `graspforce.plotting.quality_figure`: ``title``, ``outline`` and ``mesh``.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (**options))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.plotting")?.getattr("quality_figure")?.call((slf,), options)
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the state of a pickle, item by item")]
    fn _restore(
        grasp: Py<PyGrasp>,
        criterion: Given<'_>,
        rtol: Option<&Bound<'_, PyAny>>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        max_facets: Option<&Bound<'_, PyAny>>,
        bracket: (f64, f64, f64),
        answer: (bool, String, usize),
        direction: Vec<f64>,
        wrench: Vec<f64>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let given = RawOptions { rtol, external_wrench, metric, max_facets };
        let query = map_dimension!(&grasp.get().inner, _ => Query::parse(&criterion, given).map_err(wrong)?);
        let (converged, class, supports) = answer;
        let (rho, lower, upper) = bracket;
        let d = grasp.get().inner.wrench_dim();
        restored::bracket(rho, lower, upper)
            .and_then(|()| restored::worst(rho, &direction, &wrench, d))
            // The class is the grasp's own, whatever the external wrench.
            .and_then(|()| {
                if external_wrench.is_none() { restored::closure(&class, lower, upper) } else { Ok(()) }
            })
            .map_err(wrong)?;
        let classes = [Closure::Force, Closure::Partial, Closure::None].map(closure_name);
        let closure = classes.into_iter().find(|name| *name == class);
        Ok(Self {
            grasp,
            criterion: criterion_name(query.criterion()),
            query,
            gradient: PyOnceLock::new(),
            rho,
            lower,
            upper,
            converged,
            closure: closure.ok_or_else(|| wrong(format!("closure: {class:?} is not a class")))?,
            supports,
            direction,
            wrench,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let state = (
            this.grasp.clone_ref(py),
            this.criterion,
            this.query.rtol(),
            this.query.external_wrench(py)?,
            this.query.metric(py)?,
            this.query.max_facets(),
            (this.rho, this.lower, this.upper),
            (this.converged, this.closure, this.supports),
            this.direction.clone(),
            this.wrench.clone(),
        );
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn __repr__(&self) -> String {
        let open = if self.converged { "" } else { ", not converged" };
        let hint = self.hint().map_or_else(String::new, |hint| format!(", hint: {hint}"));
        format!(
            "Quality({}, epsilon={}, closure='{}', width={}{open}{hint})",
            self.criterion,
            proven(self.epsilon(), self.upper - self.lower),
            self.closure,
            significant(self.upper - self.lower, 2)
        )
    }
}

/// The word for a class of closure.
pub fn closure_name(closure: Closure) -> &'static str {
    match closure {
        Closure::Force => "force",
        Closure::Partial => "partial",
        Closure::None => "none",
    }
}

impl PyQuality {
    /// The answer to a query about a grasp of its dimension.
    pub fn of(py: Python<'_>, grasp: Py<PyGrasp>, query: AnyQuery) -> PyResult<Self> {
        let both = grasp.get().inner.as_ref().with(query.as_ref());
        let both = both.ok_or_else(|| invalid_input(py, "the query belongs to another dimension"))?;
        by_dimension!(both, (of, about) => {
            let quality = quality_of(py, of, &about.options)?;
            Ok(Self {
                criterion: criterion_name(query.criterion()),
                gradient: PyOnceLock::new(),
                rho: quality.rho,
                lower: quality.lower,
                upper: quality.upper,
                converged: quality.converged,
                closure: closure_name(quality.closure),
                supports: quality.supports,
                direction: quality.direction.as_slice().to_vec(),
                wrench: quality.wrench.as_slice().to_vec(),
                grasp: grasp.clone_ref(py),
                query,
            })
        })
    }
}
