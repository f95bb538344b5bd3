//! The wrench nearest to `b` among those that contacts exert: `min |sum_i G_i f_i - b|_M` over forces in their cones.
//!
//! Proximal steps `min |sum_i G_i f_i - b|_M^2 / 2 + weight |f - f_k|^2 / 2`, each of them least squares with a price of the
//! residual, lead there with falling weights. After each of them [Newton's method on the exposed faces](face_newton) tries
//! to end at once; for the next wrench it begins with the last faces. With the residual `s` and `z = -M s`, every wrench
//! `w` that contacts exert has `w . z <= p(z)`, so that no distance is below `(b . z - p(z)) / |s|_M`.

use std::sync::Arc;

use crate::force::certificate::{ContactForces, residual};
use crate::force::nearest::exposed_face::ExposedFace;
use crate::force::nearest::face_newton::{are_the_only_ones, settle};
use crate::force::squares::dual::Dual;
use crate::force::squares::newton::minimise;
use crate::grasp::contact::ContactForce;
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{ContactMap, Grasp, Wrench, unit};
use crate::interrupt;
use crate::tolerances::{AT_LIMIT, NEAREST_DISTANCE, ROUNDED_DISTANCE_GAP, ROUNDED_REACH};

/// Weights of the proximal steps, relative to the strongest contact; the last is that of all others. A step shrinks the
/// error by about this, and loses as many digits of the forces.
const PROXIMAL: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];

/// Proximal steps at most; one or two are usual.
const MAX_PROXIMAL_STEPS: usize = 40;

/// A wrench this far beyond a plane, relative to its norm, is projected before forces that balance it are looked for.
const BEYOND_LAST_PLANE: f64 = -1e-12;

/// Distances that count as near, relative to the norm of the wrench, and how far out a wrench is moved instead.
const NEAR_BOUNDARY: f64 = 1e-2;
const OUTSIDE: [f64; 4] = [0.3, 0.1, 0.03, 0.01];

/// Without limits the distance is proven for forces up to so many times as strong as those found, or as one contact would
/// need for a wrench of that norm.
const STRONGER: f64 = 10.0;

/// The projection of wrenches onto those that a grasp exerts.
#[derive(Debug, Clone)]
pub(crate) struct WrenchProjection<const D: usize> {
    grasp: Arc<Grasp<D>>,
    pub(crate) metric: Metric<D>,
    pub(crate) limits: bool,
    pub(crate) dual: Dual<D>,
    /// The square of the longest wrench of a unit force.
    pub(crate) strength: f64,
    /// The contact maps where the metric is Euclidean.
    pub(crate) maps: Vec<ContactMap<D>>,
    /// The norm of the longest wrench that a contact exerts by a normal force at its limit.
    longest: f64,
    last: Last<D>,
    /// Whether any wrench was asked for.
    asked: bool,
    /// Forces before Newton's method on the faces, and before wrenches further out were asked.
    before: Vec<ContactForce>,
    kept: ContactForces,
}

/// The last wrench on the boundary or beyond: its faces, its forces and the unit normal.
#[derive(Debug, Clone)]
struct Last<const D: usize> {
    known: bool,
    faces: Vec<ExposedFace>,
    forces: Vec<ContactForce>,
    normal: Wrench<D>,
    strongest: f64,
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
    /// Whether both bounds agree up to rounding.
    pub(crate) exact: bool,
    /// Whether no other forces exert the nearest wrench.
    pub(crate) unique: bool,
}

impl<const D: usize> Nearest<D> {
    fn of_no_forces(b: &Wrench<D>, size: f64) -> Self {
        Self { residual: -b, distance: size, lower: 0.0, steps: 0, exact: false, unique: false }
    }
}

