//! The forces that exert the nearest boundary wrench, contact by contact, and whether others would give another gradient.
//!
//! At the worst direction several extreme forces of a contact reach the supporting hyperplane. Some convex combination of
//! them, contact by contact, exerts the nearest boundary wrench: a point of least distance over the faces, whose vertices
//! are never listed.

use nalgebra::{SVector, Vector3};

use crate::convex::min_norm_point::nearest_point;
use crate::grasp::Wrench;
use crate::grasp::contact::ContactForce;
use crate::grasp::wrench::split;
use crate::quality::query::QualityQuery;
use crate::quality::result::Quality;
use crate::tolerances::{
    ACTIVE_FACES, DISTANCE_RTOL, EXERTED_PART, EXERTED_WRENCH, EXERTED_WRENCH_BY_CONES, INDEPENDENT_SHIFT,
    ROUNDED_EXERTED_WRENCH, ROUNDED_RESIDUAL, SAME_GRADIENT, SAME_GRADIENT_BY_CONES,
};
use crate::wrench_set::contact_support::ContactSupport;
use crate::wrench_set::{Criterion, Support};

/// The forces, contact by contact, that exert the nearest boundary wrench.
pub(crate) struct ActiveForces<const D: usize> {
    /// `C^T z*`.
    pub(crate) functional: Wrench<D>,
    pub(crate) forces: Vec<ContactForce>,
    /// Whether other forces that exert the same wrench would give the same gradient.
    pub(crate) unique: bool,
}

/// What of the wrench set lies on the supporting hyperplane.
struct Faces<'a, const D: usize> {
    query: &'a QualityQuery<'a, D>,
    /// The contacts in physical coordinates.
    supports: &'a [ContactSupport<D>],
    contacts: Vec<Face<D>>,
    /// All contacts share one convex combination, instead of each having its own.
    union: bool,
    /// To exert nothing at all is one of the union's points (that a center adds).
    origin: bool,
}

/// What of a contact lies on the supporting hyperplane.
struct Face<const D: usize> {
    /// Extreme forces and their wrenches.
    points: Vec<(Wrench<D>, ContactForce)>,
    /// A true cone none of whose tangential directions the hyperplane prefers: all of its base is active.
    whole: bool,
    /// Whether the contact may as well exert nothing.
    optional: bool,
}

impl<const D: usize> ActiveForces<D> {
    /// Those at the worst direction of an answer.
    pub(crate) fn at(query: &QualityQuery<'_, D>, quality: &Quality<D>) -> Self {
        Self::within(query, quality, &ACTIVE_FACES)
    }

    /// The same from faces of these widths: those whose wrench is nearest to the boundary wrench.
    pub(crate) fn within(query: &QualityQuery<'_, D>, quality: &Quality<D>, widths: &[f64]) -> Self {
        let functional = query.metric.functional(&query.metric.to_euclidean(&quality.direction));
        // Outside, the union decides for both criteria.
        let outside = quality.rho >= 0.0 && query.center.is_none();
        let union = query.set.criterion() == Criterion::Sum || outside;
        let support = |i| ContactSupport::of_contact(query.grasp, i, |wrench| *wrench);
        let supports: Vec<_> = (0..query.grasp.num_contacts()).map(support).collect();
        let target = quality.wrench - query.center.map_or_else(Wrench::zeros, |(center, _)| center);
        let cones = !query.grasp.is_finite();
        let part = (EXERTED_PART * target.norm()).max(ROUNDED_EXERTED_WRENCH * query.scale);
        let met = (EXERTED_WRENCH * query.scale).min(part);
        let exerted = if cones { (EXERTED_WRENCH_BY_CONES * query.scale).min(part) } else { met };
        let (mut best, mut unique): (Option<(f64, Vec<ContactForce>)>, Option<bool>) = (None, None);
        // The minimiser is only as exact as its bracket: widen what counts as active until the wrench is met.
        for &tolerance in widths {
            let faces = Faces::on(query, &supports, &functional, tolerance, union);
            let (residual, forces) = faces.combine(&target);
            if best.as_ref().is_none_or(|(least, _)| residual < *least) {
                best = Some((residual, forces));
            }
            // The least faces that exert the wrench decide: wider ones hold forces that have no part in it. Forces that
            // do not exert it are no gradient, let alone the only one.
            if unique.is_none() && residual <= exerted {
                unique = Some(faces.have_one_gradient(&functional));
            }
            if residual <= met {
                break;
            }
        }
        let unique = unique.unwrap_or(false);
        let forces = best.map(|(_, forces)| forces);
        let forces = forces.unwrap_or_else(|| vec![ContactForce::zeros(); query.grasp.num_contacts()]);
        Self { functional, forces, unique }
    }
}

