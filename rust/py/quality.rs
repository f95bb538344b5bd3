//! `graspforce.Quality`, and the options of quality queries.

use std::cell::Cell;
use std::thread::LocalKey;

use graspforce::{
    Closure, Criterion, Gradient, Grasp, Metric, Quality, QualityOptions, QualityWorkspace, Wrench,
};
use nalgebra::{SMatrix, Vector3};
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyTuple;

use crate::arrays::{contents, float_array, float_vector, matrix};
use crate::errors::{invalid_input, to_python};
use crate::grasp::{AnyGrasp, PyGrasp};
use crate::interrupt::detached;

thread_local! {
    static PLANAR: Cell<Option<QualityWorkspace<3>>> = const { Cell::new(None) };
    static SPATIAL: Cell<Option<QualityWorkspace<6>>> = const { Cell::new(None) };
}

/// Takes the workspace for as long as it is used: a signal handler may compute qualities meanwhile.
fn lent<W: Default, R>(kept: &'static LocalKey<Cell<Option<W>>>, body: impl FnOnce(&mut W) -> R) -> R {
    let mut workspace = kept.take().unwrap_or_default();
    let result = body(&mut workspace);
    kept.set(Some(workspace));
    result
}

/// Dimensions that keep a workspace for each thread.
pub trait Workspace: Sized {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R;
}

impl Workspace for QualityWorkspace<3> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        lent(&PLANAR, body)
    }
}

impl Workspace for QualityWorkspace<6> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        lent(&SPATIAL, body)
    }
}

/// What a quality was asked with, to ask for its gradient later.
pub enum AnyOptions {
    Planar(QualityOptions<3>),
    Spatial(QualityOptions<6>),
}

