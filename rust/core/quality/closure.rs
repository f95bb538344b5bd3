//! Which of the three classes of Propositions 1 and 2 a grasp belongs to.
//!
//! Closure depends neither on the lengths of the primitive wrenches nor on the unit of length nor on the
//! torque origin. It is therefore decided on the *scaled grasp*: torques about the contacts' centroid, in
//! units of their root-mean-square distance from it, and every wrench of unit length (a true cone: every
//! contact). Millimetre positions and force limits spread over many decades then look like any other grasp.
//!
//! **Closure is decided as far as rounding allows.** Force closure is a ball inside the hull of the scaled grasp, no closure
//! a plane between the hull and the origin, each beyond what rounding may have done to the wrenches (`wrench_rounding.rs`): some
//! `1e-14`. What is neither counts as partial.
//! Nothing but the scaled grasp decides, so no metric, criterion, limit or external wrench changes the class.

use std::cmp::Ordering;

use nalgebra::Vector3;

use crate::convex::expanding_polytope::plane_norm::PlaneNorm;
use crate::convex::expanding_polytope::{Expansion, Limits, Polytope, Radius, Thinnest};
use crate::convex::min_norm_point::nearest_point;
use crate::convex::round_coordinates::{RoundSet, matrix_of, round_rows};
use crate::convex::rounding::along;
use crate::grasp::contact::{ContactForce, ForceModel};
use crate::grasp::exact_map::{Wrench32, dot};
use crate::grasp::wrench::{split, with_torque};
use crate::grasp::wrench_norm::Metric;
use crate::grasp::wrench_rounding::{edge_magnitude, force_magnitude, map_magnitude};
use crate::grasp::{ContactMap, Grasp, Wrench, contact_map, length, unit};
use crate::tolerances::{
    CLEAR_CLOSURE, COINCIDENT_CONTACTS, LEAST_TANGENT, NEAREST_UNIT_WRENCH_RTOL, ROUNDED_POINT,
    ROUNDED_POSITION, SMALLER_SIMPLEX, UNIT_WRENCHES_RTOL,
};
use crate::wrench_set::{Criterion, WrenchSet};

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

/// Relative width of the bracket of a radius that is compared with what rounding takes of it.
const MARGIN_RTOL: f64 = 1e-3;

/// The class, with its witness.
pub(crate) struct Verdict<const D: usize> {
    pub(crate) closure: Closure,
    /// A direction `z` with `w . z <= 0` (to rounding) for all wrenches; zero for force closure.
    pub(crate) direction: Wrench<D>,
    /// The radius or the gap that proves it, as [`Self::certain`] carries it to other coordinates.
    margin: f64,
    scaled: ScaledGrasp<D>,
}

/// Decides the class of a grasp.
pub(crate) fn classify<const D: usize>(grasp: &Grasp<D>, polytope: &mut Polytope<D>) -> Verdict<D> {
    let scaled = ScaledGrasp::of(grasp);
    let uncertain = scaled.uncertain(grasp);
    polytope.allow(uncertain);
    let verdict = |closure, direction: &Wrench<D>, margin| {
        (
            closure,
            if closure == Closure::Force { Wrench::zeros() } else { scaled.shape.physical(direction) },
            margin,
        )
    };
    let mut size = CLEAR_CLOSURE;
    let mut nearest = None;
    let (closure, direction, margin) = loop {
        let limits = Limits { stop_above: size, ..Limits::new(UNIT_WRENCHES_RTOL) };
        let (upper, direction) = match polytope.expand(size, &limits, |z| scaled.set.support(z)) {
            Expansion::Radius(radius) => break verdict(Closure::Force, &radius.direction, radius.lower),
            Expansion::Pierced(Thinnest { upper, direction, .. })
            | Expansion::Stopped(Thinnest { upper, direction, .. }) => (upper, direction),
        };
        let nearest = nearest.get_or_insert_with(|| {
            nearest_point(NEAREST_UNIT_WRENCH_RTOL, f64::MIN_POSITIVE, usize::MAX, &uncertain, |z| {
                scaled.set.support(z)
            })
        });
        if nearest.lower > 0.0 {
            break verdict(Closure::None, &nearest.witness, nearest.lower);
        }
        let gap = -upper - along(&direction, &uncertain);
        if gap > 0.0 {
            break verdict(Closure::None, &direction, gap);
        }
        // What is thinner than rounding, no smaller simplex can tell from flat.
        let smaller = (SMALLER_SIMPLEX * size.min(upper.abs())).max(uncertain.amax());
        let thinner = smaller.partial_cmp(&size) == Some(Ordering::Less);
        if upper <= along(&direction, &uncertain) {
            break verdict(Closure::Partial, &direction, 0.0);
        }
        // Rounding of long wrenches may have hidden that the set is not flat.
        if !thinner {
            break match scaled.round_radius(grasp, &uncertain) {
                Some(Ok(radius)) => verdict(Closure::Force, &direction, radius),
                Some(Err(thinnest)) => verdict(Closure::Partial, &thinnest, 0.0),
                None => verdict(Closure::Partial, &direction, 0.0),
            };
        }
        size = smaller;
    };
    Verdict { closure, direction, margin, scaled }
}

