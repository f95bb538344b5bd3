//! Laws of quality on ten thousand random grasps.

use graspforce::{
    Closure, Contact, Criterion, Grasp, GraspOptions, Metric, Quality, QualityOptions, QualityWorkspace,
    Wrench,
};
use nalgebra::{Rotation3, SMatrix};
use rayon::prelude::*;
use support::problems::Random;
use support::reference_cases::plate;

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// 3 to 8 contacts with 3 to 16 edges, friction 0 to 1.5, limits 0.1 to 10 N, on an ellipsoid of 1e-3 to 1e3 m.
fn random_contacts(random: &mut Random) -> (Vec<Contact>, f64) {
    let count = 3 + (6.0 * random.uniform()) as usize;
    let edges = 3 + (14.0 * random.uniform()) as usize;
    let friction = random.within(0.0, 1.5);
    let scale = 10_f64.powf(random.within(-3.0, 3.0));
    let contacts = support::problems::ellipsoid_contacts(random, count);
    let contacts = contacts.into_iter().map(|mut contact| {
        contact.position *= scale;
        contact.edges(edges).friction(friction).max_normal_force(10_f64.powf(random.within(-1.0, 1.0)))
    });
    (contacts.collect(), scale)
}

fn quality(contacts: &[Contact], length_scale: f64, criterion: Criterion) -> Quality<6> {
    let options = GraspOptions { length_scale, ..Default::default() };
    Grasp::<6>::with_options(contacts, options).unwrap().quality(criterion).unwrap()
}

/// The same contacts in a turned world: positions, normals and tangents.
fn turned(contacts: &[Contact], rotation: &Rotation3<f64>) -> Vec<Contact> {
    let grasp = Grasp::<6>::new(contacts).unwrap();
    let turn = |(contact, frame): (&Contact, &nalgebra::Matrix3<f64>)| {
        let mut contact = contact.clone();
        contact.position = rotation * contact.position;
        contact.normal = rotation * contact.normal;
        contact.tangent = Some(rotation * frame.column(1));
        contact
    };
    contacts.iter().zip(grasp.frames()).map(turn).collect()
}

/// Longest primitive wrench by the length scale: what rounding is relative to.
fn size(contacts: &[Contact], scale: f64) -> f64 {
    contacts.iter().map(|c| c.max_normal_force * (1.0 + c.position.norm() / scale) * (1.0 + c.friction)).sum()
}

#[test]
fn ten_thousand_grasps_are_bracketed_and_follow_the_laws() {
    let wide: Vec<String> = (0..10_000_u64)
        .into_par_iter()
        .filter_map(|seed| {
            let mut random = Random::new(seed + 1);
            let (contacts, scale) = random_contacts(&mut random);
            let rotation = Rotation3::new(random.direction() * random.within(0.0, 3.0));
            let factor = 10_f64.powf(random.within(-3.0, 3.0));
            let mut open = None;
            let mut rhos = [0.0; 2];
            for (criterion, rho) in BOTH.into_iter().zip(&mut rhos) {
                let found = quality(&contacts, scale, criterion);
                let near = 3e-9 * found.rho.abs() + 1e-12 * size(&contacts, scale);
                assert!(found.lower <= found.rho && found.rho <= found.upper, "{seed}: {found:?}");
                if found.closure == Closure::Force && !found.converged {
                    open = Some(format!("{seed} {criterion:?} {found:?}"));
                }
                let rotated = quality(&turned(&contacts, &rotation), scale, criterion);
                assert!((rotated.rho - found.rho).abs() <= near, "{seed}: {} {}", rotated.rho, found.rho);
                assert_eq!(rotated.closure, found.closure, "{seed}");
                let stronger: Vec<_> = contacts
                    .iter()
                    .map(|c| c.clone().max_normal_force(factor * c.max_normal_force))
                    .collect();
                let scaled = quality(&stronger, scale, criterion);
                assert!((scaled.rho - factor * found.rho).abs() <= factor * near, "{seed}");
                *rho = found.rho;
            }
            if rhos[0] > 0.0 || rhos[1] > 0.0 {
                let near = 3e-9 * rhos[0].abs() + 1e-12 * size(&contacts, scale);
                assert!((rhos[1] - rhos[0]).abs() <= near, "outside, both criteria agree: {seed} {rhos:?}");
            }
            assert!(rhos[1] <= rhos[0] + 1e-12 * size(&contacts, scale), "{seed}: {rhos:?}");
            open
        })
        .collect();
    assert!(wide.is_empty(), "{wide:#?}");
}

#[test]
fn order_and_added_contacts() {
    (0..500_u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(seed + 77_777);
        let (contacts, scale) = random_contacts(&mut random);
        let reversed: Vec<_> = contacts.iter().rev().cloned().collect();
        let fewer = &contacts[..contacts.len() - 1];
        let rougher: Vec<_> = contacts.iter().map(|c| c.clone().friction(1.2 * c.friction)).collect();
        let slack = 1e-11 * size(&contacts, scale);
        for criterion in BOTH {
            let rho = quality(&contacts, scale, criterion).rho;
            assert!((quality(&reversed, scale, criterion).rho - rho).abs() <= slack + 3e-9 * rho.abs());
            assert!(rho <= quality(fewer, scale, criterion).rho + slack + 3e-9 * rho.abs());
            assert!(quality(&rougher, scale, criterion).rho <= rho + slack + 3e-9 * rho.abs());
        }
    });
}

