//! What rounding has done to a convex set that its support oracle tells of: a bound for every component of its points.
//!
//! With `e` such a bound, a plane `y` certifies `min_k y . v_k - |y| . e` where it would certify `min_k y . v_k`, and a
//! support value along the unit `z` is right to within `|z| . e`. Each contact of a wrench set has its own bound. A contact
//! that is many orders stronger than the others makes only those points uncertain that it takes part in.

use crate::grasp::Wrench;

/// `|z| . e`: what is uncertain along `z`.
#[inline]
pub(crate) fn along<const D: usize>(z: &Wrench<D>, uncertain: &Wrench<D>) -> f64 {
    z.iter().zip(uncertain.iter()).map(|(z, e)| z.abs() * e).sum()
}

/// What rounding has done to the answers of a support oracle.
pub(crate) trait Rounding<const D: usize> {
    /// A bound on what is uncertain of each component of any point.
    fn of_any_point(&self) -> Wrench<D>;

    /// By how much `p(z)` may be larger, and a bound on what is uncertain of each component of the point along `z`.
    fn of_support(&self, z: &Wrench<D>) -> (f64, Wrench<D>);
}

/// The same bound for all points.
impl<const D: usize> Rounding<D> for Wrench<D> {
    fn of_any_point(&self) -> Wrench<D> {
        *self
    }

    fn of_support(&self, z: &Wrench<D>) -> (f64, Wrench<D>) {
        (along(z, self), *self)
    }
}
