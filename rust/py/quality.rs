//! `graspforce.Quality`, and the options of quality queries.

use std::cell::RefCell;

use graspforce::{Closure, Criterion, Grasp, Metric, Quality, QualityOptions, QualityWorkspace, Wrench};
use nalgebra::SMatrix;
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{contents, float_array, float_vector};
use crate::errors::to_python;

thread_local! {
    static PLANAR: RefCell<QualityWorkspace<3>> = RefCell::default();
    static SPATIAL: RefCell<QualityWorkspace<6>> = RefCell::default();
}

/// Dimensions that keep a workspace for each thread.
pub trait Workspace: Sized {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R;
}

impl Workspace for QualityWorkspace<3> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        PLANAR.with_borrow_mut(body)
    }
}

impl Workspace for QualityWorkspace<6> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        SPATIAL.with_borrow_mut(body)
    }
}

/// The quality of a grasp, with its certificate.
///
/// Attributes
/// ----------
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
#[pyclass(name = "Quality", module = "graspforce", frozen)]
pub struct PyQuality {
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

    fn __repr__(&self) -> String {
        let open = if self.converged { "" } else { ", not converged" };
        format!(
            "Quality(epsilon={}, closure='{}', width={:.1e}{open})",
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

/// Computes a quality in this thread's workspace, without the interpreter.
pub fn quality_of<const D: usize>(
    py: Python<'_>,
    grasp: &Grasp<D>,
    options: &QualityOptions<D>,
) -> PyResult<PyQuality>
where
    QualityWorkspace<D>: Workspace,
{
    let quality: Quality<D> = py
        .detach(|| QualityWorkspace::<D>::with(|workspace| grasp.quality_with(options, workspace)))
        .map_err(|error| to_python(py, &error))?;
    Ok(PyQuality {
        rho: quality.rho,
        lower: quality.lower,
        upper: quality.upper,
        converged: quality.converged,
        closure: closure_name(quality.closure),
        supports: quality.supports,
        direction: quality.direction.as_slice().to_vec(),
        wrench: quality.wrench.as_slice().to_vec(),
    })
}
