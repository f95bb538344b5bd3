//! `graspforce.Grasp`.

pub(crate) mod minkowski_sum;
pub(crate) mod torque_limits;

use graspforce::{Closure, DEFAULT_MAX_POINTS, MinkowskiSum, implausibility};
use nalgebra::SVector;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::cell::Cell;

use crate::convert::arrays::{float_array, float_vector, matrix, read_only, shaped, vectors};
use crate::convert::dimension::{AnyGrasp, with_grasp};
use crate::convert::errors::{invalid_grasp, invalid_input, to_python, warn};
use crate::convert::grasp_arguments::{Argument, Arguments, Raw};
use crate::convert::quality_options::{AnyAsked, Asked, parse_criterion, quality_options};
use crate::grasp::minkowski_sum::PyMinkowskiSum;
use crate::quality::PyQuality;
use crate::quality::gradient::PyGradient;
use crate::runtime::interrupt::detached;
use crate::runtime::workspace::quality_of;

/// Contacts of a multifingered hand on an object, checked, with everything derived from them.
///
/// A grasp is immutable and may be shared between threads, copied and pickled.
///
/// Parameters
/// ----------
/// positions : array_like
///     (m, 2) or (m, 3) contact positions in m; two columns make a planar grasp with wrenches
///     ``[fx, fy, tau]``, three a spatial one with ``[f, tau]``.
/// normals : array_like
///     Same shape: normals **into** the object, of any length. A grasp does not know the object: it warns where
///     they look wrong, and `graspforce.surfaces.MeshSurface.grasp` checks them.
/// friction : array_like, optional
///     Scalar or (m,) Coulomb friction coefficients mu >= 0.
/// max_normal_force : array_like, optional
///     Scalar or (m,) upper bounds of the normal forces in N, positive.
/// edges : int, sequence of int or None, optional
///     Edges of the linearised friction cones (Eq. 3), at least 3; None keeps the true second-order cones.
///     Planar grasps ignore it: their two edges are exact.
/// torsion : array_like, optional
///     Scalar or (m,) torsional friction coefficients in m; soft fingers where positive. Forces then have four
///     components, the last a torque about the normal.
/// tangents : array_like, optional
///     (m, 3) directions whose projections on the tangent planes become the axes ``o``; by default e_x is
///     projected, or e_y where ``|n_x| > 0.7``.
/// origin : array_like, optional
///     (2,) or (3,) point about which torques are taken, in m; zero by default.
/// length_scale : float, optional
///     Length L in m that makes torques comparable with forces in the norm of quality:
///     ``|w|^2 = |f|^2 + |tau|^2 / L^2``. Nothing else depends on it.
/// friction_margin : float, optional
///     Factor >= 1 that divides all friction coefficients. Least forces lie on their friction cones; a margin
///     keeps them away from slip.
/// extreme_forces : sequence of array_like, optional
///     For each contact an (l_i, k) array of extreme forces in its frame, ``[n, t]``, ``[n, o, t]`` or
///     ``[n, o, t, torsion]``, whose convex hull with zero replaces the friction cone. What is limited is then
///     the multiple of that hull a force needs. Rows of zero are dropped: later rows count from the ones left in
///     ``primitive_wrenches`` and in the indices of ``MinkowskiSum.edges``.
///
/// Raises
/// ------
/// InvalidGraspError
///     An argument has the wrong shape or type, a number is not finite, a normal is zero, a friction coefficient
///     negative, a limit not positive, or there is no contact. The message names argument, contact and value.
///
/// Warns
/// -----
/// GraspWarning
///     All normals point away from the contacts' centre, or a contact lies more than 100 times farther from the
///     others than they lie from each other. Batches (`quality_many`, `grade`), searches, copies and contacts read
///     from simulators do not warn.
///
/// Notes
/// -----
/// The contact frame is ``(n, t)`` with ``t = (-n_y, n_x)`` in the plane and ``(n, o, t)`` with ``t = n x o`` in
/// space.
///
/// Examples
/// --------
/// >>> import graspforce as gf
/// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=20)
/// >>> grasp
/// Grasp(planar, 2 contacts, 4 extreme forces)
/// >>> grasp.wrench_dim
/// 3
#[pyclass(name = "Grasp", module = "graspforce", frozen)]
pub struct PyGrasp {
    pub inner: AnyGrasp,
    arguments: Arguments,
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

#[pymethods]
impl PyGrasp {
    #[new]
    #[pyo3(
        signature = (positions, normals, friction=Argument::Default, max_normal_force=Argument::Default, edges=Argument::Default,
            torsion=None, tangents=None, origin=None, length_scale=Argument::Default, friction_margin=1.0, extreme_forces=None),
        text_signature = "(positions, normals, friction=0.5, max_normal_force=1.0, edges=8, torsion=None, \
            tangents=None, origin=None, length_scale=1.0, friction_margin=1.0, extreme_forces=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "the arguments of a grasp are the contract")]
    fn new<'py>(
        py: Python<'py>,
        positions: &Bound<'py, PyAny>,
        normals: &Bound<'py, PyAny>,
        friction: Argument<'py>,
        max_normal_force: Argument<'py>,
        edges: Argument<'py>,
        torsion: Option<&Bound<'py, PyAny>>,
        tangents: Option<&Bound<'py, PyAny>>,
        origin: Option<&Bound<'py, PyAny>>,
        length_scale: Argument<'py>,
        friction_margin: f64,
        extreme_forces: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let raw = Raw {
            positions,
            normals,
            friction: &friction,
            max_normal_force: &max_normal_force,
            edges: &edges,
            torsion,
            tangents,
            origin,
            length_scale: &length_scale,
            friction_margin,
            extreme_forces,
        };
        let arguments = Arguments::parse(&raw, false).map_err(|message| invalid_grasp(py, message))?;
        let inner = AnyGrasp::new(arguments.dim, &arguments.contacts_of(0), arguments.options);
        let inner = inner.map_err(|error| to_python(py, &error))?;
        if !UNWARNED.get()
            && let Some(message) = with_grasp!(&inner, grasp => implausibility(grasp.contacts()))
        {
            warn(py, &message)?;
        }
        Ok(Self { inner, arguments })
    }

