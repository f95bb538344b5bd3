//! The maps `G_i` of contact forces to wrenches in 32 digits, from positions and normals as they were given.
//!
//! A unit normal of 16 digits points `1e-16` rad aside. Where friction is as small as `1e-10`, that is a millionth of the
//! cone, and more of what the contact exerts along the thinnest direction of the set.

use nalgebra::Vector3;

use crate::grasp::contact::default_seed;
use crate::grasp::{ContactMap, Grasp};
use crate::linalg::double_double::DoubleDouble;

/// A wrench in 32 digits, or a functional on wrenches.
pub(crate) type Wrench32<const D: usize> = [DoubleDouble; D];

type Vector32 = [DoubleDouble; 3];

/// The columns of `G_i`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExactMap<const D: usize>([Wrench32<D>; 4]);

impl<const D: usize> ExactMap<D> {
    pub(crate) fn of(grasp: &Grasp<D>, i: usize) -> Self {
        let contact = &grasp.contacts()[i];
        let origin = exact(&grasp.options().origin);
        let lever = combined(&exact(&contact.position), &origin, -DoubleDouble::ONE);
        let n = unit(&exact(&grasp.given_normals()[i]));
        let o = if D == 3 { exact(&-Vector3::z()) } else { first_tangent(grasp, i, &n) };
        let column = |axis: &Vector32| wrench(axis, &cross(&lever, axis));
        let zero = [DoubleDouble::ZERO; 3];
        Self([column(&n), column(&o), column(&cross(&n, &o)), wrench(&zero, &n)])
    }

    /// The columns, each times a factor.
    pub(crate) fn scaled(&self, factors: &[f64; 4]) -> [Wrench32<D>; 4] {
        std::array::from_fn(|k| self.0[k].map(|x| x.times(factors[k])))
    }

    /// `A G_i` in 16 digits, for a matrix `A` given by its rows.
    pub(crate) fn through(&self, rows: &[Wrench32<D>; D]) -> ContactMap<D> {
        ContactMap::from_fn(|row, column| dot(&rows[row], &self.0[column]).value())
    }
}

/// The inner product.
pub(crate) fn dot<const D: usize>(a: &[DoubleDouble; D], b: &[DoubleDouble; D]) -> DoubleDouble {
    a.iter().zip(b).fold(DoubleDouble::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// `a + b * by`.
pub(crate) fn combined<const D: usize>(
    a: &[DoubleDouble; D],
    b: &[DoubleDouble; D],
    by: DoubleDouble,
) -> [DoubleDouble; D] {
    std::array::from_fn(|k| a[k] + b[k] * by)
}

fn exact(v: &Vector3<f64>) -> Vector32 {
    [v.x.into(), v.y.into(), v.z.into()]
}

fn cross(a: &Vector32, b: &Vector32) -> Vector32 {
    let part = |i: usize, k: usize| a[i] * b[k] - a[k] * b[i];
    [part(1, 2), part(2, 0), part(0, 1)]
}

/// Scaled first: squares of the given components may not be representable.
fn unit(v: &Vector32) -> Vector32 {
    let largest = v.iter().fold(DoubleDouble::ZERO, |largest, x| largest.max(x.abs()));
    let scaled = v.map(|x| x / largest);
    let length = dot(&scaled, &scaled).sqrt();
    scaled.map(|x| x / length)
}

/// As the contact's frame has it, with the same choice of the seed.
fn first_tangent<const D: usize>(grasp: &Grasp<D>, i: usize, n: &Vector32) -> Vector32 {
    let seed = match &grasp.contacts()[i].tangent {
        Some(tangent) => unit(&exact(tangent)),
        None => exact(&default_seed(&grasp.contacts()[i].normal)),
    };
    unit(&combined(&seed, n, -dot(n, &seed)))
}

fn wrench<const D: usize>(force: &Vector32, torque: &Vector32) -> Wrench32<D> {
    if D == 3 {
        return std::array::from_fn(|row| [force[0], force[1], torque[2]][row]);
    }
    std::array::from_fn(|row| if row < 3 { force[row] } else { torque[row - 3] })
}
