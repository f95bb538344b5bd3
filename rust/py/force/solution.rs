//! `graspforce.ForceSolution`.

use graspforce::{ContactForce, Distribution};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::{as_array, matrix, read_only, vector};
use crate::convert::dimension::{Dimensional, by_dimension};
use crate::convert::errors::invalid_input;
use crate::convert::restored;
use crate::convert::scalars::{Given, choice};
use crate::convert::significant::significant;
use crate::force::distribution_state::DistributionState;
use crate::force::joint_torques::joint_torques;
use crate::force::query::{ForceQuery, Pickled};
use crate::grasp::PyGrasp;
use crate::runtime::memory::{Work, check_work};

/// Least contact forces for one external wrench, with their certificate.
///
/// It is immutable and may be shared between threads, copied and pickled; `numpy.asarray` gives its forces.
#[pyclass(name = "ForceSolution", module = "graspforce", frozen)]
pub struct PyForceSolution {
    grasp: Py<PyGrasp>,
    distribution: AnyDistribution,
    query: ForceQuery,
}

pub type AnyDistribution = Dimensional<Distribution<3>, Distribution<6>>;

/// Runs the same expression on a distribution and its grasp, where they are of one dimension.
macro_rules! with_both {
    ($py:expr, $solution:expr, |$distribution:ident, $grasp:ident| $body:expr) => {
        match $solution.distribution.as_ref().with($solution.grasp.get().inner.as_ref()) {
            Some(both) => by_dimension!(both, ($distribution, $grasp) => $body),
            None => return Err(invalid_input($py, "the forces belong to a grasp of another dimension")),
        }
    };
}

#[pymethods]
impl PyForceSolution {
    /// The grasp that exerts the forces.
    #[getter]
    fn grasp(&self, py: Python<'_>) -> Py<PyGrasp> {
        self.grasp.clone_ref(py)
    }

