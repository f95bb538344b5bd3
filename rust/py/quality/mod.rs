//! `graspforce.Quality`.

pub(crate) mod batch;
pub(crate) mod gradient;

use graspforce::Closure;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyTuple;

use crate::convert::arrays::read_only;
use crate::convert::dimension::{by_dimension, map_dimension};
use crate::convert::errors::invalid_input;
use crate::convert::quality_options::{AnyAsked, Asked, criterion_name};
use crate::convert::restored;
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
    asked: AnyAsked,
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
        if !self.asked.by_length_scale() {
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
        let asked = self.grasp.get().inner.as_ref().with(self.asked.as_ref());
        let asked =
            asked.ok_or_else(|| invalid_input(py, "the quality belongs to a grasp of another dimension"))?;
        let computed = by_dimension!(asked, (grasp, asked) => PyGradient::of(py, grasp, &asked.options)?);
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

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the state of a pickle, item by item")]
    fn _restore(
        grasp: Py<PyGrasp>,
        criterion: &str,
        rtol: Option<f64>,
        external_wrench: Option<Bound<'_, PyAny>>,
        metric: Option<Bound<'_, PyAny>>,
        max_facets: Option<usize>,
        bracket: (f64, f64, f64),
        found: (bool, String, usize),
        direction: Vec<f64>,
        wrench: Vec<f64>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let (external_wrench, metric) = (external_wrench.as_ref(), metric.as_ref());
        let asked = map_dimension!(&grasp.get().inner, _ => {
            Asked::parse(criterion, rtol, external_wrench, metric, max_facets).map_err(wrong)?
        });
        let (rho, lower, upper) = bracket;
        let d = grasp.get().inner.wrench_dim();
        restored::bracket(rho, lower, upper)
            .and_then(|()| restored::worst(rho, &direction, &wrench, d))
            // The class is the grasp's own, whatever the external wrench.
            .and_then(|()| {
                if external_wrench.is_none() { restored::closure(&found.1, lower, upper) } else { Ok(()) }
            })
            .map_err(wrong)?;
        let classes = [Closure::Force, Closure::Partial, Closure::None].map(closure_name);
        let closure = classes.into_iter().find(|name| *name == found.1);
        Ok(Self {
            grasp,
            criterion: criterion_name(asked.criterion()),
            asked,
            gradient: PyOnceLock::new(),
            rho,
            lower,
            upper,
            converged: found.0,
            closure: closure.ok_or_else(|| wrong(format!("closure: {:?} is not a class", found.1)))?,
            supports: found.2,
            direction,
            wrench,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let (rtol, external_wrench, metric, max_facets) = this.asked.numbers();
        let state = (
            this.grasp.clone_ref(py),
            this.criterion,
            rtol,
            external_wrench,
            metric,
            max_facets,
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
            "Quality({}, epsilon={}, closure='{}', width={:.1e}{open}{hint})",
            self.criterion,
            self.epsilon(),
            self.closure,
            self.upper - self.lower
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
    pub fn of(py: Python<'_>, grasp: Py<PyGrasp>, asked: AnyAsked) -> PyResult<Self> {
        let query = grasp.get().inner.as_ref().with(asked.as_ref());
        let query = query.ok_or_else(|| invalid_input(py, "the query belongs to another dimension"))?;
        by_dimension!(query, (of, options) => {
            let quality = quality_of(py, of, &options.options)?;
            Ok(Self {
                criterion: criterion_name(asked.criterion()),
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
                asked,
            })
        })
    }
}
