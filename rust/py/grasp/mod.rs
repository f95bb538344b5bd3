//! `graspforce.Grasp`, whose longer docstrings are the `.rst` files of this folder.
//!
//! - [`arrays`]: its arrays; [`resistance`]: `Grasp.resistance`; [`minkowski_sum`]: `MinkowskiSum`;
//!   [`torque_limits`]: `torque_limited_forces`.

mod arrays;
pub(crate) mod minkowski_sum;
mod resistance;
pub(crate) mod torque_limits;

use graspforce::{Closure, DEFAULT_MAX_POINTS, MinkowskiSum, implausibility};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::cell::Cell;

use crate::convert::arrays::read_only;
use crate::convert::dimension::{AnyGrasp, by_dimension, map_dimension};
use crate::convert::errors::{invalid_grasp, invalid_input, to_python, warn};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::quality_options::{Query, RawOptions, quality_options};
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{Given, whole};
use crate::grasp::minkowski_sum::PyMinkowskiSum;
use crate::quality::PyQuality;
use crate::quality::gradient::PyGradient;
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_points, check_work};

/// Bytes for a point of an enumeration and for one of its entries, once for the core and once for NumPy.
const ENUMERATED: (usize, usize) = (112, 16);

#[doc = include_str!("grasp.rst")]
#[pyclass(name = "Grasp", module = "graspforce", frozen)]
pub struct PyGrasp {
    pub inner: AnyGrasp,
    arguments: Arguments<'static>,
}

thread_local! {
    static UNWARNED: Cell<bool> = const { Cell::new(false) };
}

/// `Grasp(...)` without a warning: of contacts that were checked, or that a search or a simulator made.
#[pyfunction]
#[pyo3(signature = (*arguments, **options))]
pub fn unwarned_grasp<'py>(
    py: Python<'py>,
    arguments: &Bound<'py, PyTuple>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let before = UNWARNED.replace(true);
    let grasp = py.get_type::<PyGrasp>().call(arguments, options);
    UNWARNED.set(before);
    grasp
}

/// The same from the arguments' names and values alone: what pickles hold.
#[pyfunction]
pub fn unwarned_grasp_of<'py>(
    py: Python<'py>,
    arguments: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    unwarned_grasp(py, &PyTuple::empty(py), Some(arguments))
}

