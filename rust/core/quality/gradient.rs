//! The gradient of `epsilon` with respect to contact positions and normals, by the envelope theorem.
//!
//! At a unique minimiser `z* = (a, b)` (as a functional on physical wrenches), `epsilon = p(z*)` changes as the
//! nearest boundary wrench does while `z*` stays. That wrench is `sum_i G_i F_i` with `F_i` a convex combination
//! of contact i's extreme forces that are active at `z*`. With `F_i` in world axes, `tau_i` its torsion and
//! `v_i = a + b x (r_i - origin)`,
//!
//! - `d epsilon / d r_i = F_i x b`;
//! - `d epsilon / d n_i = (F_i x v_i) x n_i + tau_i (b - n_i (n_i . b))`, the frame turning with the normal by
//!   the smallest rotation;
//! - `n_i . (F_i x v_i)` by rad that the frame spins about the normal, which edges feel and true cones do not.

use nalgebra::{SVector, Vector3};

use crate::convex::min_norm_point::nearest_point;
use crate::error::Result;
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::quality::query::QualityQuery;
use crate::quality::result::{Quality, QualityOptions, QualityWorkspace};
use crate::tolerances::{
    ACTIVE_FACES, DISTANCE_RTOL, EXERTED_WRENCH, EXERTED_WRENCH_BY_CONES, INDEPENDENT_SHIFT, MINIMISER_RTOL,
    MINIMISER_RTOL_OF_CONES, ROUNDED_RESIDUAL, SAME_GRADIENT, SAME_GRADIENT_BY_CONES,
};
use crate::wrench_set::{ContactReach, Criterion, Support, WrenchSet};

/// How `epsilon` changes as contacts move.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// Of each contact: change of `epsilon` by m of displacement (planar: the z component is zero).
    pub positions: Vec<Vector3<f64>>,
    /// Of each contact: change of `epsilon` by rad that its normal turns; orthogonal to the normal.
    pub normals: Vec<Vector3<f64>>,
    /// Of each contact: change of `epsilon` by rad that its frame spins about its normal; zero for true cones.
    pub spins: Vec<f64>,
    /// Whether `epsilon` is differentiable here, as far as rounding can tell. Where several directions are equally bad, or
    /// several forces reach the same boundary wrench and would change otherwise, this is one element of the
    /// subdifferential.
    pub unique: bool,
}

impl<const D: usize> Grasp<D> {
    /// The gradient of the `epsilon` that [`Self::quality_with`] computes with the same options.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, Grasp, QualityOptions, QualityWorkspace};
    /// use nalgebra::{SVector, Vector3};
    ///
    /// let fingers = [(-1.0, 0.1), (1.0, 0.0)].map(|(x, y): (f64, f64)| {
    ///     Contact::new(Vector3::new(x, y, 0.0), Vector3::new(-x, 0.0, 0.0)).friction(0.5)
    /// });
    /// let options = QualityOptions::new(Criterion::Max);
    /// let gradient = Grasp::<3>::new(&fingers)?.gradient(&options, &mut QualityWorkspace::default())?;
    /// // Bringing the fingers in line is better, and no common translation in y changes that.
    /// assert!(gradient.positions[0].y < gradient.positions[1].y);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn gradient(
        &self,
        options: &QualityOptions<D>,
        workspace: &mut QualityWorkspace<D>,
    ) -> Result<Gradient> {
        // The active set wants a minimiser as exact as rounding allows; a true cone has no exact one.
        let rtol = if self.is_finite() { MINIMISER_RTOL } else { MINIMISER_RTOL_OF_CONES };
        let options = QualityOptions { rtol: Some(rtol), ..*options };
        let query = QualityQuery::new(self, &options)?;
        let quality = query.answer(workspace);
        // Where symmetries gave the answer, the images of the minimiser are as bad.
        let rival =
            workspace.symmetric || (quality.rho < 0.0 && query.has_rival(&workspace.polytope, &quality));
        let active = ActiveForces::at(&query, &quality);
        let (a, b) = split(&active.functional);
        let mut gradient = Gradient {
            positions: Vec::with_capacity(self.num_contacts()),
            normals: Vec::with_capacity(self.num_contacts()),
            spins: Vec::with_capacity(self.num_contacts()),
            unique: quality.rho != 0.0 && !rival && active.unique,
        };
        for ((contact, frame), force) in self.contacts().iter().zip(self.frames()).zip(&active.forces) {
            let n = contact.normal;
            let world = frame * force.fixed_rows::<3>(0);
            let v = a + b.cross(&(contact.position - self.options().origin));
            let torsion = force[3] * (b - n * n.dot(&b));
            gradient.positions.push(in_space::<D>(world.cross(&b)));
            gradient.normals.push(in_space::<D>(world.cross(&v).cross(&n) + torsion));
            gradient.spins.push(if D == 3 { 0.0 } else { n.dot(&world.cross(&v)) });
        }
        interrupt::check().map(|()| gradient)
    }
}

