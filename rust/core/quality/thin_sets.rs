//! Sets that are many orders longer than thick, or than far from the origin: other coordinates of 32 digits.
//!
//! A bracket that rounding leaves wide is computed again from wrenches in 32 digits. They are mapped to coordinates in which
//! 16 digits suffice: those in which the set is round ([`round_coordinates`](crate::convex::round_coordinates)) where the
//! origin is inside. Outside, they are turned so that one axis points to the origin: along it all wrenches are
//! short.

use std::sync::OnceLock;

use nalgebra::SMatrix;

use crate::convex::expanding_polytope::plane_norm::PlaneNorm;
use crate::convex::min_norm_point::{NearestPoint, nearest_point};
use crate::convex::round_coordinates::{RoundSet, matrix_of, round_rows};
use crate::grasp::exact_map::{ExactMap, Wrench32, dot};
use crate::grasp::wrench_rounding::{force_magnitude, of_contacts};
use crate::grasp::{ContactMap, Wrench};
use crate::quality::query::QualityQuery;
use crate::quality::result::Quality;
use crate::quality::set_rounding::SetRounding;
use crate::tolerances::{
    CLOSED_BRACKET, DISTANCE_RTOL, LOST_IN_32_DIGITS, QUALITY_RTOL, ROUNDED_POINT, ROUNDED_QUOTIENT,
};
use crate::wrench_set::{Criterion, WrenchSet};

/// How often the coordinates are turned to a better direction.
const MAX_TURNS: usize = 4;

/// A turn that leaves more than this of the bracket is the last.
const WORTH_ANOTHER_TURN: f64 = 0.9;