    /// Dimension d of wrenches, 3 for planar grasps and 6 for spatial ones.
    #[getter]
    fn wrench_dim(&self) -> usize {
        match self.inner {
            AnyGrasp::Planar(_) => 3,
            AnyGrasp::Spatial(_) => 6,
        }
    }

    /// Number of contacts m.
    #[getter]
    pub fn num_contacts(&self) -> usize {
        self.arguments.contacts
    }

    /// Number k of a contact force's components, 2 (planar), 3 (hard fingers) or 4 (soft fingers).
    #[getter]
    fn force_dim(&self) -> usize {
        with_grasp!(&self.inner, grasp => grasp.force_dim())
    }

    /// (m, dim) contact positions in m.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.arguments.dim;
        with_grasp!(&self.inner, grasp => {
            let rows = grasp.contacts().iter().flat_map(|contact| contact.position.iter().copied().take(dim));
            matrix(py, grasp.num_contacts(), dim, rows).map(read_only)
        })
    }

    /// (m, dim) unit normals into the object.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.arguments.dim;
        with_grasp!(&self.inner, grasp => {
            let rows = grasp.contacts().iter().flat_map(|contact| contact.normal.iter().copied().take(dim));
            matrix(py, grasp.num_contacts(), dim, rows).map(read_only)
        })
    }

    /// (m, dim, dim) contact frames, row by row the axes ``n``, (``o``,) ``t`` in world coordinates.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let dim = self.arguments.dim;
        let axes: &[usize] = if dim == 2 { &[0, 2] } else { &[0, 1, 2] };
        with_grasp!(&self.inner, grasp => {
            let rows = grasp.frames().iter().flat_map(|frame| {
                axes.iter().flat_map(move |&axis| (0..dim).map(move |row| frame[(row, axis)]))
            });
            Ok(read_only(PyArray1::from_iter(py, rows).reshape([grasp.num_contacts(), dim, dim])?))
        })
    }

    /// (d, m k) grasp matrix G, which maps the stacked contact forces, in their frames, to the wrench they exert.
    #[getter]
    fn grasp_matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        with_grasp!(&self.inner, grasp => {
            let (d, columns) = (self.wrench_dim(), grasp.force_components());
            let rows = (0..d).flat_map(|row| {
                grasp.maps().iter().flat_map(move |map| columns.iter().map(move |&column| map[(row, column)]))
            });
            matrix(py, d, grasp.num_contacts() * columns.len(), rows).map(read_only)
        })
    }

    /// (sum l_i, d) primitive wrenches ``w_ih = G_i s_ih`` (Eq. 8), contact by contact, in N and N m.
    ///
    /// Raises InvalidGraspError where a contact has its true cone, which has no finite set.
    #[getter]
    fn primitive_wrenches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        with_grasp!(&self.inner, grasp => {
            let wrenches = grasp.primitive_wrenches().map_err(|error| to_python(py, &error))?;
            let rows = wrenches.iter().flat_map(|w| w.iter().copied());
            matrix(py, wrenches.len(), self.wrench_dim(), rows).map(read_only)
        })
    }

    /// (sum l_i, k) extreme contact forces ``s_ih`` (Eq. 3) in contact frames, contact by contact, in N.
    ///
    /// Raises InvalidGraspError where a contact has its true cone, which has no finite set.
    #[getter]
    fn extreme_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        with_grasp!(&self.inner, grasp => {
            let forces = grasp.extreme_forces().map_err(|error| to_python(py, &error))?;
            let columns = grasp.force_components();
            let rows = forces.iter().flat_map(|force| columns.iter().map(|&row| force[row]));
            matrix(py, forces.len(), columns.len(), rows).map(read_only)
        })
    }

    /// (m,) Coulomb friction coefficients as given, before ``friction_margin``.
    #[getter]
    fn friction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(self.arguments.friction_of_each(py))
    }

    /// (m,) upper bounds of the normal forces in N.
    #[getter]
    fn max_normal_force<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(self.arguments.limit_of_each(py))
    }

    /// (m,) torsional friction coefficients in m, as given: before ``friction_margin``; zero for hard contacts.
    #[getter]
    fn torsion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(self.arguments.torsion_of_each(py))
    }

    /// What divides the friction coefficients, at least 1.
    #[getter]
    fn friction_margin(&self) -> f64 {
        self.arguments.options.friction_margin
    }

    /// (m, 3) first tangents ``o`` of the contact frames; ``None`` in the plane.
    #[getter]
    fn tangents<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let AnyGrasp::Spatial(grasp) = &self.inner else { return Ok(None) };
        let rows =
            grasp.frames().iter().flat_map(|frame| frame.column(1).iter().copied().collect::<Vec<_>>());
        matrix(py, grasp.num_contacts(), 3, rows).map(read_only).map(Some)
    }

    /// (m,) number of extreme forces of each contact; 0 for a true cone.
    #[getter]
    fn num_edges<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        with_grasp!(&self.inner, grasp => {
            let counts = (0..grasp.num_contacts()).map(|i| grasp.edges(i).map_or(0, |range| range.len() as i64));
            read_only(PyArray1::from_iter(py, counts))
        })
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
        let closure = with_grasp!(&self.inner, grasp => detached(py, || grasp.closure())?);
        closure.map(|closure| closure == Closure::Force).map_err(|error| to_python(py, &error))
    }

    /// How large a wrench the grasp resists in its worst direction, under limited contact forces.
    ///
    /// Parameters
    /// ----------
    /// criterion : {"max", "sum"}, optional
    ///     What is limited to 1: each normalised normal force (``rho_max``, the field's L-infinity or
    ///     Minkowski-sum metric; Eq. 17) or their sum (``rho_sum``, the L1 or union Ferrari-Canny metric; Eq. 16).
    /// rtol : float, optional
    ///     Relative width of the bracket; 1e-9 by default, or 1e-6 where a contact has its true cone.
    /// external_wrench : array_like, optional
    ///     (d,) external wrench that acts all the time, such as the weight: epsilon is then the largest
    ///     disturbance that can be resisted on top of it. ``closure`` still describes the grasp itself.
    /// metric : array_like, optional
    ///     (d, d) symmetric positive definite M of the norm ``|w|^2 = w^T M w``; by default that of the grasp's
    ///     ``length_scale``.
    /// max_facets : int, optional
    ///     Bound on the work, 200,000 by default: some 0.1 s and 40 MB. Only grasps that are nearly as weak along a
    ///     continuum of directions reach it, and keep an open bracket; ten times the facets cost ten times the
    ///     time and memory and narrow it by a factor of about 3 to 10.
    ///
    /// Returns
    /// -------
    /// Quality
    ///     rho with its bracket, the class of the grasp, and the worst direction.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     The criterion is unknown, rtol not within (0, 1), max_facets not within 100 to 100,000,000, or external_wrench or
    ///     metric unusable.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    /// >>> q = grasp.quality("max")
    /// >>> q.closure, round(q.epsilon, 9)
    /// ('force', 0.577350269)
    #[pyo3(signature = (criterion="max", rtol=None, external_wrench=None, metric=None, max_facets=None))]
    fn quality(
        slf: &Bound<'_, Self>,
        criterion: &str,
        rtol: Option<f64>,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        max_facets: Option<usize>,
    ) -> PyResult<PyQuality> {
        let py = slf.py();
        let wrong = |message: String| invalid_input(py, message);
        let owner = slf.clone().unbind();
        match &slf.get().inner {
            AnyGrasp::Planar(grasp) => {
                let asked =
                    Asked::parse(criterion, rtol, external_wrench, metric, max_facets).map_err(wrong)?;
                let quality = quality_of(py, grasp, &asked.options)?;
                Ok(PyQuality::new(owner, AnyAsked::Planar(asked), &quality))
            }
            AnyGrasp::Spatial(grasp) => {
                let asked =
                    Asked::parse(criterion, rtol, external_wrench, metric, max_facets).map_err(wrong)?;
                let quality = quality_of(py, grasp, &asked.options)?;
                Ok(PyQuality::new(owner, AnyAsked::Spatial(asked), &quality))
            }
        }
    }

    /// The largest multiple of each direction that the limited forces can resist as an external wrench.
    ///
    /// Parameters
    /// ----------
    /// directions : array_like
    ///     (B, d) or (d,) wrenches of any length but zero, in N and N m.
    /// criterion : {"max", "sum"}, optional
    ///     What is limited to 1: each normalised normal force or their sum.
    /// external_wrench : array_like, optional
    ///     (d,) external wrench that acts all the time, such as the weight, in N and N m about ``origin``: the
    ///     multiples are then of what is resisted on top of it.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     (B,) or scalar array: the largest s for which forces within their limits balance
    ///     ``external_wrench + s direction``; zero where no forces balance more of the direction.
    ///
    /// Raises
    /// ------
    /// InvalidInputError
    ///     A direction is zero or not finite, a shape is wrong, the criterion is unknown, or ``external_wrench``
    ///     is not finite, or alone needs more than the limits of the contacts.
    /// InfeasibleWrenchError
    ///     No forces within the friction cones balance ``external_wrench`` alone, however strong they are.
    /// InvalidGraspError
    ///     The contacts' wrenches are too large or too small to compute with; the message says how to scale them.
    /// NotConvergedError
    ///     A solve ended without an answer within its tolerance.
    /// KeyboardInterrupt
    ///     Ctrl-C was pressed; nothing is returned.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5)
    /// >>> grasp.resistance([[0, -1, 0], [-1, 0, 0]]).round(9).tolist()
    /// [1.0, 1.0]
    /// >>> grasp.resistance([[0, -1, 0], [0, 1, 0]], external_wrench=[0, -0.25, 0]).round(9).tolist()
    /// [0.75, 1.25]
    #[pyo3(signature = (directions, criterion="max", external_wrench=None))]
    fn resistance<'py>(
        &self,
        py: Python<'py>,
        directions: &Bound<'py, PyAny>,
        criterion: &str,
        external_wrench: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let wrong = |message: String| invalid_input(py, message);
        let criterion = parse_criterion("criterion", criterion).map_err(wrong)?;
        let (d, array) = (self.wrench_dim(), float_array("directions", directions).map_err(wrong)?);
        let single = match *array.shape() {
            [columns] if columns == d => true,
            [_, columns] if columns == d => false,
            ref given => {
                return Err(wrong(format!(
                    "directions: shape {}, expected (B, {d}) or ({d},)",
                    shaped(given)
                )));
            }
        };
        let constant = external_wrench.map(|wrench| float_vector("external_wrench", wrench, d)).transpose();
        let constant = constant.map_err(wrong)?;
        let multiples = with_grasp!(&self.inner, grasp => {
            let rows = vectors("directions", &array)?;
            let constant = constant.as_deref().map(SVector::from_column_slice);
            detached(py, || grasp.resistance(&rows, criterion, constant.as_ref()))?
        });
        let multiples = PyArray1::from_vec(py, multiples.map_err(|error| to_python(py, &error))?);
        if single { multiples.get_item(0) } else { Ok(multiples.into_any()) }
    }

    /// The other numbers a grasp is judged by: singular values, isotropy, volumes.
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
    #[pyo3(signature = (criterion="max", external_wrench=None, metric=None))]
    fn _gradient(
        &self,
        criterion: &str,
        external_wrench: Option<&Bound<'_, PyAny>>,
        metric: Option<&Bound<'_, PyAny>>,
        py: Python<'_>,
    ) -> PyResult<Py<PyGradient>> {
        let wrong = |message: String| invalid_input(py, message);
        match &self.inner {
            AnyGrasp::Planar(grasp) => {
                let options =
                    quality_options(criterion, None, external_wrench, metric, None).map_err(wrong)?;
                PyGradient::of(py, grasp, &options)
            }
            AnyGrasp::Spatial(grasp) => {
                let options =
                    quality_options(criterion, None, external_wrench, metric, None).map_err(wrong)?;
                PyGradient::of(py, grasp, &options)
            }
        }
    }

    /// Singular values of the grasp matrix in the norm of the length scale, largest first.
    fn _singular_values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, with_grasp!(&self.inner, grasp => grasp.singular_values()))
    }

    /// All points of the Minkowski sum of the contacts' wrenches, by Algorithm 1 in its order.
    ///
    /// There are ``prod(l_i + 1) - 1`` of them: for teaching, small problems, and as the definition of what the
    /// other methods compute without listing it.
    ///
    /// Parameters
    /// ----------
    /// max_points : int, optional
    ///     Refuse to list more.
    ///
    /// Returns
    /// -------
    /// MinkowskiSum
    ///     The points and which extreme forces make each of them.
    ///
    /// Raises
    /// ------
    /// TooLargeError
    ///     There are more than ``max_points``; the message says how many, and how many bytes.
    /// InvalidGraspError
    ///     A contact has its true cone, which has no finite set.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> ms = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]).minkowski_sum()
    /// >>> len(ms), ms.wrenches.shape
    /// (8, (8, 3))
    #[pyo3(signature = (max_points=DEFAULT_MAX_POINTS), text_signature = "($self, max_points=2000000)")]
    fn minkowski_sum(&self, py: Python<'_>, max_points: u128) -> PyResult<PyMinkowskiSum> {
        with_grasp!(&self.inner, grasp => {
            let sum = detached(py, || MinkowskiSum::with_limit(grasp, max_points))?;
            PyMinkowskiSum::new(py, grasp, &sum.map_err(|error| to_python(py, &error))?)
        })
    }

    /// Contacts and what is derived from them as plain Python numbers and lists, ready for JSON.
    ///
    /// Examples
    /// --------
    /// >>> import graspforce as gf
    /// >>> gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)]).to_dict()["positions"]
    /// [[-1.0, 0.0], [1.0, 0.0]]
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("grasp_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("grasp_html", (slf,))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        Ok((py.import("graspforce._core")?.getattr("unwarned_grasp")?, self.arguments.to_python(py)?))
    }

    fn __repr__(&self) -> String {
        let kind = if self.arguments.dim == 2 { "planar" } else { "spatial" };
        let (contacts, s) = (self.arguments.contacts, if self.arguments.contacts == 1 { "" } else { "s" });
        let forces = with_grasp!(&self.inner, grasp => match grasp.extreme_forces() {
            Ok(forces) => format!("{} extreme forces", forces.len()),
            Err(_) => "true cones".to_string(),
        });
        format!("Grasp({kind}, {contacts} contact{s}, {forces})")
    }
}
