//! The wrench nearest to `b` among those that contacts exert: `min |sum_i G_i f_i - b|_M` over forces in their cones.
//!
//! Proximal steps `min |sum_i G_i f_i - b|_M^2 / 2 + weight |f - f_k|^2 / 2`, each of them least squares with a price of the
//! residual, lead there: a small weight takes few of them, and the weights fall from step to step. With the residual `s` and `z = -M s`, every wrench `w` that
//! contacts exert has `w . z <= p(z)`, so that no distance is below `(b . z - p(z)) / |s|_M`.

use std::sync::Arc;

use crate::force::certificate::ContactForces;
use crate::force::squares::dual::Dual;
use crate::force::squares::newton::minimise;
use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, Wrench};

/// Weights of the first proximal steps, relative to the strongest contact; the last is that of all others. Steps shrink the
/// error by about this, and lose as many digits of the forces.
const PROXIMAL: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-3, 1e-3, 1e-5];

/// Proximal steps at most; two to four are usual.
const MAX_STEPS: usize = 40;

/// The gap of the distance, relative to the norm of the wrench, at which no further step is worth it.
const EXACT: f64 = 1e-14;

/// Without limits the distance is proven for forces up to so many times as strong as those found.
const STRONGER: f64 = 10.0;

/// The projection of wrenches onto those that a grasp exerts.
#[derive(Debug, Clone)]
pub(crate) struct WrenchProjection<const D: usize> {
    grasp: Arc<Grasp<D>>,
    pub(crate) metric: Metric<D>,
    pub(crate) limits: bool,
    dual: Dual<D>,
    /// The square of the longest wrench of a unit force.
    strength: f64,
}

/// The residual of the nearest wrench, and its norm between proven bounds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest<const D: usize> {
    /// `sum_i G_i f_i - b`.
    pub(crate) residual: Wrench<D>,
    pub(crate) distance: f64,
    /// No forces come nearer than this.
    pub(crate) lower: f64,
    pub(crate) steps: usize,
}

impl<const D: usize> WrenchProjection<D> {
    /// `bounds` are the lower and the upper bounds of each contact's share.
    pub(crate) fn new(grasp: &Arc<Grasp<D>>, metric: Metric<D>, limits: bool, bounds: &[(f64, f64)]) -> Self {
        let columns = grasp.maps().iter().flat_map(|map| (0..4).map(|k| map.column(k).into_owned()));
        let strongest = columns.map(|column| metric.norm(&column)).fold(0.0, f64::max);
        let contacts = grasp.num_contacts();
        let strength = strongest * strongest;
        let weights = vec![PROXIMAL[2] * strength; contacts];
        let zero = vec![ContactForce::zeros(); contacts];
        let mut dual = Dual::new(grasp, &weights, &zero, Some(&metric));
        for (i, &(low, high)) in bounds.iter().enumerate() {
            dual.bound(i, low, if limits || high == 0.0 { high } else { f64::INFINITY });
        }
        Self { grasp: Arc::clone(grasp), metric, limits, dual, strength }
    }

    /// Leaves forces that exert the wrench nearest to `b`.
    pub(crate) fn project(&mut self, b: &Wrench<D>, forces: &mut ContactForces) -> Nearest<D> {
        let target = self.dual.whitening.map * b;
        let size = self.metric.norm(b);
        for contact in &mut self.dual.contacts {
            contact.reference = ContactForce::zeros();
        }
        let mut y = Wrench::zeros();
        let mut steps = 0;
        let mut best: Option<Nearest<D>> = None;
        let mut stalled = 0;
        let last = PROXIMAL.len() - 1;
        let mut at = 0;
        for _ in 0..MAX_STEPS {
            for contact in &mut self.dual.contacts {
                contact.weight = PROXIMAL[at] * self.strength;
            }
            let ContactForces { forces: f, shares, .. } = forces;
            let start = self.dual.at(&y, &target, f, shares);
            let (point, more) = minimise(&self.dual, &target, start, f, shares);
            (y, steps) = (point.y, steps + more);
            let found = self.bracket(b, forces, steps);
            let gap = found.distance - found.lower;
            // The last forces are kept: the distance of each is no larger than of those before, up to rounding.
            let improved = best.is_none_or(|best| gap < 0.7 * (best.distance - best.lower));
            // Without limits a bound holds for forces that are not much stronger than those of its step.
            let earlier = best.filter(|_| self.limits).map_or(0.0, |best| best.lower);
            let lower = found.lower.max(earlier);
            best = Some(Nearest { lower: lower.min(found.distance), ..found });
            stalled = if improved { 0 } else { stalled + 1 };
            let exact = gap <= EXACT * size;
            if at == last && (exact || stalled >= 2) {
                break;
            }
            // The gap is as small as the square of the error of the forces: the last step makes them exact, too.
            at = if exact { last } else { (at + 1).min(last) };
            for (contact, force) in self.dual.contacts.iter_mut().zip(&forces.forces) {
                contact.reference = *force;
            }
        }
        forces.unique = false;
        best.unwrap_or(Nearest { residual: -b, distance: size, lower: 0.0, steps })
    }

    /// The residual of the forces, and what it proves.
    fn bracket(&self, b: &Wrench<D>, forces: &ContactForces, steps: usize) -> Nearest<D> {
        let maps = self.grasp.maps();
        let residual = maps.iter().zip(&forces.forces).fold(-b, |rest, (map, force)| rest + map * force);
        let distance = self.metric.norm(&residual);
        let z = -self.metric.functional(&self.metric.to_euclidean(&residual));
        let strongest = forces.shares.iter().copied().fold(0.0, f64::max) * STRONGER;
        let contacts = self.dual.contacts.iter().zip(maps);
        let reach: f64 = contacts.map(|(contact, map)| contact.reach(&map.tr_mul(&z), strongest)).sum();
        let lower = if distance > 0.0 { ((b.dot(&z) - reach) / distance).clamp(0.0, distance) } else { 0.0 };
        Nearest { residual, distance, lower, steps }
    }
}
