//! Whether multiplier and forces are the only optimal ones, or at least all of them have the same gradient.
//!
//! Optimal multipliers differ by `dz` that works on no wrench which the forces can exert more or less of: on none of the
//! faces that hold them. Optimal forces differ by `df` in the faces that the multiplier supports, with `sum_i G_i df_i = 0`.
//! Contacts whose share the optimum fixes, at a limit or a bound, contribute differences within their faces alone.

use nalgebra::{DVector, SVector};

use crate::force::equilibration::units;
use crate::force::gradient::active_face::active_face;
use crate::force::problem::Problem;
use crate::force::program::Program;
use crate::force::solution::Distribution;
use crate::grasp::contact::ContactForce;
use crate::grasp::derivative::ForceDerivative;
use crate::grasp::{Grasp, Wrench};
use crate::tolerances::{AT_LIMIT, INDEPENDENT_SHIFT, SAME_GRADIENT, SAME_GRADIENT_BY_CONES, SUPPORTED};
use crate::wrench_set::Criterion;
use crate::wrench_set::cone::{cone_slope, cone_support};

/// How near to the furthest force of a true cone another one must reach to be as good: its multipliers are less exact.
const SUPPORTED_BY_CONES: f64 = 1e-6;

/// What the forces minimise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Value {
    /// The sum of the shares; whether these are limited to 1.
    Sum(bool),
    /// The maximum plus this weight times the sum.
    Max(f64),
    /// Squares of forces; whether shares are limited to 1, and whether the residual has a price.
    Squares(bool, bool),
    /// The distance from balance.
    Distance,
}

impl Value {
    /// That of a problem, whose forces may have to keep their limits.
    pub(crate) fn of<const D: usize>(problem: &Problem<D>, limits: bool) -> Self {
        match &problem.program {
            Program::Shares(Criterion::Sum, _) => Self::Sum(limits),
            Program::Shares(Criterion::Max, _) => Self::Max(problem.options.weight),
            Program::Squares(squares, _) => Self::Squares(squares.limits || limits, squares.slack.is_some()),
        }
    }

    /// Whether forces may be optimal that do not balance.
    pub(crate) fn allows_residual(self) -> bool {
        matches!(self, Self::Squares(_, true) | Self::Distance)
    }

    /// Whether the value has a corner where no forces are needed.
    pub(crate) fn has_corner(self) -> bool {
        matches!(self, Self::Sum(_) | Self::Max(_))
    }
}

/// An answer and the multiplier that supports it.
pub(crate) struct Faces<'a, const D: usize> {
    grasp: &'a Grasp<D>,
    bounds: Vec<(f64, f64)>,
    z: &'a Wrench<D>,
    answer: &'a Distribution<D>,
    value: Value,
    units: Wrench<D>,
}

impl<'a, const D: usize> Faces<'a, D> {
    pub(crate) fn new(
        grasp: &'a Grasp<D>,
        bounds: Vec<(f64, f64)>,
        z: &'a Wrench<D>,
        answer: &'a Distribution<D>,
        value: Value,
    ) -> Self {
        Self { grasp, bounds, z, answer, value, units: units(grasp) }
    }

    /// Whether no other multiplier is optimal.
    pub(crate) fn have_one_dual(&self) -> bool {
        if self.value.allows_residual() {
            return true;
        }
        let mut span = Span::<D>::new(0);
        let mut together: Option<Wrench<D>> = None;
        let pressing = self.answer.shares.iter().enumerate().filter(|(_, share)| **share > 0.0);
        for (i, &share) in pressing {
            let face = active_face(self.grasp, i, &self.answer.forces[i]);
            let wrench = |force: &ContactForce| (self.grasp.maps()[i] * force).component_mul(&self.units);
            let Some((first, rest)) = face.split_first() else { continue };
            let unit = first.0 / first.1;
            let at_bound = self.bounds[i].0 > 0.0 && share <= self.bounds[i].0 * (1.0 + AT_LIMIT);
            let at_limit = match self.value {
                Value::Max(_) => share >= self.answer.sigma_max * (1.0 - AT_LIMIT),
                Value::Sum(true) | Value::Squares(true, _) => share >= 1.0 - AT_LIMIT,
                _ => false,
            };
            if !at_bound && !at_limit {
                span.admit(&wrench(&unit), &DVector::zeros(0), 1.0);
            }
            if at_limit && matches!(self.value, Value::Max(_)) {
                *together.get_or_insert_with(Wrench::zeros) += wrench(&unit);
            }
            for (force, share) in rest {
                span.admit(&wrench(&(force - unit * *share)), &DVector::zeros(0), 1.0);
            }
        }
        if let Some(together) = together {
            span.admit(&together, &DVector::zeros(0), 1.0);
        }
        span.basis.len() == D
    }