/// The same as Python passed it, to pickle.
pub struct Asked {
    pub rtol: Option<f64>,
    pub center: Option<Py<PyAny>>,
    pub metric: Option<Py<PyAny>>,
}

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
///     The field's quality number: the largest wrench norm that is resisted in every direction.
/// lower, upper : float
///     ``lower <= rho <= upper``, proven.
/// converged : bool
///     Whether the bracket is as narrow as asked for; if not, the bound on the work was reached.
/// closure : {"force", "partial", "none"}
///     The class of Propositions 1 and 2; where it is "partial", rho is exactly 0.
/// direction : numpy.ndarray
///     (d,) physical wrench of unit norm: the grasp is weakest along it, a disturbance is worst along its
///     opposite. Where ``rho >= 0`` no wrench of the grasp has a positive component along it.
/// wrench : numpy.ndarray
///     (d,) nearest boundary wrench, ``-rho * direction``, in N and N m.
/// supports : int
///     How many times the support oracle was asked.
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
    options: AnyOptions,
    asked: Asked,
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
    /// The field's quality number, ``-rho``.
    #[getter]
    fn epsilon(&self) -> f64 {
        // Zero rather than minus zero where the closure is partial.
        0.0 - self.rho
    }

    /// (d,) physical wrench of unit norm along which the grasp is weakest.
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.direction)
    }

    /// (d,) nearest boundary wrench, ``-rho * direction``, in N and N m.
    #[getter]
    fn wrench<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.wrench)
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
        let gradient =
            self.gradient.get_or_try_init(py, || match (&self.grasp.get().inner, &self.options) {
                (AnyGrasp::Planar(grasp), AnyOptions::Planar(options)) => PyGradient::of(py, grasp, options),
                (AnyGrasp::Spatial(grasp), AnyOptions::Spatial(options)) => {
                    PyGradient::of(py, grasp, options)
                }
                _ => Err(invalid_input(py, "the quality belongs to another kind of grasp")),
            })?;
        Ok(gradient.clone_ref(py))
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
        slf.py().import("graspforce.display")?.call_method1("quality_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.display")?.call_method1("quality_html", (slf,))
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the state of a pickle, item by item")]
    fn _restore(
        grasp: Py<PyGrasp>,
        criterion: &str,
        rtol: Option<f64>,
        center: Option<Bound<'_, PyAny>>,
        metric: Option<Bound<'_, PyAny>>,
        bracket: (f64, f64, f64),
        found: (bool, String, usize),
        direction: Vec<f64>,
        wrench: Vec<f64>,
        py: Python<'_>,
    ) -> PyResult<Self> {
        let wrong = |message: String| invalid_input(py, message);
        let (given_center, given_metric) = (center.as_ref(), metric.as_ref());
        let options = match grasp.get().inner {
            AnyGrasp::Planar(_) => {
                quality_options(criterion, rtol, given_center, given_metric).map(AnyOptions::Planar)
            }
            AnyGrasp::Spatial(_) => {
                quality_options(criterion, rtol, given_center, given_metric).map(AnyOptions::Spatial)
            }
        };
        let classes = [Closure::Force, Closure::Partial, Closure::None].map(closure_name);
        let closure = classes.into_iter().find(|name| *name == found.1);
        Ok(Self {
            grasp,
            criterion: criterion_name(parse_criterion("criterion", criterion).map_err(wrong)?),
            options: options.map_err(wrong)?,
            asked: Asked { rtol, center: center.map(Bound::unbind), metric: metric.map(Bound::unbind) },
            gradient: PyOnceLock::new(),
            rho: bracket.0,
            lower: bracket.1,
            upper: bracket.2,
            converged: found.0,
            closure: closure.ok_or_else(|| wrong(format!("closure: {:?} is not a class", found.1)))?,
            supports: found.2,
            direction,
            wrench,
        })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let asked = &this.asked;
        let state = (
            this.grasp.clone_ref(py),
            this.criterion,
            asked.rtol,
            asked.center.as_ref().map(|center| center.clone_ref(py)),
            asked.metric.as_ref().map(|metric| metric.clone_ref(py)),
            (this.rho, this.lower, this.upper),
            (this.converged, this.closure, this.supports),
            this.direction.clone(),
            this.wrench.clone(),
        );
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn __repr__(&self) -> String {
        let open = if self.converged { "" } else { ", not converged" };
        format!(
            "Quality({}, epsilon={}, closure='{}', width={:.1e}{open})",
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

/// The options of a quality query, or what is wrong with them.
pub fn quality_options<const D: usize>(
    criterion: &str,
    rtol: Option<f64>,
    center: Option<&Bound<'_, PyAny>>,
    metric: Option<&Bound<'_, PyAny>>,
) -> Result<QualityOptions<D>, String> {
    let criterion = parse_criterion("criterion", criterion)?;
    let center = center.map(|value| float_vector("center", value, D)).transpose()?;
    let metric = metric.map(parse_metric).transpose()?;
    let center = center.map(Wrench::from_vec);
    Ok(QualityOptions { rtol, center, metric, ..QualityOptions::new(criterion) })
}

/// The word for a criterion.
fn criterion_name(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Max => "max",
        Criterion::Sum => "sum",
    }
}

/// "max" or "sum".
pub fn parse_criterion(argument: &str, criterion: &str) -> Result<Criterion, String> {
    match criterion {
        "max" => Ok(Criterion::Max),
        "sum" => Ok(Criterion::Sum),
        other => Err(format!("{argument}: {other:?} is neither \"max\" nor \"sum\"")),
    }
}

fn parse_metric<const D: usize>(value: &Bound<'_, PyAny>) -> Result<Metric<D>, String> {
    let array = float_array("metric", value)?;
    if array.shape() != [D, D] {
        return Err(format!("metric: shape {:?}, expected ({D}, {D})", array.shape()));
    }
    Metric::from_matrix(&SMatrix::from_row_slice(contents(&array))).map_err(|error| error.to_string())
}

impl PyQuality {
    /// Hands a quality over, with what its gradient will need.
    pub fn new<const D: usize>(
        grasp: Py<PyGrasp>,
        options: AnyOptions,
        asked: Asked,
        quality: &Quality<D>,
    ) -> Self {
        let criterion = match &options {
            AnyOptions::Planar(options) => options.criterion,
            AnyOptions::Spatial(options) => options.criterion,
        };
        Self {
            grasp,
            criterion: criterion_name(criterion),
            options,
            asked,
            gradient: PyOnceLock::new(),
            rho: quality.rho,
            lower: quality.lower,
            upper: quality.upper,
            converged: quality.converged,
            closure: closure_name(quality.closure),
            supports: quality.supports,
            direction: quality.direction.as_slice().to_vec(),
            wrench: quality.wrench.as_slice().to_vec(),
        }
    }
}

/// Computes a quality in this thread's workspace, without the interpreter.
pub fn quality_of<const D: usize>(
    py: Python<'_>,
    grasp: &Grasp<D>,
    options: &QualityOptions<D>,
) -> PyResult<Quality<D>>
where
    QualityWorkspace<D>: Workspace,
{
    detached(py, || QualityWorkspace::<D>::with(|workspace| grasp.quality_with(options, workspace)))?
        .map_err(|error| to_python(py, &error))
}

/// How epsilon changes as contacts move.
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
/// unique : bool
///     Whether epsilon is differentiable here. Where several directions are equally bad, or several forces reach
///     the same boundary wrench (symmetric grasps), this is one element of the subdifferential.
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
    fn spins<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.gradient.spins)
    }

    /// Whether epsilon is differentiable here.
    #[getter]
    fn unique(&self) -> bool {
        self.gradient.unique
    }

    /// Everything as plain Python numbers and lists, ready for JSON.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.display")?.call_method1("gradient_dict", (slf,))
    }

    #[staticmethod]
    fn _restore(
        positions: Vec<[f64; 3]>,
        normals: Vec<[f64; 3]>,
        spins: Vec<f64>,
        unique: bool,
        dim: usize,
    ) -> Self {
        let vectors = |rows: Vec<[f64; 3]>| rows.into_iter().map(Vector3::from).collect();
        let gradient = Gradient { positions: vectors(positions), normals: vectors(normals), spins, unique };
        Self { gradient, dim }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let rows = |vectors: &[Vector3<f64>]| vectors.iter().map(|&v| v.into()).collect::<Vec<[f64; 3]>>();
        let Gradient { positions, normals, spins, unique } = &this.gradient;
        let state = (rows(positions), rows(normals), spins.clone(), *unique, this.dim);
        Ok((py.get_type::<Self>().getattr("_restore")?, state.into_pyobject(py)?))
    }

    fn __repr__(&self) -> String {
        format!("Gradient({} contacts, unique={})", self.gradient.positions.len(), self.gradient.unique)
    }
}

impl PyGradient {
    fn of<const D: usize>(py: Python<'_>, grasp: &Grasp<D>, options: &QualityOptions<D>) -> PyResult<Py<Self>>
    where
        QualityWorkspace<D>: Workspace,
    {
        let gradient =
            detached(py, || QualityWorkspace::<D>::with(|workspace| grasp.gradient(options, workspace)))?;
        let gradient = gradient.map_err(|error| to_python(py, &error))?;
        Py::new(py, Self { gradient, dim: if D == 3 { 2 } else { 3 } })
    }

    fn rows<'py>(&self, py: Python<'py>, vectors: &[Vector3<f64>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, vectors.len(), self.dim, vectors.iter().flat_map(|v| v.iter().copied().take(self.dim)))
    }
}