    /// (d,) the external wrench that was given, in N and N m.
    #[getter]
    fn external_wrench<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let given = &self.query.external_wrench;
        vector(py, "external_wrench", given.len(), given.iter().copied())
    }

    /// "max", "sum" or "squares": what was minimised.
    #[getter]
    fn objective(&self) -> &'static str {
        self.query.objective
    }

    /// Weight of the sum that the objective adds to the maximum.
    #[getter]
    fn weight(&self) -> f64 {
        self.query.weight
    }

    /// Largest relative gap that counted as solved.
    #[getter]
    fn rtol(&self) -> f64 {
        self.query.rtol
    }

    /// (m, k) contact forces in the contact frames, ``[n, (o,) t, (torsion)]``, in N (torsion in N m).
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let components = by_dimension!(&self.grasp.get().inner, grasp => grasp.force_components());
        let forces = self.contact_forces();
        let values = forces.iter().flat_map(|force| components.iter().map(|&row| force[row]));
        matrix(py, forces.len(), components.len(), values).map(read_only)
    }

    /// (m, dim) contact forces in world axes, without torsion, in N.
    #[getter]
    fn world_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = match self.distribution {
            Dimensional::Planar(_) => 2,
            Dimensional::Spatial(_) => 3,
        };
        self.check_arrays(py)?;
        let world = with_both!(py, self, |distribution, grasp| distribution.world_forces(grasp));
        let values = world.iter().flat_map(|force| force.iter().copied().take(dim));
        matrix(py, world.len(), dim, values).map(read_only)
    }

    /// (m, d) wrench of each contact in N and N m; they sum to ``residual - external_wrench``.
    #[getter]
    fn contact_wrenches<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.check_arrays(py)?;
        with_both!(py, self, |distribution, grasp| {
            let wrenches = distribution.contact_wrenches(grasp);
            matrix(py, wrenches.len(), distribution.dual.len(), wrenches.iter().flatten().copied())
                .map(read_only)
        })
    }

    /// (d,) ``z_b`` of Eq. 26: the objective changes by ``-dual`` with the external wrench.
    ///
    /// For "max" and "sum" without lower bounds the objective is ``(residual - external_wrench) @ dual``. For "squares"
    /// without reference, bounds and slack that is twice the objective.
    #[getter]
    fn dual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(PyArray1::from_slice(py, by_dimension!(&self.distribution, of => of.dual.as_slice())))
    }

    /// (d,) what the forces leave unbalanced: ``external_wrench + sum_i G_i f_i``, in N and N m.
    ///
    /// It is within `FEASIBILITY_TOLERANCE`, except for forces of `ForceDistributor.nearest` and with ``slack``.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        read_only(PyArray1::from_slice(py, by_dimension!(&self.distribution, of => of.residual.as_slice())))
    }

    /// Whether the forces balance the wrench: the residual is within `FEASIBILITY_TOLERANCE`.
    ///
    /// It is True for every answer of `ForceDistributor.solve` without ``slack``.
    #[getter]
    fn balanced(&self, py: Python<'_>) -> PyResult<bool> {
        Ok(with_both!(py, self, |distribution, grasp| distribution.balanced(grasp, self.query.least_share)))
    }

    /// Norm of the residual: in the metric of `ForceDistributor.nearest`, else in that of the grasp's ``length_scale``.
    #[getter]
    fn distance(&self) -> f64 {
        by_dimension!(&self.distribution, of => of.distance)
    }

    #[doc = include_str!("docs/joint_torques.rst")]
    #[pyo3(
        signature = (jacobians, coupling=None, frame=Given::default()),
        text_signature = "($self, jacobians, coupling=None, frame='world')"
    )]
    fn joint_torques<'py>(
        &self,
        py: Python<'py>,
        jacobians: &Bound<'py, PyAny>,
        coupling: Option<&Bound<'py, PyAny>>,
        frame: Given<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let frame = frame.or("world", |value| choice("frame", value, &["world", "contact"]));
        let frame = frame.map_err(|message| invalid_input(py, message))?;
        let torques = with_both!(py, self, |distribution, grasp| joint_torques(
            grasp,
            &distribution.forces,
            jacobians,
            coupling,
            frame
        ));
        let torques = torques.map_err(|message| invalid_input(py, message))?;
        Ok(read_only(PyArray1::from_vec(py, torques)))
    }

    /// (m,) normalised normal force of each contact, ``f_n / f^U``: its share of its limit.
    ///
    /// With ``extreme_forces`` it is the sum of the coefficients of the contact's extreme forces.
    #[getter]
    fn shares<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let shares = by_dimension!(&self.distribution, distribution => &distribution.shares);
        vector(py, "shares", shares.len(), shares.iter().copied())
    }

    /// (m,) unused share of each contact's friction, before ``friction_margin`` divides it.
    ///
    /// It is 1 for a purely normal force and 0 on the edge of slip: ``1 - 1 / s``, where friction force and torsion may
    /// grow by the factor ``s`` beside the same normal force. With ``extreme_forces`` the contact slips where its force
    /// leaves the cone that these span, whatever their limits.
    #[getter]
    fn slip_margin<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.check_arrays(py)?;
        let margins = with_both!(py, self, |distribution, grasp| distribution.slip_margin(grasp));
        Ok(read_only(PyArray1::from_vec(py, margins)))
    }

    /// The objective.
    ///
    /// "max": ``sigma_max``, plus ``weight`` times ``sigma_sum``. "sum": ``sigma_sum``. "squares": half the weighted sum
    /// of squares, plus ``residual @ slack @ residual / 2``.
    #[getter]
    fn value(&self) -> f64 {
        by_dimension!(&self.distribution, distribution => distribution.sigma)
    }

    /// (m,) the limits in force, in N: the grasp's, or those of `ForceDistributor.set_limits`. Shares refer to them.
    #[getter]
    fn max_normal_force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        vector(py, "max_normal_force", self.query.limits.len(), self.query.limits.iter().copied())
    }

    /// Largest of the shares (Eq. 7).
    #[getter]
    fn sigma_max(&self) -> f64 {
        by_dimension!(&self.distribution, distribution => distribution.sigma_max)
    }

    /// Sum of the shares (Eq. 6).
    #[getter]
    fn sigma_sum(&self) -> f64 {
        by_dimension!(&self.distribution, distribution => distribution.sigma_sum)
    }

    /// Relative distance between the objective and the lower bound that ``dual`` proves, for the wrench that the forces
    /// balance.
    #[getter]
    fn gap(&self) -> f64 {
        by_dimension!(&self.distribution, distribution => distribution.gap)
    }

    /// Simplex pivots of this solve; Newton steps of "squares" and of `ForceDistributor.nearest`.
    ///
    /// It is 0 where a known region held the wrench, and over true cones where Newton's method started from the last
    /// answer.
    #[getter]
    fn pivots(&self) -> usize {
        by_dimension!(&self.distribution, distribution => distribution.pivots)
    }

    /// True if "reduced" needed the whole set for this answer, or if an interior-point solver gave it.
    #[getter]
    fn fell_back(&self) -> bool {
        by_dimension!(&self.distribution, distribution => distribution.fell_back)
    }

    /// True if the objective and its tie-break alone are known to determine the forces.
    ///
    /// Forces that extreme forces can make in several ways (soft fingers) do not count as such.
    #[getter]
    fn unique(&self) -> bool {
        by_dimension!(&self.distribution, distribution => distribution.unique)
    }

    /// ``sigma_max <= 1 + 1e-9``, whatever ``rtol`` is: no share exceeds one by more than rounding.
    #[getter]
    fn within_limits(&self) -> bool {
        by_dimension!(&self.distribution, distribution => distribution.within_limits())
    }

    /// Everything as plain Python numbers and lists, ready for JSON; None in place of NaN.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.to_dict")?.call_method1("solution_dict", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce._internal.html")?.call_method1("solution_html", (slf,))
    }

    /// Draw the grasp with these forces: a figure that notebooks show and ``savefig`` writes. Needs the ``plot``
    /// extra.
    ///
    /// Parameters
    /// ----------
    /// **options
    ///     As for `graspforce.plotting.grasp_figure`: ``title``, ``outline`` and ``mesh``.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (**options))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("graspforce.plotting")?.getattr("solution_figure")?.call((slf,), options)
    }

    #[pyo3(signature = (dtype=None, copy=None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if copy == Some(false) {
            return Err(PyValueError::new_err(
                "the array of forces is made anew each time: a copy cannot be avoided",
            ));
        }
        as_array(self.forces(py)?.as_any(), dtype, copy)
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments, reason = "the state of a pickle, item by item")]
    fn _restore(
        py: Python<'_>,
        grasp: Py<PyGrasp>,
        forces: Vec<[f64; 4]>,
        shares: Vec<f64>,
        wrenches: [Vec<f64>; 2],
        numbers: (f64, f64, f64, f64, f64, usize, f64),
        answers: (bool, bool),
        query: Pickled<'_>,
    ) -> PyResult<Self> {
        let (contacts, d) = (grasp.get().num_contacts(), grasp.get().inner.wrench_dim());
        let lengths =
            [forces.len(), shares.len(), query.5.len(), wrenches[0].len(), wrenches[1].len(), query.0.len()];
        if lengths != [contacts, contacts, contacts, d, d, d] {
            return Err(invalid_input(py, format!("state: lengths {lengths:?} are not those of the grasp")));
        }
        let state = DistributionState { forces, shares, wrenches, numbers, answers };
        let distribution = match d {
            3 => Dimensional::Planar(state.distribution()),
            _ => Dimensional::Spatial(state.distribution()),
        };
        let wrong = |message: String| invalid_input(py, message);
        let query = ForceQuery::restored(query).map_err(wrong)?;
        let restored = Self { grasp, distribution, query };
        let wrench = &restored.query.external_wrench;
        with_both!(py, restored, |distribution, grasp| restored::forces(distribution, grasp, wrench))
            .map_err(wrong)?;
        Ok(restored)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        this.check_arrays(py)?;
        let DistributionState { forces, shares, wrenches, numbers, answers } =
            by_dimension!(&this.distribution, distribution => DistributionState::of(distribution));
        let state = (&this.grasp, forces, shares, wrenches, numbers, answers, this.query.state());
        let state = state.into_pyobject(py)?;
        Ok((py.get_type::<Self>().getattr("_restore")?, state))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let shown = |name: &str, value: f64| format!("{name}={}, ", significant(value, 6));
        let value =
            if self.query.objective == "squares" { shown("value", self.value()) } else { String::new() };
        let distance = if self.balanced(py)? { String::new() } else { shown("distance", self.distance()) };
        Ok(format!(
            "ForceSolution({value}{}{}{distance}gap={})",
            shown("sigma_max", self.sigma_max()),
            shown("sigma_sum", self.sigma_sum()),
            significant(self.gap(), 2)
        ))
    }
}

impl PyForceSolution {
    /// The answer about a grasp.
    pub fn new(grasp: Py<PyGrasp>, distribution: AnyDistribution, query: ForceQuery) -> Self {
        Self { grasp, distribution, query }
    }

    fn check_arrays(&self, py: Python<'_>) -> PyResult<()> {
        by_dimension!(&self.grasp.get().inner, grasp => check_work(py, grasp, Work::Arrays))
    }

    fn contact_forces(&self) -> &[ContactForce] {
        by_dimension!(&self.distribution, distribution => &distribution.forces)
    }
}
