//! Joint torques that exert contact forces.

use graspforce::{ContactForce, Grasp};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::convert::arrays::{contents, float_array, refuse_not_finite, shaped};
use crate::convert::significant::significant;

/// Torsion below this share of the contact's largest component is rounding.
const NO_TORSION: f64 = 1e-9;

/// `C^T sum_i J_i^T F_i` for contact Jacobians of the joints, with the force of each contact (and its torsion as a
/// torque about the normal) in world axes or in its contact frame.
pub fn joint_torques<const D: usize>(
    grasp: &Grasp<D>,
    forces: &[ContactForce],
    jacobians: &Bound<'_, PyAny>,
    coupling: Option<&Bound<'_, PyAny>>,
    frame: &str,
) -> Result<Vec<f64>, String> {
    let in_world = match frame {
        "world" => true,
        "contact" => false,
        other => return Err(format!("frame: {other:?} is neither \"world\" nor \"contact\"")),
    };
    let of_all: PyResult<Vec<Bound<'_, PyAny>>> = jacobians.try_iter().and_then(Iterator::collect);
    let of_all = of_all.ok().filter(|_| !jacobians.is_instance_of::<PyString>());
    let of_all = of_all.ok_or("jacobians: not a list of arrays, one for each contact")?;
    if of_all.len() != forces.len() {
        return Err(format!("jacobians: {} matrices for {} contacts", of_all.len(), forces.len()));
    }
    let dim = if D == 3 { 2 } else { 3 };
    let mut torques: Option<Vec<f64>> = None;
    for (i, ((jacobian, force), axes)) in of_all.iter().zip(forces).zip(grasp.frames()).enumerate() {
        let argument = format!("jacobians, contact {i}");
        let array = float_array(&argument, jacobian)?;
        let numbers = contents(&array);
        let &[rows, joints] = array.shape() else {
            let given = shaped(array.shape());
            return Err(format!("{argument}: shape {given}, expected ({dim}, n) or ({D}, n)"));
        };
        let sum = torques.get_or_insert_with(|| vec![0.0; joints]);
        if !(rows == dim || rows == D) || joints != sum.len() {
            let given = shaped(array.shape());
            let n = sum.len();
            return Err(format!("{argument}: shape {given}, expected ({dim}, {n}) or ({D}, {n})"));
        }
        refuse_not_finite(&argument, &array)?;
        if rows == dim && force[3].abs() > NO_TORSION * force.amax() {
            return Err(format!(
                "{argument}: shape ({dim}, {joints}), but the contact exerts a torsion of {} N m; give the Jacobian of \
                 6 rows",
                significant(force[3], 6)
            ));
        }
        let world = axes * force.fixed_rows::<3>(0);
        let twist = axes.column(0) * force[3];
        let load: Vec<f64> = match (in_world, D) {
            (true, 3) => vec![world.x, world.y, 0.0],
            (true, _) => world.iter().chain(twist.iter()).copied().collect(),
            (false, 3) => vec![force[0], force[2], 0.0],
            (false, _) => vec![force[0], force[1], force[2], force[3], 0.0, 0.0],
        };
        for (row, load) in numbers.chunks(joints.max(1)).zip(&load) {
            for (torque, entry) in sum.iter_mut().zip(row) {
                *torque += entry * load;
            }
        }
    }
    let torques = torques.unwrap_or_default();
    let Some(coupling) = coupling else { return Ok(torques) };
    let array = float_array("coupling", coupling)?;
    let &[joints, independent] = array.shape() else {
        return Err(format!("coupling: shape {}, expected ({}, q)", shaped(array.shape()), torques.len()));
    };
    if joints != torques.len() {
        return Err(format!("coupling: shape {}, expected ({}, q)", shaped(array.shape()), torques.len()));
    }
    refuse_not_finite("coupling", &array)?;
    let mut coupled = vec![0.0; independent];
    for (row, torque) in contents(&array).chunks(independent.max(1)).zip(&torques) {
        for (sum, entry) in coupled.iter_mut().zip(row) {
            *sum += entry * torque;
        }
    }
    if coupled.iter().any(|x| !x.is_finite()) {
        return Err("coupling: the torques exceed the numbers that float64 holds".into());
    }
    Ok(coupled)
}
