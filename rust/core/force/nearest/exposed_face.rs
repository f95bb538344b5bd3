//! The face of a contact's forces that the normal of the nearest wrench exposes: the forces that reach furthest along it.

use crate::force::squares::dual::{DualContact, ForceSet};
use crate::force::squares::polytope::Polytope;
use crate::force::squares::projection::CutCone;
use crate::grasp::contact::ContactForce;
use crate::wrench_set::cone::{cone_slope, cone_support};

/// How the force of a contact may move while the normal turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Freedom {
    /// It stays: no force, or a corner of a polytope.
    Fixed,
    /// On the rim of the cone, at a bound of the normal force: the normal determines it.
    Rim,
    /// On the cone between the bounds: the normal determines the direction, but not the length.
    Ray,
    /// Along flat directions, all orthogonal to the normal: inside the cone or its disc, or on a face of a polytope.
    Flat,
}

/// The freedom of a contact and its flat directions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExposedFace {
    pub(crate) freedom: Freedom,
    axes: [ContactForce; 4],
    count: usize,
}

impl ExposedFace {
    pub(crate) const FIXED: Self =
        Self { freedom: Freedom::Fixed, axes: [ContactForce::new(0.0, 0.0, 0.0, 0.0); 4], count: 0 };

    /// The face in which the force nearest to `x` lies.
    pub(crate) fn around<const D: usize>(contact: &DualContact<D>, x: &ContactForce) -> Self {
        let found = contact.project(x);
        let ForceSet::Cone(cone) = &contact.set else {
            return Self::flat(&found.axes[..found.count]);
        };
        let normal = found.force[0];
        if normal == 0.0 {
            return Self::FIXED;
        }
        let at_bound = normal == cone.high || normal == cone.low;
        let inside =
            if at_bound { load(cone, &found.force) < normal * (1.0 - ON_CONE) } else { found.inside };
        if inside {
            let tangential = usize::from(at_bound);
            let axes: [ContactForce; 4] = std::array::from_fn(unit);
            return Self::flat(&axes[tangential..contact.components()]);
        }
        Self { freedom: if at_bound { Freedom::Rim } else { Freedom::Ray }, ..Self::FIXED }
    }

    fn flat(axes: &[ContactForce]) -> Self {
        let mut face = Self::FIXED;
        face.count = axes.len().min(4);
        face.axes[..face.count].copy_from_slice(&axes[..face.count]);
        if face.count > 0 {
            face.freedom = Freedom::Flat;
        }
        face
    }

    /// The directions in which the normal leaves the force free; `ray` is that of [`Freedom::Ray`].
    pub(crate) fn directions<'a>(&'a self, ray: &'a ContactForce) -> &'a [ContactForce] {
        match self.freedom {
            Freedom::Fixed | Freedom::Rim => &[],
            Freedom::Ray => std::slice::from_ref(ray),
            Freedom::Flat => &self.axes[..self.count],
        }
    }
}

/// A force this near to its cone, relative to the normal force, is on it.
const ON_CONE: f64 = 1e-12;

fn load(cone: &CutCone, f: &ContactForce) -> f64 {
    let twist = if cone.gamma > 0.0 { f[3] / cone.gamma } else { 0.0 };
    if cone.mu > 0.0 { (f[1].hypot(f[2]) / cone.mu).hypot(twist) } else { f[0] }
}

fn unit(component: usize) -> ContactForce {
    let mut axis = ContactForce::zeros();
    axis[component] = 1.0;
    axis
}

/// All forces of a contact that reach furthest along the normal, within a tolerance.
#[derive(Debug, Clone)]
pub(crate) struct ExposedSet {
    pub(crate) set: ForceSet,
    pub(crate) face: ExposedFace,
    /// Orthonormal directions in which these forces differ.
    pub(crate) free: Vec<ContactForce>,
}