impl<'a, const D: usize> Faces<'a, D> {
    /// What lies within `tolerance` (relative to the longest wrench) of the hyperplane of the functional `z`.
    fn on(
        query: &'a QualityQuery<'a, D>,
        supports: &'a [ContactSupport<D>],
        z: &Wrench<D>,
        tolerance: f64,
        union: bool,
    ) -> Self {
        let grasp = query.grasp;
        let tolerance = tolerance * query.scale;
        let reaches: Vec<_> = supports.iter().map(|support| support.value(z)).collect();
        let furthest = reaches.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // About a center, the origin belongs to the set.
        let with_origin = query.center.is_some();
        let furthest = if with_origin { furthest.max(0.0) } else { furthest };
        let face = |(i, reach): (usize, f64)| {
            let (least, optional) = if union {
                (furthest - tolerance, false)
            } else {
                (f64::max(reach, 0.0) - tolerance, reach <= tolerance)
            };
            let support = &supports[i];
            let point = |edge| (support.wrench(z, edge), support.force(z, edge, grasp.shared_forces()));
            if support.is_finite() {
                let points = support.edges_reaching(z, least).map(point).collect();
                return Face { points, whole: false, optional };
            }
            let along_normal = grasp.contacts()[i].max_normal_force * grasp.maps()[i].column(0).dot(z);
            let active = reach >= least;
            let whole = active && reach - along_normal <= tolerance;
            Face { points: active.then(|| point(0)).into_iter().collect(), whole, optional }
        };
        let contacts = reaches.into_iter().enumerate().map(face).collect();
        Self { query, supports, contacts, union, origin: union && with_origin && furthest <= tolerance }
    }

    /// The convex combination of the faces nearest to `target`, and how far it stays away: Wolfe's algorithm on the
    /// sum (or the union) of the faces, whose vertices are never listed.
    fn combine(&self, target: &Wrench<D>) -> (f64, Vec<ContactForce>) {
        let metric = &self.query.metric;
        let target = metric.to_euclidean(target);
        let mut calls: Vec<Vec<ContactForce>> = Vec::new();
        let nearest = nearest_point(
            DISTANCE_RTOL,
            ROUNDED_RESIDUAL * self.query.scale,
            usize::MAX,
            &Wrench::zeros(),
            |q| {
                let functional = metric.functional(q);
                let mut picks: Vec<_> = self
                    .contacts
                    .iter()
                    .enumerate()
                    .map(|(i, face)| self.furthest(i, face, &functional))
                    .collect();
                if self.union {
                    let none = if self.origin { 0.0 } else { f64::NEG_INFINITY };
                    let best = picks.iter().flatten().map(|(value, ..)| *value).fold(none, f64::max);
                    let mut taken = false;
                    for pick in &mut picks {
                        *pick = pick.filter(|(value, ..)| !taken && *value == best);
                        taken |= pick.is_some();
                    }
                }
                let wrench = picks.iter().flatten().map(|(_, wrench, _)| *wrench).sum();
                calls.push(
                    picks
                        .iter()
                        .map(|pick| pick.map_or_else(ContactForce::zeros, |(.., force)| force))
                        .collect(),
                );
                let wrench = metric.to_euclidean(&wrench) - target;
                Support { value: wrench.dot(q), wrench }
            },
        );
        let mut forces = vec![ContactForce::zeros(); self.contacts.len()];
        for (call, weight) in nearest.combination {
            for (force, exerted) in forces.iter_mut().zip(&calls[call]) {
                *force += exerted * weight;
            }
        }
        (nearest.upper, forces)
    }