impl<const D: usize> WrenchProjection<D> {
    /// `bounds` are the lower and the upper bounds of each contact's share.
    pub(crate) fn new(grasp: &Arc<Grasp<D>>, metric: Metric<D>, limits: bool, bounds: &[(f64, f64)]) -> Self {
        let maps: Vec<_> = grasp.maps().iter().map(|map| metric.to_euclidean(map)).collect();
        let columns = maps.iter().flat_map(|map| (0..4).map(|k| map.column(k).norm()));
        let strongest = columns.fold(0.0, f64::max);
        let contacts = grasp.num_contacts();
        let switched_on = grasp.contacts().iter().zip(&maps).zip(bounds).filter(|(_, (_, high))| *high > 0.0);
        let limits_exert =
            switched_on.map(|((contact, map), _)| contact.max_normal_force * map.column(0).norm());
        let strength = strongest * strongest;
        let weights = vec![PROXIMAL[2] * strength; contacts];
        let zero = vec![ContactForce::zeros(); contacts];
        let mut dual = Dual::new(grasp, &weights, &zero, Some(&metric));
        for (i, &(low, high)) in bounds.iter().enumerate() {
            dual.bound(i, low, if limits || high == 0.0 { high } else { f64::INFINITY });
        }
        let last = Last {
            known: false,
            faces: vec![ExposedFace::FIXED; contacts],
            forces: zero.clone(),
            normal: Wrench::zeros(),
            strongest: 0.0,
        };
        Self {
            grasp: Arc::clone(grasp),
            metric,
            limits,
            dual,
            strength,
            longest: limits_exert.fold(0.0, f64::max),
            maps,
            last,
            asked: false,
            before: zero,
            kept: ContactForces::new(contacts),
        }
    }

    /// Forgets the last wrench.
    pub(crate) fn forget(&mut self) {
        (self.last.known, self.asked) = (false, false);
    }

    /// The share up to which distances are proven without limits: of forces found, and of what one contact would need to
    /// exert a wrench of this norm.
    pub(crate) fn strongest(&self, largest: f64, size: f64) -> f64 {
        let needed = if self.longest > 0.0 { size / self.longest } else { 0.0 };
        STRONGER * largest.max(needed)
    }

    /// Whether `b` lies beyond what forces reach along the last normal.
    fn is_beyond(&self, b: &Wrench<D>) -> bool {
        if !self.last.known {
            return false;
        }
        let (t, n) = (self.metric.to_euclidean(b), &self.last.normal);
        let strongest = self.strongest(self.last.strongest, t.norm());
        let contacts = self.dual.contacts.iter().zip(&self.maps);
        let reach: f64 = contacts.map(|(contact, map)| contact.reach(&map.tr_mul(n), strongest)).sum();
        t.dot(n) - reach > BEYOND_LAST_PLANE * t.norm()
    }

    /// Leaves forces that exert the wrench nearest to `b`, where the last wrenches make it likely that it lies beyond all
    /// others, and this is proven at once; `None` elsewhere.
    pub(crate) fn project_if_beyond(
        &mut self,
        b: &Wrench<D>,
        forces: &mut ContactForces,
    ) -> Option<Nearest<D>> {
        // The first wrench of all may lie beyond, too.
        if !self.last.known && std::mem::replace(&mut self.asked, true) {
            return None;
        }
        let found = if self.is_beyond(b) { self.continue_from_last(b, forces) } else { None };
        let found = found.or_else(|| self.search(b, forces, true));
        found.filter(|found| found.exact)
    }

    /// Leaves forces that exert the wrench nearest to `b`.
    pub(crate) fn project(&mut self, b: &Wrench<D>, forces: &mut ContactForces) -> Nearest<D> {
        if self.is_beyond(b)
            && let Some(found) = self.continue_from_last(b, forces)
        {
            return found;
        }
        let size = self.metric.norm(b);
        let found = self.search(b, forces, false);
        let found = found.unwrap_or(Nearest::of_no_forces(b, size));
        if found.exact || found.distance > NEAR_BOUNDARY * size || found.distance == 0.0 {
            return found;
        }
        self.approach_from_outside(b, found, forces)
    }

