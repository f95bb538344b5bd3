//! Which of the three classes of Propositions 1 and 2 a grasp belongs to.
//!
//! Closure depends neither on the lengths of the primitive wrenches nor on the unit of length nor on the
//! torque origin. It is therefore decided on a *twin* of the grasp: torques about the contacts' centroid, in
//! units of their root-mean-square distance from it, and every wrench of unit length (a true cone: every
//! contact). Millimetre positions and force limits spread over many decades then look like any other grasp,
//! and one fixed tolerance has one meaning.

use nalgebra::Vector3;

use crate::grasp::{ContactMap, Grasp, Wrench, contact_map, unit};
use crate::nearest_point::nearest_point;
use crate::polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::wrench_set::{Criterion, WrenchSet};

/// Radius of the ball that the twin's wrenches must surround to count as force closure, and the distance from
/// the origin within which their hull counts as touching it.
pub const CLOSURE_TOLERANCE: f64 = 1e-10;

/// What a grasp can resist, by Propositions 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Closure {
    /// Resultant wrenches in all directions; `rho < 0`.
    Force,
    /// Opposite wrenches in some directions but not in all; `rho = 0`.
    Partial,
    /// No two opposite wrenches; `rho > 0`.
    None,
}

/// The class, with its witness where it is not force closure.
pub(crate) struct Verdict<const D: usize> {
    pub(crate) closure: Closure,
    /// A direction `z` with `w . z <= 0` (to the tolerance) for all wrenches; zero for force closure.
    pub(crate) direction: Wrench<D>,
}

/// Decides the class of a grasp.
pub(crate) fn classify<const D: usize>(grasp: &Grasp<D>, polytope: &mut Polytope<D>) -> Verdict<D> {
    let twin = Twin::of(grasp);
    let limits = Limits { stop_above: CLOSURE_TOLERANCE, ..Limits::new(1e-9) };
    let (upper, direction) = match polytope.expand(CLOSURE_TOLERANCE, &limits, |z| twin.set.support(z)) {
        Expansion::Radius(radius) if radius.lower > CLOSURE_TOLERANCE => {
            return Verdict { closure: Closure::Force, direction: Wrench::zeros() };
        }
        Expansion::Radius(Radius { upper, direction, .. })
        | Expansion::Pierced(Thinnest { upper, direction, .. })
        | Expansion::Stopped(Thinnest { upper, direction, .. }) => (upper, direction),
    };
    let nearest = nearest_point(1e-6, CLOSURE_TOLERANCE, usize::MAX, |z| twin.set.support(z));
    // Wolfe's point alone proves nothing where rounding stalls it: only a plane beyond the origin does. The origin
    // itself, a point of the set like any other, has no plane.
    let (beyond, direction) = if nearest.upper > 0.0 && nearest.lower > -upper {
        (nearest.lower, -nearest.point)
    } else {
        (-upper, direction)
    };
    let closure = if beyond > CLOSURE_TOLERANCE { Closure::None } else { Closure::Partial };
    Verdict { closure, direction: twin.physical(&direction) }
}

/// Whether a functional on physical wrenches proves that a grasp has no closure at all: every wrench of the twin lies
/// beyond the tolerance on its far side.
pub(crate) fn separates<const D: usize>(grasp: &Grasp<D>, functional: &Wrench<D>) -> bool {
    let twin = Twin::of(grasp);
    twin.set.value(&twin.unit_of_functional(functional)) < -CLOSURE_TOLERANCE
}

/// The same grasp in its own units.
struct Twin<const D: usize> {
    set: WrenchSet<D>,
    /// From the torque origin to the contacts' centroid.
    shift: Vector3<f64>,
    size: f64,
}

impl<const D: usize> Twin<D> {
    fn of(grasp: &Grasp<D>) -> Self {
        let count = grasp.num_contacts() as f64;
        let contacts = grasp.contacts();
        let centroid = contacts.iter().map(|c| c.position / count).sum::<Vector3<f64>>();
        let spread = contacts.iter().map(|c| (c.position - centroid).norm_squared() / count).sum::<f64>();
        // Contacts that all coincide exert no torque about their centroid; rounding must not become one.
        let reach = contacts.iter().map(|c| c.position.amax()).fold(0.0, f64::max);
        let size = if spread.sqrt() > 1e-14 * reach { spread.sqrt() } else { f64::INFINITY };
        let maps: Vec<_> = contacts
            .iter()
            .zip(grasp.frames())
            .map(|(contact, frame)| {
                let mut map: ContactMap<D> = contact_map(&((contact.position - centroid) / size), frame);
                if size.is_finite() {
                    map.column_mut(3).unscale_mut(size);
                }
                map
            })
            .collect();
        let set = WrenchSet::of_unit_wrenches(grasp, &maps, Criterion::Sum);
        Self {
            set,
            shift: centroid - grasp.options().origin,
            size: if size.is_finite() { size } else { 1.0 },
        }
    }

    /// The unit direction that measures the twin's wrenches as `functional` measures physical ones: the inverse of
    /// [`Self::physical`].
    fn unit_of_functional(&self, functional: &Wrench<D>) -> Wrench<D> {
        let mut z = *functional;
        let c = &self.shift;
        if D == 3 {
            z[0] -= z[2] * c.y;
            z[1] += z[2] * c.x;
            z[2] *= self.size;
        } else {
            let b = Vector3::new(z[3], z[4], z[5]);
            let a = b.cross(c);
            for row in 0..3 {
                z[row] += a[row];
                z[row + 3] *= self.size;
            }
        }
        unit(&z)
    }

    /// The direction that measures physical wrenches as `z` measures the twin's.
    fn physical(&self, z: &Wrench<D>) -> Wrench<D> {
        let mut physical = *z;
        let c = &self.shift;
        if D == 3 {
            let b = z[2] / self.size;
            physical[0] += b * c.y;
            physical[1] -= b * c.x;
            physical[2] = b;
            return physical;
        }
        let b = Vector3::new(z[3], z[4], z[5]) / self.size;
        let a = b.cross(c);
        for row in 0..3 {
            physical[row] -= a[row];
            physical[row + 3] = b[row];
        }
        physical
    }
}