/// Whether a ball of this `radius`, in the set of a grasp none of whose wrenches is longer than `longest`, is a proof of
/// force closure beyond doubt, one that [`classify`] finds, too.
pub(crate) fn is_clear<const D: usize>(
    grasp: &Grasp<D>,
    metric: &Metric<D>,
    radius: f64,
    longest: f64,
) -> bool {
    let shape = Shape::of(grasp);
    let (to, from) = shape.distortions(metric);
    radius > 4.0 * shape.clear(grasp) * grasp.num_contacts() as f64 * to * from * longest
}

impl<const D: usize> Verdict<D> {
    /// What the class proves of the radius, or the distance, in the coordinates where `metric` is Euclidean.
    pub(crate) fn certain(&self, grasp: &Grasp<D>, metric: &Metric<D>) -> f64 {
        let lengths = self.scaled.lengths(grasp).map(|(.., length)| length).filter(|length| *length > 0.0);
        // The ball times the shortest wrench lies in the hull; half of it covers the rounding of this line.
        0.5 * self.margin * lengths.fold(f64::INFINITY, f64::min) / self.scaled.shape.distortions(metric).1
    }
}

/// Whether a functional on physical wrenches proves beyond doubt that a grasp has no closure at all, where every wrench
/// of the grasp has a value of at most `-gap` and none is longer than `longest` in the norm of the `metric`.
///
/// The value of its wrench `S w / |S w|` along its unit direction is `-gap / (|S w| |S^-T y|)` at most.
/// Most open grasps are open by so much that the scaled grasp itself is not needed.
pub(crate) fn is_separated<const D: usize>(
    grasp: &Grasp<D>,
    metric: &Metric<D>,
    functional: &Wrench<D>,
    gap: f64,
    longest: f64,
) -> bool {
    let shape = Shape::of(grasp);
    let size = shape.scaled_functional(functional).norm() * shape.distortion_from(metric) * longest;
    gap > 4.0 * shape.clear(grasp) * size || separates(grasp, functional)
}

/// Whether a functional on physical wrenches proves beyond doubt that a grasp has no closure at all.
fn separates<const D: usize>(grasp: &Grasp<D>, functional: &Wrench<D>) -> bool {
    let scaled = ScaledGrasp::of(grasp);
    let z = scaled.shape.unit_of_functional(functional);
    let value = scaled.set.value(&z);
    value < -CLEAR_CLOSURE && value < -(CLEAR_CLOSURE + along(&z, &scaled.uncertain(grasp)))
}

/// The same grasp in its own units.
struct ScaledGrasp<const D: usize> {
    set: WrenchSet<D>,
    maps: Vec<ContactMap<D>>,
    shape: Shape,
}

/// Where a grasp is, and how large.
struct Shape {
    centroid: Vector3<f64>,
    /// From the torque origin to the contacts' centroid.
    shift: Vector3<f64>,
    /// The largest coordinate of a position.
    reach: f64,
    /// The unit of torques; infinite where contacts that coincide exert none.
    unit: f64,
}

impl<const D: usize> ScaledGrasp<D> {
    fn of(grasp: &Grasp<D>) -> Self {
        let shape = Shape::of(grasp);
        let maps: Vec<_> = grasp
            .contacts()
            .iter()
            .zip(grasp.frames())
            .map(|(contact, frame)| {
                let mut map: ContactMap<D> =
                    contact_map(&((contact.position - shape.centroid) / shape.unit), frame);
                if shape.unit.is_finite() {
                    map.column_mut(3).unscale_mut(shape.unit);
                }
                map
            })
            .collect();
        let set = WrenchSet::of_unit_wrenches(grasp, &maps, Criterion::Sum, |wrench| *wrench);
        Self { set, maps, shape }
    }

