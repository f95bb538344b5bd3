//! `graspforce.torque_limited_forces`.

use nalgebra::Vector3;
use numpy::{PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, matrix, shaped};
use crate::convert::errors::{invalid_input, to_python};
use crate::convert::scalars::{Given, number, whole};
use crate::runtime::interrupt::detached;

/// Extreme forces that joint torques and friction both allow, for ``Grasp(extreme_forces=...)``.
///
/// A finger that exerts the force f at its contact needs the joint torques ``J^T f``. Limits on them cut a
/// polytope out of the linearised friction cone; its vertices, exact to rounding, are extreme forces in the sense
/// of Eq. 3. Any number of threads may call this at once.
///
/// Parameters
/// ----------
/// jacobian : array_like
///     (3, q) hand Jacobian of one finger in m: it takes the velocities of q joints to the velocity of the contact
///     point in the contact frame, rows ``[n, o, t]``.
/// torque_limits : array_like
///     (q,) largest torques in N m, in both directions, or (2, q) lower and upper limits. Zero must be allowed.
/// friction : float, optional
///     Coulomb friction coefficient, positive.
/// max_normal_force : float, optional
///     Upper bound of the normal force in N.
/// edges : int, optional
///     Edges of the friction cone, 3 to 256.
///
/// Returns
/// -------
/// numpy.ndarray
///     (l, 3) vertices ``[f_n, f_o, f_t]`` in N, without the origin.
///
/// Raises
/// ------
/// InvalidInputError
///     A shape or a value is unusable, or the limits allow no force but zero.
///
/// Examples
/// --------
/// One joint presses along the normal with a lever of 0.1 m and at most 0.5 N m: 5 N.
///
/// >>> import graspforce as gf
/// >>> forces = gf.torque_limited_forces([[0.1], [0], [0]], [0.5], friction=0.4, max_normal_force=20, edges=4)
/// >>> forces.shape, forces[:, 0].round(9).tolist()
/// ((4, 3), [5.0, 5.0, 5.0, 5.0])
#[pyfunction]
#[pyo3(
    signature = (jacobian, torque_limits, friction=Given::default(), max_normal_force=Given::default(),
        edges=Given::default()),
    text_signature = "(jacobian, torque_limits, friction=0.5, max_normal_force=1.0, edges=8)"
)]
pub fn torque_limited_forces<'py>(
    py: Python<'py>,
    jacobian: &Bound<'py, PyAny>,
    torque_limits: &Bound<'py, PyAny>,
    friction: Given<'py>,
    max_normal_force: Given<'py>,
    edges: Given<'py>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let wrong = |message: String| invalid_input(py, message);
    let columns = columns(jacobian).map_err(wrong)?;
    let (lower, upper) = limits(torque_limits, columns.len()).map_err(wrong)?;
    let friction = friction.or(0.5, |value| number("friction", value)).map_err(wrong)?;
    let max_normal_force =
        max_normal_force.or(1.0, |value| number("max_normal_force", value)).map_err(wrong)?;
    let edges = edges.or(8, |value| whole("edges", value, EDGES)).map_err(wrong)?;
    let forces = detached(py, || {
        graspforce::torque_limited_forces(&columns, &lower, &upper, friction, max_normal_force, edges)
    })?
    .map_err(|error| to_python(py, &error))?;
    matrix(py, forces.len(), 3, forces.iter().flat_map(|force| [force[0], force[1], force[2]]))
}

/// As the core allows them.
const EDGES: std::ops::RangeInclusive<usize> = 3..=256;

fn columns(jacobian: &Bound<'_, PyAny>) -> Result<Vec<Vector3<f64>>, String> {
    let array = float_array("jacobian", jacobian)?;
    let &[3, joints] = array.shape() else {
        return Err(format!("jacobian: shape {}, expected (3, q)", shaped(array.shape())));
    };
    let values = contents(&array);
    Ok((0..joints).map(|j| Vector3::from_fn(|row, _| values[row * joints + j])).collect())
}

fn limits(given: &Bound<'_, PyAny>, joints: usize) -> Result<(Vec<f64>, Vec<f64>), String> {
    let array = float_array("torque_limits", given)?;
    let values = contents(&array);
    match *array.shape() {
        [q] if q == joints => Ok((values.iter().map(|limit| -limit).collect(), values.to_vec())),
        [2, q] if q == joints => Ok((values[..q].to_vec(), values[q..].to_vec())),
        ref given => {
            Err(format!("torque_limits: shape {}, expected ({joints},) or (2, {joints})", shaped(given)))
        }
    }
}