    /// The point of contact `i`'s face furthest along `functional`; `None` where that is to exert nothing.
    fn furthest(
        &self,
        i: usize,
        face: &Face<D>,
        functional: &Wrench<D>,
    ) -> Option<(f64, Wrench<D>, ContactForce)> {
        let best = if face.whole {
            let cone = &self.supports[i];
            Some((cone.value(functional), cone.wrench(functional, 0), cone.force(functional, 0, &[])))
        } else {
            let points = face.points.iter().map(|(wrench, force)| (wrench.dot(functional), *wrench, *force));
            points.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        best.filter(|(value, ..)| !face.optional || *value > 0.0)
    }

    /// Whether all forces of the faces that exert the same wrench give the same gradient.
    ///
    /// Forces may shift from edge to edge where the edges that span the faces are dependent. That need not show: two
    /// contacts that the worst direction does not move at all press against each other as they like, along the axis of
    /// its rotation, and neither `F x b` nor `F x v` changes.
    fn have_one_gradient(&self, functional: &Wrench<D>) -> bool {
        let (a, b) = split(functional);
        let grasp = self.query.grasp;
        // Of one contact's force: its wrench, and its part of the gradient.
        let shift = |i: usize, force: &ContactForce| -> Shift<D> {
            let (contact, frame) = (&grasp.contacts()[i], &grasp.frames()[i]);
            let world: Vector3<f64> = frame * force.fixed_rows::<3>(0);
            let v = a + b.cross(&(contact.position - grasp.options().origin));
            let n = contact.normal;
            let turned = world.cross(&v);
            let parts = [world.cross(&b), turned, force[3] * (b - n * n.dot(&b))];
            let part = Part::from_iterator(parts.iter().flatten().copied());
            let wrench = self.query.metric.to_euclidean(&(grasp.maps()[i] * force));
            Shift { wrench, gradient: vec![(i, part)] }
        };
        let mut all = Span {
            basis: Vec::new(),
            same: if grasp.is_finite() { SAME_GRADIENT } else { SAME_GRADIENT_BY_CONES },
        };
        let mut shared = self.origin.then(|| shift(0, &ContactForce::zeros()));
        for (i, face) in self.contacts.iter().enumerate() {
            let Some((_, first)) = face.points.first() else { continue };
            let mut edges: Vec<Shift<D>> = Vec::new();
            if face.whole {
                let unit = |row| ContactForce::from_fn(|other, _| f64::from(u8::from(other == row)));
                edges.extend((1..grasp.force_dim()).map(|row| shift(i, &unit(row))));
            } else {
                edges.extend(face.points.iter().skip(1).map(|(_, force)| shift(i, &(force - first))));
            }
            let first = shift(i, first);
            match (self.union, face.optional, &shared) {
                (true, _, Some(shared)) => edges.push(first.less(shared, 1.0)),
                (true, _, None) => shared = Some(first),
                (false, true, _) => edges.push(first),
                (false, false, _) => {}
            }
            if !edges.into_iter().all(|edge| all.admit(edge)) {
                return false;
            }
        }
        true
    }
}

/// A contact's part of the gradient.
type Part = SVector<f64, 9>;

/// How the wrench and the gradient change along an edge of a face.
struct Shift<const D: usize> {
    wrench: Wrench<D>,
    /// The parts of those contacts that have one: a few beside the edge's own, however many there are.
    gradient: Vec<(usize, Part)>,
}

impl<const D: usize> Shift<D> {
    fn less(mut self, other: &Self, by: f64) -> Self {
        self.wrench -= other.wrench * by;
        for (contact, part) in &other.gradient {
            match self.gradient.iter_mut().find(|(own, _)| own == contact) {
                Some((_, own)) => *own -= part * by,
                None => self.gradient.push((*contact, -part * by)),
            }
        }
        self
    }

    /// The length of the gradient.
    fn slope(&self) -> f64 {
        self.gradient.iter().map(|(_, part)| part.norm_squared()).sum::<f64>().sqrt()
    }
}

/// An orthonormal basis of the wrenches admitted so far, each with its gradient.
struct Span<const D: usize> {
    basis: Vec<Shift<D>>,
    same: f64,
}

impl<const D: usize> Span<D> {
    /// Adds an edge; false where its wrench lies in the span already but its gradient is another than the others'.
    fn admit(&mut self, edge: Shift<D>) -> bool {
        let (length, mut size) = (edge.wrench.norm(), edge.slope());
        let mut rest = edge;
        for direction in &self.basis {
            let along = direction.wrench.dot(&rest.wrench);
            size += along.abs() * direction.slope();
            rest = rest.less(direction, along);
        }
        let left = rest.wrench.norm();
        if left > INDEPENDENT_SHIFT * length {
            rest.wrench /= left;
            rest.gradient.iter_mut().for_each(|(_, part)| *part /= left);
            self.basis.push(rest);
            return true;
        }
        rest.slope() <= self.same * size
    }
}
