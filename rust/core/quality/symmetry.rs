//! Which orthogonal maps take a wrench set to itself.
//!
//! An isometry `Q` of space that fixes the torque origin acts on directions `z = (a, b)` as `(Q a, det(Q) Q b)`. Where it
//! maps contacts to contacts with the same forces, the support function keeps its value: `p(Q z) = p(z)`. Contacts are
//! never exactly symmetric, so each map comes with its *deviation*, a bound of `|p(Q z) - p(z)|` over unit `z` that
//! follows from the columns of the maps `G_i`. Whoever uses a symmetry subtracts the deviation from what it proves.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};

use crate::grasp::contact::ForceModel;
use crate::grasp::{ContactMap, contact_map};
use crate::quality::query::QualityQuery;
use crate::tolerances::{ALIKE_FEATURES, ORTHOGONAL_MAP};
use crate::wrench_set::Criterion;

/// More contacts than this are not searched for symmetries.
const MAX_CONTACTS: usize = 32;

/// A cone of at most this many edges turns by single edges; others by as many steps as divide them.
const MAX_TURNS: usize = 16;

/// An orthogonal map of directions that nearly keeps the support function.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetry<const D: usize> {
    pub(crate) map: SMatrix<f64, D, D>,
    /// No less than `|p(map z) - p(z)|` for unit `z`.
    pub(crate) deviation: f64,
}

/// The symmetries of a set.
#[derive(Debug, Clone)]
pub(crate) struct Symmetries<const D: usize> {
    /// The generator of rotations about a line through the origin that holds all contacts and their normals. Its
    /// deviation is that of every rotation.
    pub(crate) rotation: Option<Symmetry<D>>,
    /// Without such rotations: finitely many maps, the identity not among them.
    pub(crate) maps: Vec<Symmetry<D>>,
}

impl<const D: usize> Symmetries<D> {
    /// The symmetries of a spatial set whose deviation does not exceed `tolerance`.
    pub(crate) fn of(query: &QualityQuery<'_, D>, tolerance: f64) -> Self {
        let mut found = Self { rotation: None, maps: Vec::new() };
        let contacts = query.grasp.contacts();
        let searched = contacts.iter().all(|c| !matches!(c.forces, ForceModel::Extreme(_)));
        if D != 6 || contacts.len() > MAX_CONTACTS || !searched {
            return found;
        }
        let Some(features) = Features::of(query) else { return found };
        let round = contacts.iter().all(|c| c.forces == ForceModel::Cone || c.friction == 0.0);
        if let Some(axis) = features.axis().filter(|_| round) {
            found.rotation = rotation(query, &axis).filter(|r| r.deviation <= tolerance);
        }
        if found.rotation.is_some() {
            return found;
        }
        for isometry in features.isometries(query) {
            let map = query.metric.conjugate(&lift(&isometry));
            let defect = (map.tr_mul(&map) - SMatrix::identity()).amax();
            let known = |other: &Symmetry<D>| (other.map - map).amax() < ALIKE_FEATURES;
            let orthogonal = defect < ORTHOGONAL_MAP;
            if !orthogonal
                || (map - SMatrix::identity()).amax() < ALIKE_FEATURES
                || found.maps.iter().any(known)
            {
                continue;
            }
            // The map stretches a unit direction by half of this at most, and no wrench is longer than the scale.
            let stretched = D as f64 * (defect + f64::EPSILON) * query.scale;
            let deviation = stretched + deviation(query, &isometry, &map, &features);
            if deviation <= tolerance {
                found.maps.push(Symmetry { map, deviation });
            }
        }
        found
    }

    /// Whether nothing was found.
    pub(crate) fn are_none(&self) -> bool {
        self.rotation.is_none() && self.maps.is_empty()
    }

    /// The largest deviation of those that are used: of the rotations where there are any.
    pub(crate) fn deviation(&self) -> f64 {
        let maps = || self.maps.iter().map(|symmetry| symmetry.deviation).fold(0.0, f64::max);
        self.rotation.as_ref().map_or_else(maps, |rotation| rotation.deviation)
    }
}

/// `diag(Q, det(Q) Q)`: forces are vectors, torques are axial ones.
fn lift<const D: usize>(isometry: &Matrix3<f64>) -> SMatrix<f64, D, D> {
    let axial = isometry * isometry.determinant().signum();
    SMatrix::from_fn(|row, column| match (row / 3, column / 3) {
        (0, 0) => isometry[(row, column)],
        (1, 1) => axial[(row - 3, column - 3)],
        _ => 0.0,
    })
}

/// One vector for each contact that turns with it.
struct Features {
    vectors: Vec<Vector3<f64>>,
}