    /// Whether all optimal forces have the same gradient.
    pub(crate) fn have_one_gradient(&self) -> bool {
        let base = match self.value {
            Value::Squares(..) => return true,
            Value::Sum(_) => 1.0,
            Value::Max(weight) => weight,
            Value::Distance => 0.0,
        };
        let supports: Vec<_> = (0..self.grasp.num_contacts()).map(|i| self.supported(i)).collect();
        let size = supports.iter().map(|(reach, _)| reach.abs()).fold(0.0, f64::max);
        let mut span = Span::<D>::new(7 * self.grasp.num_contacts());
        let same = if self.grasp.is_finite() { SAME_GRADIENT } else { SAME_GRADIENT_BY_CONES };
        for (i, (reach, face)) in supports.iter().enumerate() {
            let Some((first, rest)) = face.split_first() else { continue };
            let tolerance = size * if self.grasp.edges(i).is_some() { SUPPORTED } else { SUPPORTED_BY_CONES };
            let free = (reach - base).abs() <= tolerance;
            if !free && self.answer.shares[i] == 0.0 {
                continue;
            }
            let shift = |force: ContactForce| {
                let wrench = (self.grasp.maps()[i] * force).component_mul(&self.units);
                let mut change = DVector::zeros(7 * self.grasp.num_contacts());
                let part = ForceDerivative::of(self.grasp, i, &force, self.z).stacked();
                change.fixed_rows_mut::<7>(7 * i).copy_from(&part);
                (wrench, change)
            };
            let first_shift = free.then(|| shift(*first));
            let others = rest.iter().map(|force| shift(force - first));
            if !first_shift
                .into_iter()
                .chain(others)
                .all(|(wrench, change)| span.admit(&wrench, &change, same))
            {
                return false;
            }
        }
        true
    }

    /// How far contact `i` reaches along the multiplier, and forces of share 1 that span the face where it does.
    fn supported(&self, i: usize) -> (f64, Vec<ContactForce>) {
        if let Some(range) = self.grasp.edges(i) {
            let wrenches = &self.grasp.finite_wrenches()[range.clone()];
            let works = wrenches.iter().map(|wrench| wrench.dot(self.z));
            let (reach, size) = works.clone().fold((f64::NEG_INFINITY, 0.0), |(reach, size), work| {
                (f64::max(reach, work), f64::max(size, work.abs()))
            });
            let forces = self.grasp.finite_forces()[range].iter().zip(works);
            let supported = forces.filter(|(_, work)| *work >= reach - SUPPORTED * size);
            return (reach, supported.map(|(force, _)| *force).collect());
        }
        let contact = &self.grasp.contacts()[i];
        let (mu, gamma, limit) = (contact.friction, contact.torsion, contact.max_normal_force);
        let h = self.grasp.maps()[i].tr_mul(self.z);
        let slope = cone_slope(&h, mu, gamma);
        let largest = cone_support(&h, mu, gamma) * limit;
        let mut face = vec![largest];
        if slope <= SUPPORTED_BY_CONES * (h[0].abs() + slope) {
            let scales = [1.0, mu, mu, gamma];
            for &row in self.grasp.force_components().iter().filter(|&&row| row > 0 && scales[row] > 0.0) {
                let mut other = largest;
                other[row] += scales[row] * limit;
                face.push(other);
            }
        }
        (limit * (h[0] + slope), face)
    }
}

/// Orthonormal wrenches, each with the change of the gradient that goes with it.
struct Span<const D: usize> {
    basis: Vec<(SVector<f64, D>, DVector<f64>)>,
    changes: usize,
}

impl<const D: usize> Span<D> {
    fn new(changes: usize) -> Self {
        Self { basis: Vec::with_capacity(D), changes }
    }

    /// Adds a wrench; false where it lies in the span already but its change is another than the span's.
    fn admit(&mut self, wrench: &Wrench<D>, change: &DVector<f64>, same: f64) -> bool {
        let length = wrench.norm();
        if length == 0.0 {
            return self.changes == 0 || change.norm() == 0.0;
        }
        let (mut rest, mut left, mut size) = (*wrench, change.clone(), change.norm());
        for (direction, its) in &self.basis {
            let along = direction.dot(&rest);
            rest -= direction * along;
            size += along.abs() * its.norm();
            left -= its * along;
        }
        let height = rest.norm();
        if height > INDEPENDENT_SHIFT * length {
            self.basis.push((rest / height, left / height));
            return true;
        }
        left.norm() <= same * size
    }
}