    /// The radius that is certain, from coordinates where the set is round, or the direction along which it is thinnest;
    /// `None` where it is flat.
    ///
    /// The coordinates depend on the scaled grasp alone, not on the limits of its contacts: so does the class.
    fn round_radius(&self, grasp: &Grasp<D>, uncertain: &Wrench<D>) -> Option<Result<f64, Wrench<D>>> {
        let axes = |i: usize| {
            let contact = &grasp.contacts()[i];
            match contact.forces {
                ForceModel::Extreme(_) => {
                    let forces = force_magnitude(grasp, i, contact);
                    forces / forces.amax().max(f64::MIN_POSITIVE)
                }
                _ => ContactForce::new(1.0, contact.friction, contact.friction, contact.torsion),
            }
        };
        let columns = self.maps.iter().enumerate().flat_map(|(i, map)| {
            let axes = axes(i);
            std::array::from_fn::<Wrench32<D>, 4, _>(|k| {
                std::array::from_fn(|row| (map[(row, k)] * axes[k]).into())
            })
        });
        let rows = round_rows(columns.collect())?;
        let through = |wrench: &Wrench<D>| {
            let exact: Wrench32<D> = std::array::from_fn(|row| wrench[row].into());
            Wrench::from_fn(|row, _| dot(&rows[row], &exact).value())
        };
        let set = WrenchSet::of_unit_wrenches(grasp, &self.maps, Criterion::Sum, through);
        let norm = matrix_of(&rows).transpose();
        let round = RoundSet {
            norm: PlaneNorm::Through(vec![norm], norm.norm()),
            uncertain: Wrench::repeat(ROUNDED_POINT * set.longest()),
            longest: set.longest(),
            oracle: |z: &Wrench<D>| set.support(z),
        };
        let physical = |direction: &Wrench<D>| unit(&(norm * direction));
        let lost = uncertain.norm();
        Some(match round.radius(&Limits::new(MARGIN_RTOL)) {
            Ok(radius) if radius.lower > lost => Ok(radius.lower - lost),
            Ok(Radius { direction, .. }) | Err(Thinnest { direction, .. }) => Err(physical(&direction)),
        })
    }

    /// Of every wrench before it is made one of unit length, by contact: the force that exerts it and its length; of a
    /// true cone, the largest components of its forces and the length of its longest axis.
    fn lengths<'a>(&'a self, grasp: &'a Grasp<D>) -> impl Iterator<Item = (usize, ContactForce, f64)> + 'a {
        grasp.contacts().iter().enumerate().flat_map(move |(i, contact)| {
            let axes = [1.0, contact.friction, contact.friction, contact.torsion];
            let cone = grasp.edges(i).is_none().then(|| {
                let axes = ContactForce::from(axes) * contact.max_normal_force;
                let columns = self.maps[i].column_iter().zip(axes.iter());
                (i, axes, columns.map(|(column, by)| by * column.norm()).fold(0.0, f64::max))
            });
            let edges = grasp.finite_forces()[grasp.edges(i).unwrap_or_default()].iter();
            cone.into_iter().chain(edges.map(move |force| (i, *force, length(&(self.maps[i] * force)))))
        })
    }

    /// What rounding may have done to the components of the set's wrenches.
    fn uncertain(&self, grasp: &Grasp<D>) -> Wrench<D> {
        let mut all = Wrench::<D>::zeros();
        let maps: Vec<_> = grasp
            .contacts()
            .iter()
            .enumerate()
            .map(|(i, contact)| {
                let placed = (contact.position - self.shape.centroid).abs()
                    + contact.position.abs() * ROUNDED_POSITION;
                map_magnitude::<D>(grasp, i, &(placed / self.shape.unit), self.shape.size())
            })
            .collect();
        for (i, force, length) in self.lengths(grasp).filter(|(.., length)| *length > 0.0) {
            all = all.sup(&(maps[i] * edge_magnitude(&force) / length));
        }
        // The same for all components: of a flat set, that some are exact tells nothing.
        Wrench::repeat(all.amax() * ROUNDED_POINT)
    }
}

