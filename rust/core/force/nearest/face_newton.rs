//! Newton's method on the exposed faces: the nearest wrench to machine precision once the faces are known.
//!
//! In the coordinates where the metric is Euclidean let `t` be the target and `n` the unit normal of the nearest wrench, at
//! the distance `d`. Every force reaches furthest along `h_i = A_i^T n`. On a rim or a ray its direction is a smooth function
//! of `h_i`; flat directions `a` are orthogonal to it. With their coefficients `c` the equations
//!
//! ```text
//! d n + sum_i A_i f_i(n, c) = t,    |n| = 1,    a . h_i = 0  for every flat direction and every ray
//! ```
//!
//! are square. No weight regularises them, and so no digits are lost. The normal keeps its meaning where the distance
//! vanishes: for wrenches exactly on the boundary of what contacts exert.

use nalgebra::SMatrix;

use crate::force::nearest::exposed_face::{ExposedFace, Freedom, exposed_directions};
use crate::force::squares::dual::{Dual, DualContact, ForceSet};
use crate::grasp::contact::ContactForce;
use crate::grasp::{ContactMap, Wrench};
use crate::tolerances::{DEPENDENT_DIRECTION, INDEPENDENT_DIRECTION, TOUCHING};
use crate::wrench_set::cone::{cone_slope, cone_support};

/// Newton steps; two or three are usual.
const MAX_FACE_STEPS: usize = 8;

/// The step that ends the iteration, relative to the normal and to the target.
const CONVERGED_NORMAL: f64 = 1e-14;

/// The next step squares a step: one of this size is the last.
const NEARLY: f64 = 1e-8;

/// The normal turns by less than this in the first step.
const FURTHEST_TURN: f64 = 1.0;

/// The least distance in Newton's matrix, relative to the target: corners and faces have normals of their own choice.
const DAMPED: f64 = 1e-7;

/// Columns outside the span of those before: `Q` orthonormal, `R` triangular.
struct Columns<const D: usize> {
    q: [Wrench<D>; D],
    r: [[f64; D]; D],
    len: usize,
}

impl<const D: usize> Columns<D> {
    fn new() -> Self {
        Self { q: [Wrench::zeros(); D], r: [[0.0; D]; D], len: 0 }
    }

    /// False where the column depends on those before.
    fn push(&mut self, column: &Wrench<D>, dependent: f64) -> bool {
        let length = column.norm();
        if self.len == D || length == 0.0 {
            return false;
        }
        let mut rest = *column;
        let mut along = [0.0; D];
        for _ in 0..2 {
            for (axis, along) in self.q[..self.len].iter().zip(&mut along) {
                let by = axis.dot(&rest);
                *along += by;
                rest -= axis * by;
            }
        }
        let left = rest.norm();
        if left <= dependent * length {
            return false;
        }
        for (row, along) in self.r[..self.len].iter_mut().zip(along) {
            row[self.len] = along;
        }
        self.r[self.len][self.len] = left;
        self.q[self.len] = rest / left;
        self.len += 1;
        true
    }
}

/// Moves the normal `n` and the forces to the solution of the equations; false where Newton's method does not lead there.
pub(crate) fn settle<const D: usize>(
    dual: &Dual<D>,
    maps: &[ContactMap<D>],
    faces: &[ExposedFace],
    target: &Wrench<D>,
    n: &mut Wrench<D>,
    forces: &mut [ContactForce],
) -> bool {
    let size = target.norm();
    let mut distance = 0.0;
    for ((contact, map), (face, force)) in dual.contacts.iter().zip(maps).zip(faces.iter().zip(&mut *forces))
    {
        follow(contact, face, &map.tr_mul(n), force);
        distance -= n.dot(&(map * *force));
    }
    distance += n.dot(target);
    let (mut last, mut before) = (false, FURTHEST_TURN);
    for _ in 0..MAX_FACE_STEPS {
        let Some((step, further)) = newton_step(dual, maps, faces, target, (n, distance), forces) else {
            return false;
        };
        let moved = step.norm();
        // A normal that turns so far, or no less than before, has left the faces.
        if moved >= before || moved.is_nan() {
            return false;
        }
        before = 0.7 * moved.max(NEARLY);
        *n = (*n + step).normalize();
        distance += further;
        let moved = moved.max(further.abs() / size);
        if last || moved <= CONVERGED_NORMAL {
            for ((contact, map), (face, force)) in
                dual.contacts.iter().zip(maps).zip(faces.iter().zip(&mut *forces))
            {
                follow(contact, face, &map.tr_mul(n), force);
            }
            return true;
        }
        last = moved <= NEARLY;
    }
    false
}

/// Turns a force on its rim or ray into the direction that reaches furthest along `h`; returns that direction.
fn follow<const D: usize>(
    contact: &DualContact<D>,
    face: &ExposedFace,
    h: &ContactForce,
    force: &mut ContactForce,
) -> ContactForce {
    let ForceSet::Cone(cone) = &contact.set else { return ContactForce::zeros() };
    if !matches!(face.freedom, Freedom::Rim | Freedom::Ray) {
        return ContactForce::zeros();
    }
    let furthest = cone_support(h, cone.mu, cone.gamma);
    *force = furthest * force[0];
    furthest
}