impl<const D: usize> QualityQuery<'_, D> {
    /// The same question with the set in the coordinates `A w` of physical wrenches `w`, for a matrix `A` given by its rows.
    fn through(&self, rows: &[Wrench32<D>; D]) -> Self {
        let (grasp, criterion) = (self.grasp, self.set.criterion());
        let maps: Vec<ContactMap<D>> =
            (0..grasp.num_contacts()).map(|i| ExactMap::of(grasp, i).through(rows)).collect();
        let set = WrenchSet::of_maps(grasp, &maps, criterion);
        let matrix = matrix_of(rows).abs();
        let lost = ROUNDED_POINT + grasp.num_contacts() as f64 * f64::EPSILON;
        let mut rounding = of_contacts(grasp, |sizes| matrix * sizes * LOST_IN_32_DIGITS);
        for (i, (rounding, map)) in rounding.iter_mut().zip(&maps).enumerate() {
            *rounding += map.abs() * force_magnitude(grasp, i, &grasp.contacts()[i]) * lost;
        }
        let center: Option<(Wrench<D>, Wrench<D>)> = self.center.map(|(given, _)| {
            let exact: Wrench32<D> = std::array::from_fn(|row| given[row].into());
            (given, Wrench::from_fn(|row, _| dot(&rows[row], &exact).value()))
        });
        let lost = center.map_or_else(Wrench::zeros, |(given, center)| {
            center.abs() * ROUNDED_QUOTIENT + matrix * given.abs() * (ROUNDED_POINT * LOST_IN_32_DIGITS)
        });
        let scale = set.longest() + center.map_or(0.0, |(_, center)| center.norm());
        Self {
            grasp,
            set,
            metric: self.metric,
            center,
            limits: self.limits,
            scale,
            rounding: OnceLock::from((rounding, lost)),
        }
    }

    /// The answer with the bracket of a radius narrowed where rounding left it wider than asked for.
    pub(crate) fn narrowed(&self, found: Quality<D>) -> Quality<D> {
        let rtol = self.rtol().max(QUALITY_RTOL);
        let wide = -found.lower > -found.upper * (1.0 + CLOSED_BRACKET * rtol);
        if !wide || found.facets >= self.limits.max_facets {
            return found;
        }
        self.narrowed_by_round_coordinates(&found).unwrap_or(found)
    }

    fn narrowed_by_round_coordinates(&self, found: &Quality<D>) -> Option<Quality<D>> {
        let grasp = self.grasp;
        let columns = (0..grasp.num_contacts()).flat_map(|i| {
            let axes = force_magnitude(grasp, i, &grasp.contacts()[i]);
            ExactMap::of(grasp, i).scaled(&axes.into())
        });
        let rows = round_rows(columns.collect())?;
        let round = self.through(&rows);
        let functionals = matrix_of(&rows).transpose();
        let norm = self.metric.functionals_to_euclidean(&functionals);
        let set = RoundSet {
            norm: PlaneNorm::Through(vec![norm], self.metric.size_of_functionals(&functionals)),
            uncertain: round.uncertain(),
            longest: round.scale,
            oracle: |z: &Wrench<D>| round.support(z),
        };
        let radius = set.radius(&self.limits).ok()?;
        let mut narrowed = Quality {
            upper: found.upper.min(-radius.lower),
            supports: found.supports + radius.supports,
            facets: found.facets + radius.facets,
            converged: found.converged || radius.converged,
            ..*found
        };
        if radius.upper < -found.lower {
            narrowed.lower = -radius.upper;
            narrowed.direction = self.metric.to_physical(&(norm * radius.direction).normalize());
        }
        narrowed.lower = narrowed.lower.min(narrowed.upper);
        narrowed.rho = narrowed.upper;
        narrowed.wrench = narrowed.direction * -narrowed.upper;
        Some(narrowed)
    }

    /// The nearest point again where rounding left its bracket wider than asked for, in coordinates one of which points to
    /// the origin.
    pub(crate) fn turned_to(&self, nearest: &NearestPoint<D>) -> NearestPoint<D> {
        let rtol = self.rtol().max(DISTANCE_RTOL);
        let mut best = *nearest;
        for _ in 0..MAX_TURNS {
            let width = best.upper - best.lower;
            if best.lower <= 0.0 || width <= rtol * best.upper {
                break;
            }
            best = self.turned_once(&best, rtol);
            if best.upper - best.lower > WORTH_ANOTHER_TURN * width {
                break;
            }
        }
        best
    }

    fn turned_once(&self, nearest: &NearestPoint<D>, rtol: f64) -> NearestPoint<D> {
        let turn = turn_to(&nearest.witness);
        let turned = self.through(&self.metric.exact_rows(&turn));
        let criterion = if self.center.is_some() { self.set.criterion() } else { Criterion::Sum };
        let rounding = SetRounding { query: &turned, criterion };
        let again = nearest_point(rtol, 0.0, usize::MAX, &rounding, |z| match criterion {
            Criterion::Sum if self.center.is_none() => turned.set.union_support(z),
            _ => turned.support(z),
        });
        // The norm of the coordinates is that of the metric but for the rounding of its factor, and of the turn.
        let rounded = 2.0 * self.metric.rounding();
        let (lower, upper) = (again.lower * (1.0 - rounded), again.upper * (1.0 + rounded));
        if upper.min(nearest.upper) - lower.max(nearest.lower) >= nearest.upper - nearest.lower {
            return *nearest;
        }
        let upper = upper.min(nearest.upper);
        NearestPoint {
            lower: lower.max(nearest.lower).min(upper),
            upper,
            witness: if lower > nearest.lower { turn.tr_mul(&again.witness) } else { nearest.witness },
            converged: nearest.converged || again.converged,
            supports: nearest.supports + again.supports,
            ..*nearest
        }
    }
}

/// A reflection whose first row is parallel to a unit vector.
fn turn_to<const D: usize>(z: &Wrench<D>) -> SMatrix<f64, D, D> {
    let mut v = *z;
    v[0] += if z[0] < 0.0 { -1.0 } else { 1.0 };
    SMatrix::identity() - v * v.transpose() * (2.0 / v.norm_squared())
}