/// The forces, contact by contact, that exert the nearest boundary wrench.
struct ActiveForces<const D: usize> {
    /// `C^T z*`.
    functional: Wrench<D>,
    forces: Vec<ContactForce>,
    unique: bool,
}

/// What of the wrench set lies on the supporting hyperplane.
struct Faces<'a, const D: usize> {
    query: &'a QualityQuery<'a, D>,
    /// In physical coordinates.
    set: &'a WrenchSet<D>,
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
    fn at(query: &QualityQuery<'_, D>, quality: &Quality<D>) -> Self {
        let functional = query.metric.functional(&query.metric.to_euclidean(&quality.direction));
        // Outside, the union decides for both criteria.
        let outside = quality.rho >= 0.0 && query.center.is_none();
        let union = query.set.criterion() == Criterion::Sum || outside;
        let set = WrenchSet::new(query.grasp, query.set.criterion());
        let target = quality.wrench - query.center.map_or_else(Wrench::zeros, |(center, _)| center);
        let cones = !query.grasp.is_finite();
        let exerted = if cones { EXERTED_WRENCH_BY_CONES } else { EXERTED_WRENCH } * query.scale;
        let (mut best, mut unique): (Option<(f64, Vec<ContactForce>)>, Option<bool>) = (None, None);
        // The minimiser is only as exact as its bracket: widen what counts as active until the wrench is met.
        for tolerance in ACTIVE_FACES {
            let faces = Faces::on(query, &set, &functional, tolerance, union);
            let (residual, forces) = faces.combine(&target);
            if best.as_ref().is_none_or(|(least, _)| residual < *least) {
                best = Some((residual, forces));
            }
            // The least faces that exert the wrench decide: wider ones hold forces that have no part in it. Forces that
            // do not exert it are no gradient, let alone the only one.
            if unique.is_none() && residual <= exerted {
                unique = Some(faces.have_one_gradient(&functional));
            }
            if residual <= EXERTED_WRENCH * query.scale {
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
        set: &'a WrenchSet<D>,
        z: &Wrench<D>,
        tolerance: f64,
        union: bool,
    ) -> Self {
        let grasp = query.grasp;
        let tolerance = tolerance * query.scale;
        let supports: Vec<_> = (0..grasp.num_contacts()).map(|i| set.contact_support(i, z)).collect();
        let furthest = supports.iter().map(|support| support.value).fold(f64::NEG_INFINITY, f64::max);
        // About a center, the origin belongs to the set.
        let with_origin = query.center.is_some();
        let furthest = if with_origin { furthest.max(0.0) } else { furthest };
        let face = |(i, support): (usize, &ContactReach<D>)| {
            let (least, optional) = if union {
                (furthest - tolerance, false)
            } else {
                (f64::max(support.value, 0.0) - tolerance, support.value <= tolerance)
            };
            let Some(range) = grasp.edges(i) else {
                let along_normal = grasp.contacts()[i].max_normal_force * grasp.maps()[i].column(0).dot(z);
                let active = support.value >= least;
                let whole = active && support.value - along_normal <= tolerance;
                let points = if active { vec![(support.wrench, support.force)] } else { Vec::new() };
                return Face { points, whole, optional };
            };
            let all = grasp.finite_wrenches()[range.clone()].iter().zip(&grasp.finite_forces()[range]);
            let active = all.filter(|(wrench, _)| wrench.dot(z) >= least);
            Face { points: active.map(|(wrench, force)| (*wrench, *force)).collect(), whole: false, optional }
        };
        let contacts = supports.iter().enumerate().map(face).collect();
        Self { query, set, contacts, union, origin: union && with_origin && furthest <= tolerance }
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
            let support = self.set.contact_support(i, functional);
            Some((support.value, support.wrench, support.force))
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

/// The force and torque parts of a functional, in space.
fn split<const D: usize>(z: &Wrench<D>) -> (Vector3<f64>, Vector3<f64>) {
    match D {
        3 => (Vector3::new(z[0], z[1], 0.0), Vector3::new(0.0, 0.0, z[2])),
        _ => (Vector3::new(z[0], z[1], z[2]), Vector3::new(z[3], z[4], z[5])),
    }
}

/// A planar contact neither leaves its plane nor turns out of it.
fn in_space<const D: usize>(mut gradient: Vector3<f64>) -> Vector3<f64> {
    if D == 3 {
        gradient.z = 0.0;
    }
    gradient
}
