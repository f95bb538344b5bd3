//! Symmetric grasps: their weakest directions are a circle, a sphere or many points, and their brackets still close.

use std::f64::consts::TAU;

use graspforce::{Contact, Criterion, Grasp, GraspOptions, Quality, QualityOptions, QualityWorkspace};
use nalgebra::{Rotation3, Vector3};

const BOTH: [Criterion; 2] = [Criterion::Max, Criterion::Sum];

fn with_scale(contacts: &[Contact], length_scale: f64) -> Grasp<6> {
    Grasp::with_options(contacts, GraspOptions { length_scale, ..GraspOptions::default() }).unwrap()
}

fn pinch(change: impl Fn(Contact) -> Contact) -> Vec<Contact> {
    [1.0, -1.0]
        .map(|side| Contact::new(Vector3::x() * (0.04 * side), Vector3::x() * -side))
        .map(|c| change(c.torsion(0.02)))
        .to_vec()
}

fn ring(count: usize, change: impl Fn(Contact) -> Contact) -> Vec<Contact> {
    let outward = |k| {
        let angle = TAU * k as f64 / count as f64;
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    };
    (0..count).map(|k| change(Contact::new(outward(k) * 0.04, -outward(k)))).collect()
}

fn width(quality: &Quality<6>) -> f64 {
    (quality.upper - quality.lower) / -quality.upper
}

#[test]
fn the_bracket_of_a_soft_pinch_holds_its_exact_quality() {
    // By reduction to two unknowns: `benches/trust/symmetric_cones.py`.
    let grasp = with_scale(&pinch(|c| c.cone().max_normal_force(40.0)), 1.0);
    for (criterion, exact) in BOTH.into_iter().zip([1.597_446_127_66, 0.799_201_198_00]) {
        let quality = grasp.quality(criterion).unwrap();
        assert!(-quality.upper <= exact + 1e-9 && exact - 1e-9 <= -quality.lower, "{quality:?}");
        assert!(width(&quality) < 1e-3, "{quality:?}");
    }
}

#[test]
fn a_pinch_is_as_strong_whichever_way_it_points() {
    let turn = Rotation3::from_euler_angles(0.4, -1.1, 2.3);
    let turned: Vec<_> = pinch(Contact::cone)
        .into_iter()
        .map(|c| Contact { position: turn * c.position, normal: turn * c.normal, ..c })
        .collect();
    for criterion in BOTH {
        let [plain, other] = [&pinch(Contact::cone), &turned]
            .map(|contacts| with_scale(contacts, 0.2).quality(criterion).unwrap());
        assert!(width(&plain) < 1e-5 && width(&other) < 1e-5, "{plain:?} {other:?}");
        assert!((plain.rho / other.rho - 1.0).abs() < 2e-5, "{plain:?} {other:?}");
    }
}

#[test]
fn brackets_of_rings_and_of_many_edges_close() {
    for count in 3..9 {
        for criterion in BOTH {
            for (torsion, scale) in [(0.0, 0.02), (0.005, 0.02), (0.005, 1.0)] {
                let grasp = with_scale(&ring(count, |c| c.cone().friction(0.9).torsion(torsion)), scale);
                let quality = grasp.quality(criterion).unwrap();
                assert!(width(&quality) < 1e-3, "{count} {torsion} {scale}: {quality:?}");
            }
        }
    }
    for edges in [32, 48, 128] {
        for criterion in BOTH {
            let quality = with_scale(&pinch(|c| c.edges(edges)), 1.0).quality(criterion).unwrap();
            assert!(width(&quality) < 1e-3, "{edges}: {quality:?}");
        }
    }
}

#[test]
fn what_is_nearly_symmetric_is_bracketed_with_its_deviation() {
    // The pinch is of least friction 0.5; every change takes away from it or adds to it by less than its size.
    for size in [1e-12, 1e-9, 1e-7] {
        let changed: Vec<_> = pinch(Contact::cone)
            .into_iter()
            .enumerate()
            .map(|(i, c)| Contact {
                position: c.position + Vector3::new(0.3, -0.7, 0.5 - i as f64) * size,
                normal: c.normal + Vector3::new(0.1, 0.6 * i as f64, -0.8) * size,
                ..c
            })
            .collect();
        for (criterion, exact) in BOTH.into_iter().zip([1.597_446_127_66 / 40.0, 0.799_201_198_00 / 40.0]) {
            let quality = with_scale(&changed, 1.0).quality(criterion).unwrap();
            let slack = 1e-10 + 4.0 * size;
            assert!(-quality.upper <= exact + slack && exact - slack <= -quality.lower, "{quality:?}");
            assert!(width(&quality) < 1e-3, "{size:e}: {quality:?}");
        }
    }
}

