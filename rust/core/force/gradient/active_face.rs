//! The least face of a friction cone that holds a force: the directions in which it can move and still be feasible, both
//! forth and back.

use nalgebra::SMatrix;

use crate::grasp::Grasp;
use crate::grasp::contact::ContactForce;

/// A force whose friction comes this near to its cone, relative to the normal force, lies on it.
const ACTIVE: f64 = 1e-9;

/// Most extreme forces of a basic combination.
const MAX_EDGES: usize = 4;

/// A force with its share of the limit.
pub(crate) type Generator = (ContactForce, f64);

/// Forces that span the least face of contact `i`'s cone that holds `force`, which is not zero. The first has a share.
///
/// Where extreme forces make `force` in several ways these may be fewer than span the face, never more.
pub(crate) fn active_face<const D: usize>(
    grasp: &Grasp<D>,
    i: usize,
    force: &ContactForce,
) -> Vec<Generator> {
    if let Some(range) = grasp.edges(i) {
        return combination(&grasp.finite_forces()[range], force);
    }
    let contact = &grasp.contacts()[i];
    let limit = contact.max_normal_force;
    let unit = |row: usize| (ContactForce::from_fn(|other, _| f64::from(u8::from(other == row))), 0.0);
    // Coordinates in which the cone is round.
    let scales = [1.0, contact.friction, contact.friction, contact.torsion];
    let components = grasp.force_components().iter().filter(|&&row| row > 0 && scales[row] > 0.0);
    let rows: Vec<usize> = components.copied().collect();
    let slope = rows.iter().map(|&row| (force[row] / scales[row]).powi(2)).sum::<f64>().sqrt();
    let mut face = vec![(*force, force[0] / limit)];
    if slope < force[0] * (1.0 - ACTIVE) {
        face.extend(rows.iter().map(|&row| unit(row)));
        return face;
    }
    // The tangents of the cone that keep the normal force are orthogonal, in these coordinates, to the friction.
    let Some(&largest) = rows
        .iter()
        .max_by(|a, b| (force[**a] / scales[**a]).abs().total_cmp(&(force[**b] / scales[**b]).abs()))
    else {
        return face;
    };
    for &row in rows.iter().filter(|&&row| row != largest) {
        let mut tangent = ContactForce::zeros();
        tangent[row] = scales[row] * (force[largest] / scales[largest]);
        tangent[largest] = -scales[largest] * (force[row] / scales[row]);
        face.push((tangent, 0.0));
    }
    face
}

/// Extreme forces that make `force` with positive coefficients, by nonnegative least squares.
fn combination(edges: &[ContactForce], force: &ContactForce) -> Vec<Generator> {
    let size = force.norm();
    let unit = |h: usize| edges[h] / edges[h].norm();
    let mut used: Vec<(usize, f64)> = Vec::with_capacity(MAX_EDGES);
    for _ in 0..8 * MAX_EDGES {
        let rest = used.iter().fold(force / size, |rest, (h, x)| rest - unit(*h) * *x);
        let best = (0..edges.len()).filter(|h| used.iter().all(|(other, _)| other != h));
        let best = best.map(|h| (unit(h).dot(&rest), h)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, entering)) = best.filter(|(gain, _)| *gain > ACTIVE) else { break };
        if used.len() == MAX_EDGES {
            break;
        }
        used.push((entering, 0.0));
        loop {
            let gram =
                SMatrix::<f64, MAX_EDGES, MAX_EDGES>::from_fn(|r, c| match (used.get(r), used.get(c)) {
                    (Some((r, _)), Some((c, _))) => unit(*r).dot(&unit(*c)),
                    _ => f64::from(u8::from(r == c)),
                });
            let target =
                ContactForce::from_fn(|r, _| used.get(r).map_or(0.0, |(h, _)| unit(*h).dot(force) / size));
            let Some(found) = gram.lu().solve(&target) else { return generators(edges, &used) };
            let step = used.iter().zip(found.iter()).filter(|(_, x)| **x <= 0.0);
            let step = step.map(|((_, old), x)| old / (old - x)).fold(1.0, f64::min);
            used.iter_mut().zip(found.iter()).for_each(|((_, old), x)| *old += step * (x - *old));
            if step == 1.0 {
                break;
            }
            used.retain(|(_, x)| *x > f64::EPSILON);
        }
    }
    generators(edges, &used)
}

fn generators(edges: &[ContactForce], used: &[(usize, f64)]) -> Vec<Generator> {
    used.iter().filter(|(_, x)| *x > ACTIVE).map(|(h, _)| (edges[*h], 1.0)).collect()
}