#[pymethods]
impl PyGrasp {
    #[new]
    #[pyo3(
        signature = (*arguments, **options),
        text_signature = "(positions, normals, friction=0.5, max_normal_force=1.0, edges=8, torsion=None, \
            tangents=None, origin=None, length_scale=1.0, friction_margin=1.0, extreme_forces=None)"
    )]
    fn new(
        py: Python<'_>,
        arguments: &Bound<'_, PyTuple>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let raw = Raw::new("Grasp", arguments, options)?;
        let arguments = Arguments::parse(&raw, false).map_err(|message| invalid_grasp(py, message))?;
        let inner = arguments
            .contacts_of(0)
            .and_then(|contacts| AnyGrasp::new(arguments.dim, &contacts, arguments.options));
        let inner = inner.map_err(|error| to_python(py, &error))?;
        if !UNWARNED.get()
            && let Some(message) = by_dimension!(&inner, grasp => implausibility(grasp.contacts()))
        {
            warn(py, &message)?;
        }
        Ok(Self { inner, arguments })
    }

    /// Dimension d of wrenches, 3 for planar grasps and 6 for spatial ones.
    #[getter]
    fn wrench_dim(&self) -> usize {
        self.inner.wrench_dim()
    }

    /// Number of contacts m.
    #[getter]
    pub fn num_contacts(&self) -> usize {
        self.arguments.contacts
    }

    /// Number k of a contact force's components, 2 (planar), 3 (hard fingers) or 4 (soft fingers).
    #[getter]
    fn force_dim(&self) -> usize {
        by_dimension!(&self.inner, grasp => grasp.force_dim())
    }

    /// (m, dim) contact positions in m.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::positions(py, &self.inner)
    }

    /// (m, dim) unit normals into the object.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::normals(py, &self.inner)
    }

    /// (m, dim, dim) contact frames, row by row the axes ``n``, (``o``,) ``t`` in world coordinates.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        arrays::frames(py, &self.inner)
    }

    /// (d, m k) grasp matrix G, which maps the stacked contact forces, in their frames, to the wrench they exert.
    #[getter]
    fn grasp_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::grasp_matrix(py, &self.inner)
    }

    /// (sum l_i, d) primitive wrenches ``w_ih = G_i s_ih`` (Eq. 8), contact by contact, in N and N m.
    ///
    /// Raises InvalidGraspError where a contact has its true cone, which has no finite set.
    #[getter]
    fn primitive_wrenches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::primitive_wrenches(py, &self.inner)
    }

    /// (sum l_i, k) extreme contact forces ``s_ih`` (Eq. 3) in contact frames, contact by contact, in N.
    ///
    /// Raises InvalidGraspError where a contact has its true cone, which has no finite set.
    #[getter]
    fn extreme_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        arrays::extreme_forces(py, &self.inner)
    }

    /// (m,) Coulomb friction coefficients as given, before ``friction_margin``.
    #[getter]
    fn friction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.arguments.of_each(py, &self.arguments.friction)
    }

    /// (m,) upper bounds of the normal forces in N.
    #[getter]
    fn max_normal_force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.arguments.of_each(py, &self.arguments.max_normal_force)
    }

    /// (m,) torsional friction coefficients in m, as given: before ``friction_margin``; zero for hard contacts.
    #[getter]
    fn torsion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.arguments.of_each(py, &self.arguments.torsion)
    }

    /// What divides the friction coefficients, at least 1.
    #[getter]
    fn friction_margin(&self) -> f64 {
        self.arguments.options.friction_margin
    }

    /// (m, 3) first tangents ``o`` of the contact frames; ``None`` in the plane.
    #[getter]
    fn tangents<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        arrays::tangents(py, &self.inner)
    }

    /// (m,) number of extreme forces of each contact; 0 for a true cone.
    #[getter]
    fn num_edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        arrays::num_edges(py, &self.inner)
    }

    /// Length L in m of the norm of wrenches.
    #[getter]
    fn length_scale(&self) -> f64 {
        self.arguments.options.length_scale
    }

    /// (dim,) point about which torques are taken, in m.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(PyArray1::from_slice(py, &self.arguments.options.origin.as_slice()[..self.arguments.dim]))
    }

    /// Whether contact forces can balance every external wrench (``rho < 0``).
    #[getter]
    fn is_force_closure(&self, py: Python<'_>) -> PyResult<bool> {
        let closure = by_dimension!(&self.inner, grasp => {
            check_work(py, grasp, Work::Quality)?;
            detached(py, || grasp.closure())?
        });
        closure.map(|closure| closure == Closure::Force).map_err(|error| to_python(py, &error))
    }

    #[doc = include_str!("quality.rst")]
    #[pyo3(
        signature = (criterion=Given::default(), rtol=None, external_wrench=None, metric=None, max_facets=None),
        text_signature = "($self, criterion='max', rtol=None, external_wrench=None, metric=None, max_facets=None)"
    )]
    fn quality(
        slf: &Bound<'_, Self>,
        criterion: Given<'_>,
        rtol: Option<&Bound<'_, PyAny>>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        max_facets: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyQuality> {
        let given = RawOptions { rtol, external_wrench, metric, max_facets };
        let query = map_dimension!(&slf.get().inner, _ => {
            Query::parse(&criterion, given).map_err(|message| invalid_input(slf.py(), message))?
        });
        PyQuality::of(slf.py(), slf.clone().unbind(), query)
    }

    #[doc = include_str!("resistance.rst")]
    #[pyo3(
        signature = (directions, criterion=Given::default(), external_wrench=None),
        text_signature = "($self, directions, criterion='max', external_wrench=None)"
    )]
    fn resistance<'py>(
        &self,
        py: Python<'py>,
        directions: &Bound<'py, PyAny>,
        criterion: Given<'py>,
        external_wrench: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        resistance::resistance(py, &self.inner, directions, &criterion, external_wrench)
    }

    /// Compute the other numbers a grasp is judged by: singular values, isotropy, volumes.
    ///
    /// Returns
    /// -------
    /// graspforce.measures.Measures
    ///     With their definitions.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    /// >>> round(grasp.measures().isotropy, 9)
    /// 1.0
    fn measures<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.measures")?.call_method1("measures_of", (slf,))
    }

    /// The gradient alone, in one solve: what `quality(...).gradient` returns, for loops that need nothing else.
    #[pyo3(
        signature = (criterion=Given::default(), external_wrench=None, metric=None),
        text_signature = "($self, criterion='max', external_wrench=None, metric=None)"
    )]
    fn _gradient(
        &self,
        criterion: Given<'_>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        py: Python<'_>,
    ) -> PyResult<Py<PyGradient>> {
        let given = RawOptions { external_wrench, metric, ..RawOptions::default() };
        by_dimension!(&self.inner, grasp => {
            let options = quality_options(&criterion, given).map_err(|message| invalid_input(py, message))?;
            PyGradient::of(py, grasp, &options)
        })
    }

    /// Singular values of the grasp matrix in the norm of the length scale, largest first.
    fn _singular_values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        by_dimension!(&self.inner, grasp => {
            check_work(py, grasp, Work::Quality)?;
            Ok(PyArray1::from_vec(py, grasp.singular_values()))
        })
    }

    #[doc = include_str!("minkowski_sum.rst")]
    #[pyo3(signature = (max_points=Given::default()), text_signature = "($self, max_points=2000000)")]
    fn minkowski_sum(&self, py: Python<'_>, max_points: Given<'_>) -> PyResult<PyMinkowskiSum> {
        let max_points = max_points.or(DEFAULT_MAX_POINTS, points);
        let max_points = max_points.map_err(|message| invalid_input(py, message))?;
        by_dimension!(&self.inner, grasp => {
            check_points(py, grasp, max_points, ENUMERATED)?;
            let sum = detached(py, || MinkowskiSum::with_limit(grasp, max_points))?;
            PyMinkowskiSum::new(py, grasp, &sum.map_err(|error| to_python(py, &error))?)
        })
    }

    /// Return the contacts and what is derived from them as plain Python numbers and lists, ready for JSON.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]).to_dict()["positions"]
    /// [[-1.0, 0.0], [1.0, 0.0]]
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("grasp_dict", (slf,))
    }

    #[doc = include_str!("from_dict.rst")]
    #[staticmethod]
    fn from_dict<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        given.py().import("graspforce._internal.to_dict")?.call_method1("grasp_of", (given,))
    }

    #[doc = include_str!("replace.rst")]
    #[pyo3(signature = (**changes))]
    fn replace<'py>(
        &self,
        py: Python<'py>,
        changes: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let arguments = self.arguments.to_python(py, true)?;
        let changes = changes.cloned().unwrap_or_else(|| PyDict::new(py));
        arguments.update(changes.as_mapping())?;
        let moved = changes.contains("positions")? || changes.contains("normals")?;
        let class = py.get_type::<Self>();
        if moved { class.call((), Some(&arguments)) } else { unwarned_grasp_of(py, &arguments) }
    }

    /// All arguments by name, one number for each contact.
    fn _arguments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.arguments.to_python(py, false)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("grasp_html", (slf,))
    }

    /// Draw the grasp: a figure that notebooks show and ``savefig`` writes. Needs the ``plot`` extra.
    ///
    /// Parameters
    /// ----------
    /// **options
    ///     As for `graspforce.plotting.grasp_figure`: ``forces``, ``title``, ``outline`` and ``mesh``.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> figure = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]).plot(title="pinch")
    #[pyo3(signature = (**options))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.plotting")?.getattr("grasp_figure")?.call((slf,), options)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let restore = py.import("graspforce._core")?.getattr("unwarned_grasp_of")?;
        Ok((restore, (self.arguments.to_python(py, false)?,).into_pyobject(py)?))
    }

    fn __eq__(&self, other: &Bound<'_, Self>) -> bool {
        self.arguments.same_grasp(&other.get().arguments)
    }

    fn __hash__(&self) -> u64 {
        self.arguments.hash_of_places()
    }

    fn __repr__(&self) -> String {
        let kind = if self.arguments.dim == 2 { "planar" } else { "spatial" };
        let (contacts, s) = (self.arguments.contacts, if self.arguments.contacts == 1 { "" } else { "s" });
        let forces = by_dimension!(&self.inner, grasp => match grasp.extreme_forces() {
            Ok(forces) => format!("{} extreme forces", forces.len()),
            Err(_) => "true cones".to_string(),
        });
        format!("Grasp({kind}, {contacts} contact{s}, {forces})")
    }
}

/// The largest number of points that a sum may list, which may be more than memory has addresses for.
fn points(value: &Bound<'_, PyAny>) -> Result<u128, String> {
    value.extract().or_else(|_| whole("max_points", value, 0..=usize::MAX).map(|limit| limit as u128))
}