    /// On the boundary and near it proximal steps are many. A wrench further out along the normal has the same faces.
    #[cold]
    fn approach_from_outside(
        &mut self,
        b: &Wrench<D>,
        found: Nearest<D>,
        forces: &mut ContactForces,
    ) -> Nearest<D> {
        let size = self.metric.norm(b);
        self.kept.clone_from(forces);
        let mut n = self.normal(b, forces);
        for further in OUTSIDE {
            let moved = self.metric.to_physical(&(n * (further * size)));
            if self.search(&(b + moved), forces, false).is_some_and(|found| found.exact) {
                n = self.last.normal;
                if let Some(nearer) = self.continue_from_last(b, forces)
                    && nearer.distance <= found.distance
                {
                    return nearer;
                }
            }
        }
        forces.clone_from(&self.kept);
        self.last.known = false;
        found
    }

    fn continue_from_last(&mut self, b: &Wrench<D>, forces: &mut ContactForces) -> Option<Nearest<D>> {
        if !self.last.known {
            return None;
        }
        let mut n = self.last.normal;
        forces.forces.copy_from_slice(&self.last.forces);
        self.settle(b, &self.metric.to_euclidean(b), &mut n, forces, 0)
    }

    /// The same from nothing. If `probing`, it ends with `None` where the first step does not prove that `b` lies beyond.
    fn search(&mut self, b: &Wrench<D>, forces: &mut ContactForces, probing: bool) -> Option<Nearest<D>> {
        let t = self.metric.to_euclidean(b);
        let size = t.norm();
        forces.unique = false;
        let target = self.dual.whitening.map * b;
        for contact in &mut self.dual.contacts {
            contact.reference = ContactForce::zeros();
        }
        let mut y = Wrench::zeros();
        let mut steps = 0;
        let mut best: Option<Nearest<D>> = None;
        let mut stalled = 0;
        let last = PROXIMAL.len() - 1;
        let mut at = 0;
        for _ in 0..MAX_PROXIMAL_STEPS {
            if interrupt::stopped() {
                break;
            }
            for contact in &mut self.dual.contacts {
                contact.weight = PROXIMAL[at] * self.strength;
            }
            let ContactForces { forces: f, shares, .. } = forces;
            let start = self.dual.at(&y, &target, f, shares);
            let (point, more) = minimise(&self.dual, &target, start, f, shares);
            (y, steps) = (point.y, steps + more);
            let mut n = self.normal(b, forces);
            let found = self.bracket(b, forces, &n, steps);
            if probing && found.lower <= 0.0 {
                break;
            }
            if found.distance > 0.0 {
                for (contact, face) in self.dual.contacts.iter().zip(&mut self.last.faces) {
                    let x = contact.reference + contact.pull(&y) / contact.weight;
                    *face = ExposedFace::around(contact, &x);
                }
                self.before.copy_from_slice(&forces.forces);
                if let Some(found) = self.settle(b, &t, &mut n, forces, steps) {
                    return Some(found);
                }
                forces.forces.copy_from_slice(&self.before);
            }
            let gap = found.distance - found.lower;
            // The last forces are kept: the distance of each is no larger than of those before, up to rounding.
            let improved = best.is_none_or(|best| gap < 0.7 * (best.distance - best.lower));
            // Without limits a bound holds for forces that are not much stronger than those of its step.
            let earlier = best.filter(|_| self.limits).map_or(0.0, |best| best.lower);
            let lower = found.lower.max(earlier).min(found.distance);
            best = Some(Nearest { lower, ..found });
            stalled = if improved { 0 } else { stalled + 1 };
            if at == last
                && (gap <= ROUNDED_DISTANCE_GAP * size
                    || stalled >= if gap <= NEAREST_DISTANCE * size { 2 } else { 6 })
            {
                break;
            }
            // The gap is as small as the square of the error of the forces: the last step makes them exact, too.
            at = if gap <= ROUNDED_DISTANCE_GAP * size { last } else { (at + 1).min(last) };
            for (contact, force) in self.dual.contacts.iter_mut().zip(&forces.forces) {
                contact.reference = *force;
            }
        }
        self.last.known = false;
        for (contact, (force, share)) in
            self.dual.contacts.iter().zip(forces.forces.iter().zip(&mut forces.shares))
        {
            *share = contact.project(force).share;
        }
        best
    }