impl Features {
    /// Positions in units of their size, and normals; `None` where they single out no direction.
    fn of<const D: usize>(query: &QualityQuery<'_, D>) -> Option<Self> {
        let contacts = query.grasp.contacts();
        let origin = query.grasp.options().origin;
        let squares = contacts.iter().map(|c| (c.position - origin).norm_squared());
        let size = (squares.sum::<f64>() / contacts.len() as f64).sqrt();
        let vector = |position: Vector3<f64>, normal: Vector3<f64>| {
            (position - origin) / size.max(f64::MIN_POSITIVE) - normal * 0.7
        };
        let vectors: Vec<_> = contacts.iter().map(|c| vector(c.position, c.normal)).collect();
        let usable = vectors.iter().all(|v| v.iter().all(|x| x.is_finite()) && v.norm() > 0.05);
        usable.then_some(Self { vectors })
    }

    /// The line that holds all of them.
    fn axis(&self) -> Option<Vector3<f64>> {
        let axis = self.vectors[0].normalize();
        self.vectors.iter().all(|v| v.cross(&axis).norm() < ALIKE_FEATURES).then_some(axis)
    }

    /// All isometries that may take contacts to contacts.
    fn isometries<const D: usize>(&self, query: &QualityQuery<'_, D>) -> Vec<Matrix3<f64>> {
        if self.axis().is_some() {
            return self.along_a_line(query);
        }
        let first = self.vectors[0];
        let across = |v: &Vector3<f64>| first.cross(v).norm();
        let Some(second) = self.vectors[1..].iter().copied().max_by(|a, b| across(a).total_cmp(&across(b)))
        else {
            return Vec::new();
        };
        let from = frame(&first, &second);
        let mut found = Vec::new();
        for u in &self.vectors {
            for v in &self.vectors {
                let alike = (u.norm() - first.norm()).abs() < ALIKE_FEATURES
                    && (v.norm() - second.norm()).abs() < ALIKE_FEATURES
                    && (u.dot(v) - first.dot(&second)).abs() < ALIKE_FEATURES;
                if alike {
                    let to = frame(u, v);
                    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
                    found.extend([to * from.transpose(), to * mirror * from.transpose()]);
                }
            }
        }
        found
    }