impl Shape {
    fn of<const D: usize>(grasp: &Grasp<D>) -> Self {
        let count = grasp.num_contacts() as f64;
        let contacts = grasp.contacts();
        let centroid = contacts.iter().map(|c| c.position / count).sum::<Vector3<f64>>();
        let spread = contacts.iter().map(|c| (c.position - centroid).norm_squared() / count).sum::<f64>();
        // Contacts that all coincide exert no torque about their centroid; rounding must not become one.
        let reach = contacts.iter().map(|c| c.position.amax()).fold(0.0, f64::max);
        let unit = if spread.sqrt() > COINCIDENT_CONTACTS * reach { spread.sqrt() } else { f64::INFINITY };
        Self { centroid, shift: centroid - grasp.options().origin, reach, unit }
    }

    /// More than [`CLEAR_CLOSURE`] and what [`ScaledGrasp::uncertain`] takes along any unit direction, from the shape alone.
    ///
    /// The sizes behind a unit wrench add up to 5 in forces, and in torques to 6 times the lever and 1 of torsion, which
    /// tangential forces may hide by as much as the lever: `6 + 7 |lever|`. A tangent near the normal makes them larger
    /// by what it keeps of its length.
    fn clear<const D: usize>(&self, grasp: &Grasp<D>) -> f64 {
        let mut kept: f64 = 1.0;
        for (contact, frame) in grasp.contacts().iter().zip(grasp.frames()) {
            if let (6, Some(tangent)) = (D, &contact.tangent) {
                let along = frame.column(0).dot(tangent) / tangent.norm();
                kept = kept.min((1.0 - along * along).max(LEAST_TANGENT).sqrt());
            }
        }
        // No lever is longer than the root of the sum of their squares, no position than twice its largest coordinate.
        let levers = (grasp.num_contacts() as f64).sqrt() + 2.0 * ROUNDED_POSITION * self.reach / self.unit;
        // The square root of six components is less than 3.
        CLEAR_CLOSURE + 3.0 * ROUNDED_POINT * (6.0 + 7.0 * levers) * 1.5 / kept
    }

    /// The unit of torques where it is one.
    fn size(&self) -> f64 {
        if self.unit.is_finite() { self.unit } else { 1.0 }
    }

    /// By how much the map from the scaled coordinates to those of the metric stretches at most, and the map back.
    fn distortions<const D: usize>(&self, metric: &Metric<D>) -> (f64, f64) {
        let unit = |row| Wrench::<D>::from_fn(|other, _| f64::from(u8::from(other == row)));
        let to = metric.size_of_columns((0..D).map(|row| self.physical_wrench(&unit(row))));
        (to, self.distortion_from(metric))
    }

    /// By how much the map from the coordinates of the metric to the scaled ones stretches at most.
    fn distortion_from<const D: usize>(&self, metric: &Metric<D>) -> f64 {
        let from = metric.inverse_columns().map(|column| self.scaled_wrench(&column).norm_squared());
        from.sum::<f64>().sqrt()
    }

    /// The physical wrench about the torque origin.
    fn physical_wrench<const D: usize>(&self, scaled: &Wrench<D>) -> Wrench<D> {
        let (force, torque) = split(scaled);
        with_torque(&force, &(torque * self.size() + self.shift.cross(&force)))
    }

    /// The inverse of [`Self::physical_wrench`].
    fn scaled_wrench<const D: usize>(&self, wrench: &Wrench<D>) -> Wrench<D> {
        let (force, torque) = split(wrench);
        with_torque(&force, &((torque - self.shift.cross(&force)) / self.size()))
    }

    /// The unit direction that measures the scaled grasp's wrenches as `functional` measures physical ones: the inverse of
    /// [`Self::physical`].
    fn unit_of_functional<const D: usize>(&self, functional: &Wrench<D>) -> Wrench<D> {
        unit(&self.scaled_functional(functional))
    }

    /// `S^-T y`: what the functional `y` on physical wrenches is on those of the scaled grasp.
    fn scaled_functional<const D: usize>(&self, functional: &Wrench<D>) -> Wrench<D> {
        let (a, b) = split(functional);
        with_torque(&(a + b.cross(&self.shift)), &(b * self.size()))
    }

    /// The direction that measures physical wrenches as `z` measures the scaled grasp's.
    fn physical<const D: usize>(&self, z: &Wrench<D>) -> Wrench<D> {
        let (a, b) = split(z);
        let b = b / self.size();
        with_torque(&(a - b.cross(&self.shift)), &b)
    }
}