    /// Ends on the faces, if they are those that the normal exposes and the forces keep their bounds there.
    fn settle(
        &mut self,
        b: &Wrench<D>,
        t: &Wrench<D>,
        n: &mut Wrench<D>,
        forces: &mut ContactForces,
        steps: usize,
    ) -> Option<Nearest<D>> {
        if !settle(&self.dual, &self.maps, &self.last.faces, t, n, &mut forces.forces) {
            return None;
        }
        for (contact, (force, share)) in
            self.dual.contacts.iter().zip(forces.forces.iter_mut().zip(&mut forces.shares))
        {
            let inside = contact.project(force);
            (*force, *share) = (inside.force, inside.share);
        }
        let mut found = self.bracket(b, forces, n, steps + 1);
        if !found.exact {
            return None;
        }
        found.unique = are_the_only_ones(&self.dual, &self.maps, n);
        forces.unique = found.unique;
        self.last.known = true;
        self.last.normal = *n;
        self.last.forces.copy_from_slice(&forces.forces);
        self.last.strongest = forces.totals().0;
        Some(found)
    }

    /// The unit normal of the nearest wrench where the metric is Euclidean: the direction of the residual, unless that is
    /// rounding.
    pub(crate) fn normal_of(&self, nearest: &Nearest<D>, size: f64) -> Option<Wrench<D>> {
        if nearest.distance > AT_LIMIT * size {
            return Some(unit(&self.metric.to_euclidean(&-nearest.residual)));
        }
        self.last.known.then_some(self.last.normal)
    }

    /// The distance of the forces, and what is proven of the least one by their residual or by `n`.
    pub(crate) fn distances(&self, b: &Wrench<D>, forces: &ContactForces, n: &Wrench<D>) -> (f64, f64) {
        let brackets = [*n, self.normal(b, forces)].map(|n| self.bracket(b, forces, &n, 0));
        (brackets[0].distance, brackets[0].lower.max(brackets[1].lower))
    }

    /// The unit direction of what the forces leave of `b`, where the metric is Euclidean.
    fn normal(&self, b: &Wrench<D>, forces: &ContactForces) -> Wrench<D> {
        unit(
            &self
                .metric
                .to_euclidean(&-residual(b, self.grasp.maps().iter().zip(forces.forces.iter().copied()))),
        )
    }

    /// The residual of the forces, and what the normal `n` proves.
    fn bracket(&self, b: &Wrench<D>, forces: &ContactForces, n: &Wrench<D>, steps: usize) -> Nearest<D> {
        let maps = self.grasp.maps();
        let residual = residual(b, maps.iter().zip(forces.forces.iter().copied()));
        let distance = self.metric.norm(&residual);
        let z = self.metric.functional(n);
        let largest = forces.shares.iter().copied().fold(0.0, f64::max);
        let strongest = self.strongest(largest, self.metric.norm(b));
        let along = b.dot(&z);
        let (mut lower, mut terms) = (along, along.abs());
        for ((contact, map), force) in self.dual.contacts.iter().zip(maps).zip(&forces.forces) {
            let h = map.tr_mul(&z);
            lower -= contact.reach(&h, strongest);
            terms += h.component_mul(force).lp_norm(1);
        }
        let rounding = (ROUNDED_REACH * terms).max(ROUNDED_DISTANCE_GAP * self.metric.norm(b));
        let exact = distance - lower <= rounding;
        let lower = if distance > 0.0 { lower.clamp(0.0, distance) } else { 0.0 };
        Nearest { residual, distance, lower, steps, exact, unique: false }
    }
}
