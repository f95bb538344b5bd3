//! Coordinates in which a set is about as long along every direction, and its radius by their help.
//!
//! With little friction, or in hard metrics, a wrench set is up to `1e13` times longer than thick. The planes of a polytope
//! inside it have no digits left then. In coordinates `x = T w` where the set is nearly round, they keep them all. Distances
//! are still those of `w`: a functional `y` on `x` is `N y` in the coordinates where distances are measured, so a plane
//! `y . x = 1` is at the distance `1 / |N y|`, and `p(y) / |N y|` bounds the radius from above.
//!
//! `T` divides by the pivots of an orthogonalisation that takes the longest wrench first. A wrench that is left out has
//! components of at most 1 then, whatever its length.

use std::cmp::Ordering;

use nalgebra::SMatrix;

use crate::convex::expanding_polytope::plane_norm::PlaneNorm;
use crate::convex::expanding_polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::convex::rounding::along;
use crate::grasp::Wrench;
use crate::grasp::exact_map::{Wrench32, combined, dot};
use crate::interrupt;
use crate::linalg::double_double::DoubleDouble;
use crate::tolerances::{
    CANCELLED_COLUMN, FIRST_SIMPLEX, NEGLIGIBLE_RADIUS, ROUNDED_QUOTIENT, SMALLER_SIMPLEX,
};
use crate::wrench_set::Support;

/// Facets at most: in round coordinates a set that needs more is not thin but smooth.
const MAX_FACETS: usize = 20_000;

/// How much larger than the simplex a ball must be before the search for it stops.
const STOPPING_RADIUS: f64 = 2.0;

/// The rows of `T`; `None` where the columns do not span.
pub(crate) fn round_rows<const D: usize>(mut columns: Vec<Wrench32<D>>) -> Option<[Wrench32<D>; D]> {
    let length = |column: &Wrench32<D>| dot(column, column).sqrt().value();
    let lengths: Vec<_> = columns.iter().map(length).collect();
    let mut rows = [[DoubleDouble::ZERO; D]; D];
    for row in &mut rows {
        let longest = columns.iter().max_by(|a, b| length(a).total_cmp(&length(b)))?;
        let pivot = dot(longest, longest).sqrt();
        if pivot.value().partial_cmp(&0.0) != Some(Ordering::Greater) {
            return None;
        }
        let axis = longest.map(|x| x / pivot);
        for (column, whole) in columns.iter_mut().zip(&lengths) {
            // The second pass removes what rounding left of the first.
            for _ in 0..2 {
                *column = combined(column, &axis, -dot(&axis, column));
            }
            if length(column) <= CANCELLED_COLUMN * whole {
                *column = [DoubleDouble::ZERO; D];
            }
        }
        *row = axis.map(|x| x / pivot);
    }
    rows.iter().flatten().all(|x| x.value().is_finite()).then_some(rows)
}

/// A matrix in 16 digits, by its rows.
pub(crate) fn matrix_of<const D: usize>(rows: &[Wrench32<D>; D]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|row, column| rows[row][column].value())
}

/// The set behind `oracle`, in round coordinates where its points are `uncertain` by so much and at most `longest` long.
pub(crate) struct RoundSet<const D: usize, O: Fn(&Wrench<D>) -> Support<D>> {
    pub(crate) norm: PlaneNorm<D>,
    pub(crate) uncertain: Wrench<D>,
    pub(crate) longest: f64,
    pub(crate) oracle: O,
}

impl<const D: usize, O: Fn(&Wrench<D>) -> Support<D>> RoundSet<D, O> {
    /// The radius of the largest ball, by the norm, with its direction in round coordinates. Its `upper` end holds for the
    /// points as they were before rounding, too. Without a radius, the direction along which the set is thinnest.
    pub(crate) fn radius(&self, limits: &Limits) -> Result<Radius<D>, Thinnest<D>> {
        let mut polytope = Polytope::new();
        polytope.allow(self.uncertain);
        let size = self.inner_ball(&mut polytope)?;
        let limits = Limits { max_facets: MAX_FACETS.min(limits.max_facets), ..*limits };
        polytope.start_in(size, self.norm.clone());
        let progress = polytope.grow(&limits, &mut |z| (self.oracle)(z));
        let thinnest = *polytope.thinnest();
        let Expansion::Radius(radius) = polytope.conclude(progress, 0.0, &limits) else {
            return Err(thinnest);
        };
        let (upper, z) = (radius.upper, &radius.direction);
        let rounded = ROUNDED_QUOTIENT + self.norm.lost(z.norm());
        let upper = (upper + along(z, &self.uncertain)) * (1.0 + 2.0 * rounded);
        Ok(Radius { upper, ..radius })
    }

    /// The size of a simplex that certainly lies in the set, from ever smaller ones.
    fn inner_ball(&self, polytope: &mut Polytope<D>) -> Result<f64, Thinnest<D>> {
        let mut size = FIRST_SIMPLEX * self.longest;
        loop {
            let limits =
                Limits { stop_above: STOPPING_RADIUS * size, max_facets: MAX_FACETS, ..Limits::new(0.5) };
            let thinnest = match polytope.expand(size, &limits, &self.oracle) {
                Expansion::Radius(radius) => return Ok(radius.lower * (1.0 - ROUNDED_QUOTIENT)),
                Expansion::Pierced(thinnest) | Expansion::Stopped(thinnest) => thinnest,
            };
            size = SMALLER_SIMPLEX * size.min(thinnest.upper);
            let negligible = NEGLIGIBLE_RADIUS * self.longest;
            if size.partial_cmp(&negligible) != Some(Ordering::Greater) || interrupt::stopped() {
                return Err(thinnest);
            }
        }
    }
}