#[test]
fn a_weight_or_a_metric_that_breaks_the_symmetry_is_not_overlooked() {
    // Along the line of the contacts a weight keeps the rotations; across it only the mirror images.
    for center in [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0], [2e-4, 3e-4, -5e-4]] {
        let center = graspforce::Wrench::<6>::from_iterator(center.into_iter().chain([0.0; 3]));
        for criterion in BOTH {
            let options = QualityOptions { external_wrench: Some(center), ..QualityOptions::new(criterion) };
            let grasp = with_scale(&pinch(Contact::cone), 1.0);
            let quality = grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap();
            // A weight takes from the plain quality no more than its norm. It gives nothing: the images of a weakest
            // direction add up to zero, so one of them leans against the weight.
            let plain = grasp.quality(criterion).unwrap();
            assert!(-quality.upper <= -plain.lower + 1e-12, "{quality:?}");
            assert!(-quality.lower >= -plain.upper - center.norm(), "{quality:?}");
        }
    }
}

#[test]
fn more_facets_narrow_a_bracket_and_never_contradict_it() {
    // No two contacts are alike: no symmetry helps, and many directions are nearly as weak.
    let directions = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let contacts: Vec<_> = directions
        .iter()
        .enumerate()
        .map(|(i, &d)| {
            let d = Vector3::from(d).normalize();
            Contact::new(d * 0.05, -d).cone().torsion(0.02).friction(0.5 + 1e-3 * i as f64)
        })
        .collect();
    let grasp = with_scale(&contacts, 0.1);
    let ask = |facets| {
        let options = QualityOptions { max_facets: Some(facets), ..QualityOptions::new(Criterion::Max) };
        grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap()
    };
    let (few, many) = (ask(2_000), ask(60_000));
    assert!(!few.converged && few.facets < 4_000, "{few:?}");
    assert!(many.lower <= few.upper && few.lower <= many.upper, "{few:?} {many:?}");
    assert!(width(&many) < 0.5 * width(&few), "{few:?} {many:?}");
    for facets in [0, 99, usize::MAX] {
        let options = QualityOptions { max_facets: Some(facets), ..QualityOptions::new(Criterion::Max) };
        let error = grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap_err();
        assert!(error.to_string().contains("max_facets"), "{error}");
    }
}

#[test]
fn the_gradient_at_a_circle_of_minimisers_is_not_unique() {
    let grasp = with_scale(&pinch(Contact::cone), 1.0);
    let gradient = grasp.gradient(&QualityOptions::new(Criterion::Max), &mut QualityWorkspace::default());
    assert!(!gradient.unwrap().unique);
}

#[test]
fn symmetries_about_another_point_than_the_torque_origin_narrow_the_bracket_and_do_not_move_it() {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let outward = corners.map(|corner| Vector3::from(corner).normalize());
    let origin = Vector3::new(-0.02, 0.01, -0.03);
    let axis = Vector3::z() * 0.01;
    for (contacts, weight) in [
        (outward.map(|o| Contact::new(o * 0.04, -o)).to_vec(), None),
        (ring(5, |c| c), None),
        // A weight in the centre of the ring, along its axis, leaves the rotations.
        (ring(5, |c| c), Some((axis, (-origin).cross(&axis)))),
    ] {
        // Frictions that differ share no symmetry.
        let grasp = |apart: f64| {
            let soft = contacts.iter().enumerate().map(|(k, contact)| {
                contact.clone().friction(0.5 * (1.0 + apart * k as f64)).torsion(0.02).cone()
            });
            let options = GraspOptions { origin, ..GraspOptions::default() };
            Grasp::<6>::with_options(&soft.collect::<Vec<_>>(), options).unwrap()
        };
        for criterion in BOTH {
            let options = QualityOptions {
                external_wrench: weight
                    .map(|(f, t)| [f.x, f.y, f.z, t.x, t.y, t.z].into())
                    .filter(|_| criterion == Criterion::Max),
                max_facets: Some(60_000),
                ..QualityOptions::new(criterion)
            };
            let [alike, stronger] = [0.0, 5e-3]
                .map(|apart| grasp(apart).quality_with(&options, &mut QualityWorkspace::default()).unwrap());
            assert!(width(&alike) < 1e-2 && 3.0 * width(&alike) < width(&stronger), "{alike:?} {stronger:?}");
            // More friction is never worse, and better by its factor at most.
            assert!(alike.epsilon_lower() <= stronger.epsilon_upper(), "{alike:?} {stronger:?}");
            let most = alike.epsilon_upper() * (1.0 + 10.0 * 5e-3);
            assert!(stronger.epsilon_lower() <= most, "{alike:?} {stronger:?}");
        }
    }
}
