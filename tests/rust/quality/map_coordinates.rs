//! Grasps far from the coordinates' origin, where a position is known to a rounding that is not small beside the grasp.

use graspforce::{Closure, Contact, Criterion, Grasp, GraspOptions};
use nalgebra::Vector3;
use support::random::Random;

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// Two fingers that face each other along x, with the friction at which the line between them leaves their cones, times
/// one plus `off`.
struct Facing {
    /// From the first contact to the second, exactly.
    apart: Vector3<f64>,
    friction: f64,
    soft: bool,
}

impl Facing {
    fn contacts(&self, first: Vector3<f64>, second: Vector3<f64>) -> [Contact; 2] {
        [(first, 1.0), (second, -1.0)].map(|(position, normal)| {
            let contact = Contact::new(position, Vector3::new(normal, 0.0, 0.0)).friction(self.friction);
            if self.soft { contact.torsion(0.3).cone() } else { contact }
        })
    }

    /// The classes by closure alone and by both criteria: all the same.
    fn class(&self, first: Vector3<f64>, second: Vector3<f64>, origin: Vector3<f64>) -> Closure {
        let contacts = self.contacts(first, second);
        let options = GraspOptions { origin, ..GraspOptions::default() };
        if self.soft {
            return class(&Grasp::<6>::with_options(&contacts, options).unwrap());
        }
        class(&Grasp::<3>::with_options(&contacts, options).unwrap())
    }
}

fn class<const D: usize>(grasp: &Grasp<D>) -> Closure {
    let closure = grasp.closure().unwrap();
    for criterion in BOTH {
        let found = grasp.quality(criterion).unwrap();
        assert_eq!(found.closure, closure, "{criterion:?} {found:?}");
    }
    closure
}

/// Whether the friction decides by the positions as given, and what is left of it beside theirs, exactly: Shewchuk's
/// product without rounding.
fn beyond(friction: f64, apart: &Vector3<f64>) -> f64 {
    let across = apart.y.hypot(apart.z);
    let product = friction * apart.x;
    friction.mul_add(apart.x, -product) + (product - across)
}

#[test]
fn no_class_is_given_that_the_rounding_of_positions_decides() {
    let mut random = Random(23);
    let (mut definite, mut open) = (0, 0);
    for case in 0..400 {
        let soft = case % 4 == 3;
        let size = 10.0_f64.powf(9.0 * random.next());
        let mut first = Vector3::new(size, size * (2.0 * random.next() - 1.0), 0.0);
        first.z = if soft { size * random.next() } else { 0.0 };
        let apart = Vector3::new(1.0, random.next(), if soft { random.next() } else { 0.0 });
        let second = first + apart;
        // Exact: both are near to each other.
        let apart = second - first;
        let off = 10.0_f64.powf(-1.0 - 14.0 * random.next()) * if random.next() < 0.5 { 1.0 } else { -1.0 };
        let friction = apart.y.hypot(apart.z) / apart.x * (1.0 + off);
        let facing = Facing { apart, friction, soft };
        let origin = if case % 2 == 0 { first } else { Vector3::zeros() };
        let found = facing.class(first, second, origin);
        // The same grasp at the origin, and every grasp that the rounding of a position makes of it.
        let zero = Vector3::zeros();
        let here = facing.class(zero, facing.apart, zero);
        let shown = |moved: &Vector3<f64>| {
            format!("case {case}: {found:?} at {size:e}, {here:?} at the origin, off {off:e} {moved:?}")
        };
        if found == Closure::Partial {
            open += 1;
            // Smooth cones that all but touch hold balls that no polytope of few vertices resolves.
            let least = if soft { 1e-9 } else { 0.0 } + 200.0 * f64::EPSILON * (size + 1.0);
            assert!(off.abs() * apart.y.hypot(apart.z) < least, "{}", shown(&zero));
            continue;
        }
        definite += 1;
        assert_eq!(found, here, "{}", shown(&zero));
        let force = found == Closure::Force;
        for corner in 0..8 {
            let rounded = |axis: usize| {
                let by = 0.5 * f64::EPSILON * (first[axis].abs() + second[axis].abs());
                if corner >> axis & 1 == 0 { by } else { -by }
            };
            let moved = apart + Vector3::new(rounded(0), rounded(1), if soft { rounded(2) } else { 0.0 });
            let left = beyond(friction, &moved);
            assert!(if force { left > 0.0 } else { left < 0.0 }, "{} {left:e}", shown(&moved));
        }
    }
    assert!(definite > 100 && open > 50, "{definite} {open}");
}

#[test]
fn the_same_rounding_decides_on_both_sides_of_the_boundary() {
    let first = Vector3::new(1e8, 1e8, 0.0);
    let apart = Vector3::new(1.0, 0.5, 0.0);
    let at = |friction| Facing { apart, friction, soft: false }.class(first, first + apart, first);
    for off in [1e-10, 1e-9, 1e-8] {
        assert_eq!((at(0.5 - off), at(0.5 + off)), (Closure::Partial, Closure::Partial), "{off:e}");
    }
    assert_eq!((at(0.5 - 1e-5), at(0.5 + 1e-5)), (Closure::None, Closure::Force));
}

#[test]
fn a_tangent_near_the_normal_decides_no_class_by_its_rounding() {
    for lean in [1e-3, 1e-6, 1e-8] {
        for off in [-1e-3, -1e-10, 1e-10, 1e-3] {
            let side = |x: f64, y: f64| {
                Contact::new(Vector3::new(x, y, 0.0), Vector3::new(-x, 0.0, 0.0))
                    .friction(0.5 * (1.0 + off))
                    .torsion(0.3)
                    .edges(4)
                    .tangent(Vector3::new(x, lean, 0.0))
            };
            let found = class(&Grasp::<6>::new(&[side(-1.0, -0.5), side(1.0, 0.5)]).unwrap());
            let expected = if off > 0.0 { Closure::Force } else { Closure::None };
            // A rounding of the tangent turns the edges by a unit over the lean.
            if off.abs() > 1e-4 {
                assert_eq!(found, expected, "{lean:e} {off:e}");
            } else if lean < 1e-7 {
                assert_eq!(found, Closure::Partial, "{lean:e} {off:e}");
            }
        }
    }
}

#[test]
fn many_contacts_are_measured_by_the_box_that_holds_them() {
    let mut random = Random(3);
    let contacts: Vec<_> =
        (0..20_000).map(|_| random.direction()).map(|r| Contact::new(r * 0.05, -r).friction(0.0)).collect();
    let hint = |length_scale| {
        let options = GraspOptions { length_scale, ..GraspOptions::default() };
        Grasp::<6>::with_options(&contacts, options).unwrap().length_scale_hint()
    };
    assert!(hint(0.1).is_none() && hint(0.99).is_none());
    assert!(hint(1.8).is_some());
}