impl ExposedSet {
    /// `h` is the normal as the contact sees it. `None` where forces without an upper bound reach beyond the tolerance.
    pub(crate) fn along<const D: usize>(
        contact: &DualContact<D>,
        h: &ContactForce,
        touching: f64,
    ) -> Option<Self> {
        let (low, high) = contact.bounds();
        let most = contact.furthest(h);
        let movable = most.abs() <= touching && low < high;
        let level = if most > 0.0 { high } else { low };
        let (low, high) = if movable { (low, high) } else { (level, level) };
        if high == 0.0 {
            return Some(Self { set: ForceSet::Zero, face: ExposedFace::FIXED, free: Vec::new() });
        }
        if low == f64::INFINITY {
            return None;
        }
        let mut directions = Vec::new();
        exposed_directions(&contact.set, h, touching, |direction| directions.push(direction));
        let free = Polytope::span(&directions);
        let mut face = ExposedFace::flat(&free);
        let set = match &contact.set {
            ForceSet::Cone(cone) if cone_slope(h, cone.mu, cone.gamma) <= touching => {
                ForceSet::Cone(CutCone { low, high, ..*cone })
            }
            ForceSet::Cone(cone) => {
                face = ExposedFace {
                    freedom: if movable { Freedom::Ray } else { Freedom::Rim },
                    ..ExposedFace::FIXED
                };
                let force = cone_support(h, cone.mu, cone.gamma) * contact.unit;
                finite(vec![force], false, (low / contact.unit, high / contact.unit))
            }
            ForceSet::Finite(polytope) => {
                let reaches = |force: &&ContactForce| force.dot(h) >= most - touching;
                let forces = polytope.forces.iter().filter(reaches).copied().collect();
                finite(forces, polytope.general && movable, (low, high))
            }
            ForceSet::Zero => ForceSet::Zero,
        };
        Some(Self { set, face, free })
    }
}

fn finite(forces: Vec<ContactForce>, general: bool, (low, high): (f64, f64)) -> ForceSet {
    let mut polytope = Polytope::new(forces, general);
    polytope.search_only();
    (polytope.low, polytope.high) = (low, high);
    ForceSet::Finite(polytope)
}

/// Calls `visit` with directions that span all forces which reach along `h` as far as the furthest, within `touching`:
/// those of contacts that are about to press, to slip or to reach a bound, too.
pub(crate) fn exposed_directions(
    set: &ForceSet,
    h: &ContactForce,
    touching: f64,
    mut visit: impl FnMut(ContactForce),
) {
    match set {
        ForceSet::Zero => {}
        ForceSet::Cone(cone) => {
            let slope = cone_slope(h, cone.mu, cone.gamma);
            let reach = h[0] + slope;
            let free = reach.abs() <= touching && cone.low < cone.high;
            let level = if reach > 0.0 { cone.high } else { cone.low };
            if slope <= touching && (free || level > 0.0) {
                let scales = [cone.mu, cone.mu, cone.gamma];
                (1..4).filter(|&k| scales[k - 1] > 0.0).for_each(|k| visit(unit(k)));
            }
            if free {
                visit(cone_support(h, cone.mu, cone.gamma));
            }
        }
        ForceSet::Finite(polytope) => exposed_corners(polytope, h, touching, visit),
    }
}

fn exposed_corners(
    polytope: &Polytope,
    h: &ContactForce,
    touching: f64,
    mut visit: impl FnMut(ContactForce),
) {
    let reaches = || polytope.forces.iter().map(|force| force.dot(h));
    let most = reaches().fold(f64::NEG_INFINITY, f64::max);
    let free = most.abs() <= touching && polytope.low < polytope.high;
    if !free && (if most > 0.0 { polytope.high } else { polytope.low }) == 0.0 {
        return;
    }
    let mut first = if free { Some(ContactForce::zeros()) } else { None };
    for (force, _) in polytope.forces.iter().zip(reaches()).filter(|(_, reach)| *reach >= most - touching) {
        match first {
            Some(first) => visit(force - first),
            None => first = Some(*force),
        }
    }
}