    /// Of contacts on a line: those that take the frame of the first to that of another, turned by edges of its cone.
    fn along_a_line<const D: usize>(&self, query: &QualityQuery<'_, D>) -> Vec<Matrix3<f64>> {
        let turns = query.grasp.contacts().iter().filter_map(|c| match c.forces {
            ForceModel::Edges(edges) if c.friction > 0.0 => Some(edges),
            _ => None,
        });
        let edges = turns.fold(0, gcd);
        let turns = (1..=MAX_TURNS).rev().find(|turns| edges % turns == 0).unwrap_or(1);
        let frames = query.grasp.frames();
        let mut found = Vec::new();
        for (to, v) in frames.iter().zip(&self.vectors) {
            if (v.norm() - self.vectors[0].norm()).abs() > ALIKE_FEATURES {
                continue;
            }
            for turn in 0..turns {
                let angle = std::f64::consts::TAU * turn as f64 / turns as f64;
                let (s, c) = angle.sin_cos();
                for sign in [1.0, -1.0] {
                    let turned = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s * sign, 0.0, s, c * sign);
                    found.push(to * turned * frames[0].transpose());
                }
            }
        }
        found
    }

    /// The contact at the image of contact `i`.
    fn image(&self, isometry: &Matrix3<f64>, i: usize) -> usize {
        let image = isometry * self.vectors[i];
        let distance = |j: &usize| (self.vectors[*j] - image).norm_squared();
        (0..self.vectors.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(i)
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The orthonormal frame of two vectors.
fn frame(u: &Vector3<f64>, v: &Vector3<f64>) -> Matrix3<f64> {
    let first = u.normalize();
    let second = (v - first * first.dot(v)).normalize();
    Matrix3::from_columns(&[first, second, first.cross(&second)])
}

/// No less than `|p(map z) - p(z)|`: how far the images of the contacts' maps are from those of their partners.
fn deviation<const D: usize>(
    query: &QualityQuery<'_, D>,
    isometry: &Matrix3<f64>,
    map: &SMatrix<f64, D, D>,
    features: &Features,
) -> f64 {
    let contacts = query.grasp.contacts();
    let frames = query.grasp.frames();
    let reach: Vec<_> = (0..contacts.len()).map(|i| reach(query, i)).collect();
    let mut taken = vec![false; contacts.len()];
    let mut each = Vec::with_capacity(contacts.len());
    for i in 0..contacts.len() {
        let j = features.image(isometry, i);
        if std::mem::replace(&mut taken[j], true) {
            return f64::INFINITY;
        }
        // What the isometry makes of the frame of `i`, in the frame of `j`.
        let turned = frames[j].tr_mul(&(isometry * frames[i]));
        let tangential: Matrix2<f64> = turned.fixed_view::<2, 2>(1, 1).into();
        let Some(turn) = turn_of_forces(&contacts[i].forces, &contacts[j].forces, &tangential) else {
            return f64::INFINITY;
        };
        let torsion = isometry.determinant().signum();
        let difference: ContactMap<D> = {
            let image = map * reach[i];
            let mut partner = reach[j];
            let columns = partner.fixed_columns::<2>(1) * turn;
            partner.fixed_columns_mut::<2>(1).copy_from(&columns);
            partner.column_mut(3).scale_mut(torsion);
            image - partner
        };
        each.push(size_of_map(&difference));
    }
    let center = query.center.map_or(0.0, |(_, center)| (map * center - center).norm());
    center + total(query.set.criterion(), &each)
}

/// `f^U G_i diag(1, mu, mu, gamma)` in the coordinates of the metric.
fn reach<const D: usize>(query: &QualityQuery<'_, D>, i: usize) -> ContactMap<D> {
    scaled(query, i, &query.grasp.maps()[i])
}

fn scaled<const D: usize>(query: &QualityQuery<'_, D>, i: usize, map: &ContactMap<D>) -> ContactMap<D> {
    let contact = &query.grasp.contacts()[i];
    let mut map = query.metric.to_euclidean(map);
    for (column, by) in [1.0, contact.friction, contact.friction, contact.torsion].into_iter().enumerate() {
        map.column_mut(column).scale_mut(by * contact.max_normal_force);
    }
    map
}

/// No force of a unit cone is longer under this map, measured by any unit direction.
fn size_of_map<const D: usize>(map: &ContactMap<D>) -> f64 {
    map.column(0).norm() + map.columns_range(1..).norm()
}

fn total(criterion: Criterion, each: &[f64]) -> f64 {
    match criterion {
        Criterion::Sum => each.iter().copied().fold(0.0, f64::max),
        Criterion::Max => each.iter().sum(),
    }
}

/// The turn of tangential forces, nearest to `tangential`, that keeps the forces of a contact; `None` where there is
/// none, or the contacts differ in kind.
fn turn_of_forces(
    forces: &ForceModel,
    others: &ForceModel,
    tangential: &Matrix2<f64>,
) -> Option<Matrix2<f64>> {
    if forces != others {
        return None;
    }
    let sign = tangential.determinant().signum();
    let mut angle = tangential[(1, 0)].atan2(tangential[(0, 0)]);
    if let ForceModel::Edges(edges) = forces {
        let step = std::f64::consts::TAU / *edges as f64;
        angle = (angle / step).round() * step;
    }
    let (s, c) = angle.sin_cos();
    Some(Matrix2::new(c, -s * sign, s, c * sign))
}

/// Rotations about `axis`: every one of them keeps the grasp whose contacts are moved onto the axis, from which this one
/// differs by half of the deviation.
fn rotation<const D: usize>(query: &QualityQuery<'_, D>, axis: &Vector3<f64>) -> Option<Symmetry<D>> {
    let cross = axis.cross_matrix();
    let generator = SMatrix::from_fn(
        |row, column| {
            if row / 3 == column / 3 { cross[(row % 3, column % 3)] } else { 0.0 }
        },
    );
    let map = query.metric.conjugate(&generator);
    let defect = (map + map.transpose()).amax();
    if defect > ORTHOGONAL_MAP {
        return None;
    }
    // A whole turn stretches a unit direction by half a turn times this at most, and no wrench is longer than the scale.
    let stretched = PI * D as f64 * (defect + f64::EPSILON) * query.scale;
    let grasp = query.grasp;
    let moved = |i: usize| {
        let contact = &grasp.contacts()[i];
        let lever = contact.position - grasp.options().origin;
        let n = axis * contact.normal.dot(axis).signum();
        let o = grasp.frames()[i].column(1).into_owned();
        let o = (o - n * n.dot(&o)).normalize();
        let frame = Matrix3::from_columns(&[n, o, n.cross(&o)]);
        let on_axis = scaled(query, i, &contact_map::<D>(&(axis * lever.dot(axis)), &frame));
        size_of_map(&(reach(query, i) - on_axis))
    };
    let each: Vec<_> = (0..grasp.num_contacts()).map(moved).collect();
    let center = query.center.map_or(0.0, |(_, center)| (map * center).norm());
    Some(Symmetry { map, deviation: 2.0 * (stretched + center + total(query.set.criterion(), &each)) })
}