/// One step of the normal and of the distance; the flat coefficients move at once.
fn newton_step<const D: usize>(
    dual: &Dual<D>,
    maps: &[ContactMap<D>],
    faces: &[ExposedFace],
    target: &Wrench<D>,
    (n, distance): (&Wrench<D>, f64),
    forces: &mut [ContactForce],
) -> Option<(Wrench<D>, f64)> {
    let mut rest = n * distance - target;
    let mut matrix = SMatrix::<f64, D, D>::identity() * distance.max(DAMPED * target.norm());
    for ((contact, map), (face, force)) in dual.contacts.iter().zip(maps).zip(faces.iter().zip(&mut *forces))
    {
        let h = map.tr_mul(n);
        let furthest = follow(contact, face, &h, force);
        rest += map * *force;
        if let (ForceSet::Cone(cone), Freedom::Rim | Freedom::Ray) = (&contact.set, face.freedom) {
            let slope = cone_slope(&h, cone.mu, cone.gamma);
            if slope > 0.0 {
                curve(&mut matrix, map, [cone.mu, cone.mu, cone.gamma], &furthest, force[0] / slope);
            } else if cone.mu > 0.0 || cone.gamma > 0.0 {
                return None;
            }
        }
    }
    let factor = matrix.cholesky()?.unpack();
    let mut v = rest;
    factor.solve_lower_triangular_unchecked_mut(&mut v);
    let mut columns = Columns::<D>::new();
    let mut slopes = [0.0; D];
    let mut places = [(0, 0); D];
    // The distance moves along the normal, and the normal does not grow.
    let mut column = *n;
    factor.solve_lower_triangular_unchecked_mut(&mut column);
    columns.push(&column, DEPENDENT_DIRECTION);
    for (i, (map, face)) in maps.iter().zip(faces).enumerate() {
        let h = map.tr_mul(n);
        let ray = follow(&dual.contacts[i], face, &h, &mut forces[i]);
        for (k, axis) in face.directions(&ray).iter().enumerate() {
            let mut column = map * axis;
            factor.solve_lower_triangular_unchecked_mut(&mut column);
            let at = columns.len;
            if columns.push(&column, DEPENDENT_DIRECTION) {
                (slopes[at], places[at]) = (axis.dot(&h), (i, k));
            }
        }
    }
    // With `v = L^-1 F` and `B = Q R`: `R^T p = g - R^T Q^T v`, `R c = p`, and `n` moves by `-L^-T (v + Q p)`.
    let Columns { q, r, len } = &columns;
    let mut p = [0.0; D];
    for k in 0..*len {
        let known: f64 = (0..k).map(|j| r[j][k] * p[j]).sum();
        p[k] = (slopes[k] - known) / r[k][k];
    }
    let mut moved = v;
    for (p, axis) in p[..*len].iter_mut().zip(q) {
        *p -= axis.dot(&v);
        moved += axis * *p;
    }
    factor.tr_solve_lower_triangular_mut(&mut moved);
    let mut c = p;
    for k in (0..*len).rev() {
        let known: f64 = (k + 1..*len).map(|j| r[k][j] * c[j]).sum();
        c[k] = (c[k] - known) / r[k][k];
        if k == 0 {
            break;
        }
        let (i, axis) = places[k];
        let ray = follow(&dual.contacts[i], &faces[i], &maps[i].tr_mul(n), &mut forces[i]);
        let direction = faces[i].directions(&ray)[axis];
        forces[i] += direction * c[k];
    }
    Some((-moved, c[0]))
}

/// Adds how a force on its rim or ray turns with the normal: `by A S (1 - u u^T) S A^T`, where `furthest = (1, S u)`.
fn curve<const D: usize>(
    matrix: &mut SMatrix<f64, D, D>,
    map: &ContactMap<D>,
    scales: [f64; 3],
    furthest: &ContactForce,
    by: f64,
) {
    let mut along = Wrench::<D>::zeros();
    for (k, scale) in scales.into_iter().enumerate().filter(|(_, scale)| *scale > 0.0) {
        let column = map.column(k + 1);
        along += column * furthest[k + 1];
        matrix.syger(by * scale * scale, &column, &column, 1.0);
    }
    matrix.syger(-by, &along, &along, 1.0);
}

/// Whether no other forces exert the wrench with this normal: the directions of all exposed faces are independent.
pub(crate) fn are_the_only_ones<const D: usize>(
    dual: &Dual<D>,
    maps: &[ContactMap<D>],
    n: &Wrench<D>,
) -> bool {
    let mut columns = Columns::<D>::new();
    let mut only = true;
    for (contact, map) in dual.contacts.iter().zip(maps) {
        let touching = TOUCHING * map.norm();
        // Extreme forces of one contact depend on each other, but their sums of coefficients count only where they differ.
        let counts = matches!(&contact.set, ForceSet::Finite(polytope) if polytope.general);
        let (mut axes, mut count) = ([ContactForce::zeros(); 4], 0);
        exposed_directions(&contact.set, &map.tr_mul(n), touching, |direction| {
            let mut axis = direction;
            if !counts {
                for known in axes[..count].iter().chain(&axes[..count]) {
                    axis -= known * known.dot(&axis);
                }
                if count == axes.len() || axis.norm() <= INDEPENDENT_DIRECTION * direction.norm() {
                    return;
                }
                axis.normalize_mut();
                axes[count] = axis;
                count += 1;
            }
            only = only && columns.push(&(map * axis), INDEPENDENT_DIRECTION);
        });
    }
    only
}