#[test]
fn twins_in_millimetres_and_uneven_limits_are_classified_alike() {
    (0..2_000_u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(seed + 123_456);
        let (contacts, scale) = random_contacts(&mut random);
        let unit: Vec<_> = contacts
            .iter()
            .map(|c| {
                let mut contact = c.clone().max_normal_force(1.0);
                contact.position /= scale;
                contact
            })
            .collect();
        let closure = Grasp::<6>::new(&unit).unwrap().closure().unwrap();
        let twin: Vec<_> = unit
            .iter()
            .map(|c| {
                let mut contact = c.clone().max_normal_force(10_f64.powf(random.within(-3.0, 3.0)));
                contact.position *= 1e-3;
                contact
            })
            .collect();
        for criterion in BOTH {
            let found = quality(&twin, 1.0, criterion);
            assert_eq!(found.closure, closure, "{seed}: {found:?}");
            assert!(found.lower <= found.rho && found.rho <= found.upper, "{seed}: {found:?}");
            assert_eq!(found.rho < 0.0, closure == Closure::Force, "{seed}: {found:?}");
        }
    });
}

#[test]
fn a_metric_is_a_change_of_coordinates() {
    let mut random = Random::new(5);
    for grasp in support::problems::closed_grasps(31, 40, 4, 8) {
        let length = 10_f64.powf(random.within(-1.0, 1.0));
        let weights = Wrench::<6>::from_fn(|row, _| if row < 3 { 1.0 } else { length.powi(-2) });
        let root = SMatrix::<f64, 6, 6>::from_fn(|_, _| random.within(-0.4, 0.4)) + SMatrix::identity();
        let matrix = root.transpose() * root;
        for criterion in BOTH {
            let ask = |grasp: &Grasp<6>, metric| {
                let options = QualityOptions { metric, ..QualityOptions::new(criterion) };
                grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap()
            };
            // The length scale is the simplest metric.
            let scaled = GraspOptions { length_scale: length, ..Default::default() };
            let scaled = Grasp::<6>::with_options(grasp.contacts(), scaled).unwrap();
            let by_metric =
                ask(&grasp, Some(Metric::from_matrix(&SMatrix::from_diagonal(&weights)).unwrap()));
            let by_length = scaled.quality(criterion).unwrap();
            assert!((by_metric.rho / by_length.rho - 1.0).abs() < 2e-9);
            // A general one: the nearest boundary wrench has norm epsilon, and is on the boundary.
            let metric = Metric::from_matrix(&matrix).unwrap();
            let found = ask(&grasp, Some(metric));
            assert!((metric.norm(&found.direction) - 1.0).abs() < 1e-9);
            assert!((metric.norm(&found.wrench) + found.rho).abs() < 1e-9 * -found.rho);
            assert!(
                ((found.wrench.dot(&(matrix * found.wrench))).sqrt() + found.rho).abs() < 1e-8 * -found.rho
            );
        }
    }
}

#[test]
fn a_plate_on_three_fingers_resists_what_its_weight_allows() {
    // No closure, but with the weight a disturbance can be resisted.
    let plate = plate();
    let weight = Wrench::<6>::from_row_slice(&[0.0, 0.0, -9.0, 0.0, 0.0, 0.0]);
    let ask = |center| {
        let options = QualityOptions { external_wrench: center, ..QualityOptions::new(Criterion::Max) };
        plate.quality_with(&options, &mut QualityWorkspace::default()).unwrap()
    };
    assert!(ask(None).rho > 0.0);
    let resting = ask(Some(weight));
    assert!(resting.rho < 0.0 && resting.converged, "{resting:?}");
    assert_eq!(resting.closure, Closure::None);
    // A weight that the fingers cannot carry, and one that pulls the plate off.
    assert!(ask(Some(weight * 4.0)).rho > 0.0);
    assert!(ask(Some(-weight)).rho > 0.0);
    // Without any weight the origin is a corner of the set.
    assert_eq!(ask(Some(Wrench::zeros())).rho, 0.0);
}

/// Every point of the union, or of the Minkowski sum with its `prod(l_i + 1)` points, one after another.
fn slow_support(grasp: &Grasp<6>, criterion: Criterion, z: &Wrench<6>) -> f64 {
    match criterion {
        Criterion::Sum => {
            let wrenches = grasp.primitive_wrenches().unwrap();
            wrenches.iter().map(|w| w.dot(z)).fold(f64::NEG_INFINITY, f64::max)
        }
        Criterion::Max => {
            let sum = graspforce::MinkowskiSum::new(grasp).unwrap();
            sum.wrenches().iter().map(|w| w.dot(z)).fold(f64::NEG_INFINITY, f64::max)
        }
    }
}

#[test]
fn no_direction_among_the_enumerated_points_is_thinner_than_the_bracket_says() {
    (0..100_u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(seed + 4_242);
        let contacts = support::problems::ellipsoid_contacts(&mut random, 4);
        let contacts: Vec<_> = contacts.into_iter().map(|contact| contact.edges(5)).collect();
        let grasp = Grasp::<6>::new(&contacts).unwrap();
        for criterion in BOTH {
            let found = grasp.quality(criterion).unwrap();
            let reach = slow_support(&grasp, criterion, &found.direction);
            // The upper bound on epsilon is what the enumerated points reach along the worst direction ...
            assert!((reach + found.rho).abs() <= 1e-9, "{seed} {criterion:?}: {reach} {found:?}");
            // ... and along no other direction, near it or far, do they reach less than the lower bound.
            for k in 0..60 {
                let away = Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0));
                let z = (found.direction + away * 10_f64.powi(-(k % 6))).normalize();
                let reach = slow_support(&grasp, criterion, &z);
                assert!(reach >= -found.upper - 1e-9, "{seed} {criterion:?}: {reach} {found:?}");
            }
        }
    });
}
