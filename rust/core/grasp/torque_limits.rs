//! What a finger can exert: contact forces that joint torques and friction both allow.
//!
//! A finger with hand Jacobian `J_i` (joint velocities to the velocity of the contact point, here in the contact
//! frame) needs the torques `tau = J_i^T f`. Limits on them cut a polytope out of the friction cone; its
//! vertices are extreme forces in the sense of Eq. 3 and go into
//! [`ForceModel::Extreme`](crate::ForceModel::Extreme).

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result, digits};
use crate::grasp::REPRESENTABLE;
use crate::grasp::contact::ContactForce;
use crate::interrupt;
use crate::tolerances::OUTSIDE_TORQUE_LIMITS;

/// A half-space `normal . f <= bound`.
type HalfSpace = (Vector3<f64>, f64);

/// The vertices of all forces `f = [f_n, f_o, f_t]` with `lower <= J^T f <= upper` in the friction cone with
/// `edges` edges and `f_n <= max_normal_force`, without the origin.
///
/// `jacobian` has one column `[n, o, t]` for each joint, in metres; torques are in N m. Zero torque must be
/// allowed: a finger can always let go. The vertices are exact: each is where three bounds meet.
///
/// ```
/// use graspforce::torque_limited_forces;
/// use nalgebra::Vector3;
///
/// // One joint that presses along the normal with a lever of 0.1 m and at most 0.5 N m: 5 N.
/// let forces = torque_limited_forces(&[Vector3::new(0.1, 0.0, 0.0)], &[-0.5], &[0.5], 0.4, 20.0, 4)?;
/// assert_eq!(forces.len(), 4);
/// assert!(forces.iter().all(|f| (f[0] - 5.0).abs() < 1e-12));
/// # Ok::<(), graspforce::Error>(())
/// ```
pub fn torque_limited_forces(
    jacobian: &[Vector3<f64>],
    lower: &[f64],
    upper: &[f64],
    friction: f64,
    max_normal_force: f64,
    edges: usize,
) -> Result<Vec<ContactForce>> {
    check(jacobian, lower, upper)?;
    for (argument, value) in [("friction", friction), ("max_normal_force", max_normal_force)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::input(argument, format!("{} must be finite and positive", digits(value))));
        }
    }
    if !(3..=256).contains(&edges) {
        return Err(Error::input("edges", format!("{edges} is not between 3 and 256")));
    }
    let limits = limits(jacobian, lower, upper, max_normal_force);
    let half_spaces: Vec<HalfSpace> = limits.iter().copied().chain(facets(friction, edges)).collect();
    let mut vertices: Vec<Vector3<f64>> = Vec::new();
    for (i, a) in half_spaces[..limits.len()].iter().enumerate() {
        for (j, b) in half_spaces.iter().enumerate().skip(i + 1) {
            interrupt::check()?;
            for (k, c) in half_spaces.iter().enumerate().skip(j + 1) {
                // Only facets side by side meet on the cone elsewhere than in its tip.
                if j >= limits.len() && k - j != 1 && k - j != edges - 1 {
                    continue;
                }
                let Some(vertex) = intersection([a, b, c]) else { continue };
                // Relative to this vertex: the normal force may be limited to far more than torques allow.
                let rounding = OUTSIDE_TORQUE_LIMITS * vertex.amax();
                let inside = half_spaces.iter().all(|(n, bound)| n.dot(&vertex) - bound <= rounding);
                let near = |other: &Vector3<f64>| (other - vertex).amax() <= rounding;
                if inside && vertex.amax() > 0.0 && !vertices.iter().any(near) {
                    vertices.push(vertex);
                }
            }
        }
    }
    if vertices.is_empty() {
        return Err(Error::input("torque_limits", "they allow no force but zero"));
    }
    Ok(vertices.iter().map(|f| ContactForce::new(f.x, f.y, f.z, 0.0)).collect())
}

fn check(jacobian: &[Vector3<f64>], lower: &[f64], upper: &[f64]) -> Result<()> {
    if lower.len() != jacobian.len() || upper.len() != jacobian.len() {
        let reason =
            format!("{} lower and {} upper limits for {} joints", lower.len(), upper.len(), jacobian.len());
        return Err(Error::input("torque_limits", reason));
    }
    for (joint, (column, (low, high))) in jacobian.iter().zip(lower.iter().zip(upper)).enumerate() {
        let (size, shown) = (column.amax(), column.as_slice());
        let wrong =
            |argument, reason: String| Err(Error::input(argument, format!("joint {joint}: {reason}")));
        if column.iter().any(|x| !x.is_finite()) {
            return wrong("jacobian", format!("{shown:?} is not finite"));
        }
        if size > 0.0 && !REPRESENTABLE.contains(&size) {
            return wrong("jacobian", format!("{shown:?} lies outside 1e-140 to 1e140; check the units"));
        }
        if !(*low <= 0.0 && *high >= 0.0 && low.is_finite() && high.is_finite()) {
            let limits = format!("limits {} to {}", digits(*low), digits(*high));
            return wrong("torque_limits", format!("{limits} must be finite and allow zero"));
        }
    }
    Ok(())
}

/// Bounds of the normal force and the torques, each with a unit normal.
fn limits(jacobian: &[Vector3<f64>], lower: &[f64], upper: &[f64], max_normal_force: f64) -> Vec<HalfSpace> {
    let mut limits = vec![(Vector3::x(), max_normal_force)];
    for (column, (low, high)) in jacobian.iter().zip(lower.iter().zip(upper)) {
        let length = column.norm();
        if length > 0.0 {
            limits.push((column / length, high / length));
            limits.push((-column / length, -low / length));
        }
    }
    limits
}

/// The sides of the friction cone in order, each with a unit normal.
fn facets(friction: f64, edges: usize) -> impl Iterator<Item = HalfSpace> {
    let edge = move |h: usize| {
        let (s, c) = (std::f64::consts::TAU * h as f64 / edges as f64).sin_cos();
        Vector3::new(1.0, friction * c, friction * s)
    };
    (1..=edges).map(move |h| (edge(h + 1).cross(&edge(h)).normalize(), 0.0))
}

/// The point where three planes meet, if they meet in one point.
fn intersection(planes: [&HalfSpace; 3]) -> Option<Vector3<f64>> {
    let matrix = Matrix3::from_rows(&planes.map(|(normal, _)| normal.transpose()));
    if matrix.determinant().abs() < 1e-12 {
        return None;
    }
    Some(matrix.try_inverse()? * Vector3::from(planes.map(|(_, bound)| *bound)))
}
