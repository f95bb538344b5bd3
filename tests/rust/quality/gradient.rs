//! The gradient of epsilon against central differences.

use graspforce::{Closure, Contact, Criterion, ForceModel, Grasp, Metric, QualityOptions, QualityWorkspace};
use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3, Vector4};
use support::problems::Random;

const STEP: f64 = 1e-5;

/// How far supports at a worst direction may stay beyond the bracket by rounding.
const ROUNDED: f64 = 1e-12;

fn epsilon<const D: usize>(contacts: &[Contact], options: &QualityOptions<D>) -> f64 {
    let grasp = Grasp::<D>::new(contacts).unwrap();
    if contacts.iter().all(|contact| contact.forces == ForceModel::Cone) {
        // The bracket closes slowly around a smooth minimum; the support at the worst direction is as exact as rounding.
        let (quality, _, bundle) =
            grasp.quality_and_bundle(options, 1, &mut QualityWorkspace::default()).unwrap();
        let (value, rounded) = (bundle[0].value, ROUNDED * bundle[0].value.abs());
        assert!(value >= quality.epsilon_lower() - rounded, "{value:e} {quality:?}");
        assert!(value <= quality.epsilon_upper() + rounded, "{value:e} {quality:?}");
        if quality.rho < 0.0 {
            return value;
        }
    }
    let options = QualityOptions { rtol: Some(1e-12), ..*options };
    -grasp.quality_with(&options, &mut QualityWorkspace::default()).unwrap().rho
}

/// The contacts with contact `i` displaced.
fn displaced(contacts: &[Contact], i: usize, by: Vector3<f64>) -> Vec<Contact> {
    let mut moved = contacts.to_vec();
    moved[i].position += by;
    moved
}

/// The contacts with the frame of contact `i` turned by the smallest rotation that moves its normal by `by`.
fn turned(contacts: &[Contact], frames: &[Matrix3<f64>], i: usize, by: Vector3<f64>) -> Vec<Contact> {
    let mut moved = contacts.to_vec();
    let n: Vector3<f64> = frames[i].column(0).into();
    let rotation = Rotation3::new(n.cross(&by));
    moved[i].normal = rotation * n;
    moved[i].tangent = Some(rotation * frames[i].column(1));
    moved
}

fn agrees<const D: usize>(contacts: &[Contact], options: &QualityOptions<D>) -> Option<f64> {
    let grasp = Grasp::<D>::new(contacts).unwrap();
    let gradient = grasp.gradient(options, &mut QualityWorkspace::default()).unwrap();
    if !gradient.unique {
        return None;
    }
    let (mut error, mut size) = (0.0_f64, 0.0_f64);
    for i in 0..contacts.len() {
        let axes = if D == 3 { 2 } else { 3 };
        for axis in 0..axes {
            let by = Vector3::from_fn(|row, _| if row == axis { STEP } else { 0.0 });
            let difference = epsilon(&displaced(contacts, i, by), options)
                - epsilon(&displaced(contacts, i, -by), options);
            error = error.max((difference / (2.0 * STEP) - gradient.positions[i][axis]).abs());
            size = size.max(gradient.positions[i].amax());
        }
        let frame = &grasp.frames()[i];
        let tangents: &[usize] = if D == 3 { &[2] } else { &[1, 2] };
        for &tangent in tangents {
            let by: Vector3<f64> = frame.column(tangent) * STEP;
            let plus = epsilon(&turned(contacts, grasp.frames(), i, by), options);
            let minus = epsilon(&turned(contacts, grasp.frames(), i, -by), options);
            let along = gradient.normals[i].dot(&frame.column(tangent));
            error = error.max(((plus - minus) / (2.0 * STEP) - along).abs());
            size = size.max(gradient.normals[i].amax());
        }
        assert!(gradient.normals[i].dot(&frame.column(0)).abs() < 1e-9 * size.max(1.0));
        let slope = |change: fn(&mut Contact, f64)| {
            let changed = |by| {
                let mut contacts = contacts.to_vec();
                change(&mut contacts[i], by);
                epsilon(&contacts, options)
            };
            (changed(STEP) - changed(-STEP)) / (2.0 * STEP)
        };
        let by_friction = slope(|contact, by| contact.friction += by);
        let by_limit = slope(|contact, by| contact.max_normal_force += by);
        error = error.max((by_friction - gradient.friction[i]).abs());
        error = error.max((by_limit - gradient.max_normal_force[i]).abs());
    }
    Some(error / size)
}

fn check<const D: usize>(
    mut problem: impl FnMut(&mut Random) -> (Vec<Contact>, QualityOptions<D>),
    tolerance: f64,
) {
    let mut random = Random::new(11);
    let mut errors = Vec::new();
    let mut asked = 0;
    while errors.len() < 40 {
        let (contacts, options) = problem(&mut random);
        errors.extend(agrees(&contacts, &options));
        asked += 1;
        // Random grasps are differentiable: a flag that is never raised would leave nothing to compare.
        assert!(asked <= 60, "of {asked} gradients only {} claim to be unique", errors.len());
    }
    errors.sort_by(f64::total_cmp);
    println!("largest relative errors {:?}", &errors[35..]);
    // A kink within a step of the point is no fault of the gradient; it is rare.
    assert!(errors[38] < tolerance, "{errors:?}");
}

#[test]
fn spatial_gradients_are_central_differences() {
    for criterion in [Criterion::Max, Criterion::Sum] {
        let problem = |random: &mut Random| {
            let contacts = support::problems::ellipsoid_contacts(random, 5);
            let limited = contacts.into_iter().map(|c| c.edges(7).max_normal_force(random.within(0.5, 2.0)));
            (limited.collect(), QualityOptions::new(criterion))
        };
        check::<6>(problem, 1e-6);
    }
}

#[test]
fn gradients_follow_soft_fingers_metrics_and_centers() {
    let problem = |random: &mut Random| {
        let contacts = support::problems::ellipsoid_contacts(random, 4)
            .into_iter()
            .map(|c| c.edges(6).torsion(0.3))
            .collect();
        let root = SMatrix::<f64, 6, 6>::from_fn(|_, _| random.within(-0.3, 0.3)) + SMatrix::identity();
        let metric = Metric::from_matrix(&(root * root.transpose())).unwrap();
        let center = SMatrix::<f64, 6, 1>::from_fn(|_, _| random.within(-0.05, 0.05));
        let options = QualityOptions {
            metric: Some(metric),
            external_wrench: Some(center),
            ..QualityOptions::new(Criterion::Max)
        };
        (contacts, options)
    };
    check::<6>(problem, 1e-6);
}

#[test]
fn planar_gradients_are_central_differences() {
    for criterion in [Criterion::Max, Criterion::Sum] {
        let problem = |random: &mut Random| {
            let contact = |_| {
                let (s, c) = random.within(0.0, 6.3).sin_cos();
                Contact::new(Vector3::new(1.3 * c, s, 0.0), -Vector3::new(c / 1.3, s, 0.0)).friction(0.3)
            };
            ((0..4).map(contact).collect(), QualityOptions::new(criterion))
        };
        check::<3>(problem, 1e-6);
    }
}

#[test]
fn gradients_of_true_cones_are_central_differences_to_their_tolerance() {
    for criterion in [Criterion::Max, Criterion::Sum] {
        let problem = |random: &mut Random| {
            let contacts =
                support::problems::ellipsoid_contacts(random, 4).into_iter().map(Contact::cone).collect();
            (contacts, QualityOptions::new(criterion))
        };
        check::<6>(problem, 1e-4);
    }
}

#[test]
fn gradients_of_closed_grasps_with_true_cones_are_central_differences() {
    for (criterion, torsion) in [(Criterion::Max, 0.0), (Criterion::Sum, 0.0), (Criterion::Max, 0.3)] {
        let problem = |random: &mut Random| loop {
            let contacts = support::problems::ellipsoid_contacts(random, 4).into_iter();
            let limited =
                contacts.map(|c| c.cone().torsion(torsion).max_normal_force(random.within(0.5, 2.0)));
            let contacts: Vec<_> = limited.collect();
            if Grasp::<6>::new(&contacts).unwrap().closure().unwrap() == Closure::Force {
                // The worst direction is exact whatever the bracket, which is most of the time.
                return (contacts, QualityOptions { rtol: Some(1e-4), ..QualityOptions::new(criterion) });
            }
        };
        check::<6>(problem, 1e-6);
    }
}

#[test]
fn the_first_friction_of_a_smooth_contact_has_its_one_sided_derivative() {
    for (cone, torsion) in [(false, 0.0), (true, 0.0), (false, 0.2)] {
        for criterion in [Criterion::Max, Criterion::Sum] {
            let mut random = Random::new(5);
            let mut contacts = support::problems::ellipsoid_contacts(&mut random, 7);
            for contact in &mut contacts {
                *contact = contact.clone().edges(6).friction(0.8).torsion(torsion);
            }
            contacts[0] = if cone { contacts[0].clone().cone() } else { contacts[0].clone() }.friction(0.0);
            let options = QualityOptions::new(criterion);
            let grasp = Grasp::<6>::new(&contacts).unwrap();
            let gradient = grasp.gradient(&options, &mut QualityWorkspace::default()).unwrap();
            let before = epsilon(&contacts, &options);
            contacts[0].friction = 1e-6;
            let difference = (epsilon(&contacts, &options) - before) / 1e-6;
            let error = (difference - gradient.friction[0]).abs();
            assert!(error < 1e-4, "{criterion:?}, {cone}, {torsion}: {difference} {}", gradient.friction[0]);
        }
    }
}

#[test]
fn given_extreme_forces_depend_neither_on_friction_nor_on_limits() {
    let mut random = Random::new(5);
    let contacts: Vec<_> = support::problems::ellipsoid_contacts(&mut random, 5)
        .into_iter()
        .map(|contact| {
            let forces = [(1.0, 0.0), (-1.0, 0.5), (-1.0, -0.5)].map(|(o, t)| Vector4::new(2.0, o, t, 0.0));
            Contact { forces: ForceModel::Extreme(forces.to_vec()), ..contact }
        })
        .collect();
    let options = QualityOptions::new(Criterion::Max);
    let gradient =
        Grasp::<6>::new(&contacts).unwrap().gradient(&options, &mut QualityWorkspace::default()).unwrap();
    assert!(gradient.friction.iter().chain(&gradient.max_normal_force).all(|by| *by == 0.0));
}

#[test]
fn a_gradient_leaves_the_quality_as_it_is() {
    let mut random = Random::new(13);
    for count in [2, 4, 6] {
        for _ in 0..20 {
            let contacts = support::problems::ellipsoid_contacts(&mut random, count);
            let grasp = Grasp::<6>::new(&contacts).unwrap();
            for criterion in [Criterion::Max, Criterion::Sum] {
                let options = QualityOptions::new(criterion);
                let mut workspace = QualityWorkspace::default();
                let (quality, gradient) = grasp.quality_and_gradient(&options, &mut workspace).unwrap();
                assert_eq!(quality, grasp.quality_with(&options, &mut workspace).unwrap());
                assert_eq!(gradient, grasp.gradient(&options, &mut workspace).unwrap());
            }
        }
    }
}

#[test]
fn symmetric_grasps_are_flagged() {
    let corners = [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)];
    let contacts = corners.map(|(x, y, z)| {
        let corner = Vector3::new(x, y, z).normalize();
        Contact::new(corner, -corner).friction(0.5)
    });
    let options = QualityOptions::new(Criterion::Sum);
    let gradient =
        Grasp::<6>::new(&contacts).unwrap().gradient(&options, &mut QualityWorkspace::default()).unwrap();
    assert!(!gradient.unique);
}

#[test]
fn gradients_by_the_sum_about_a_center_are_central_differences() {
    // Three fingers under a plate, and its weight: the worst direction may be one along which they exert nothing.
    let problem = |random: &mut Random| {
        let finger = |i: u32| {
            let (s, c) = (2.1 * f64::from(i)).sin_cos();
            let offset = Vector3::from_fn(|_, _| random.within(-0.1, 0.1));
            let tilt = Vector3::from_fn(|_, _| random.within(-0.1, 0.1));
            Contact::new(Vector3::new(c, s, 0.0) + offset, Vector3::z() + tilt)
                .friction(0.5)
                .max_normal_force(9.0 + f64::from(i))
                .edges(11)
        };
        let contacts: Vec<_> = (0..3).map(finger).collect();
        let weight = random.within(3.0, 8.0);
        let torque: [f64; 3] = std::array::from_fn(|_| random.within(-0.3, 0.3));
        let center = [0.1, 0.2, -weight, torque[0], torque[1], torque[2]];
        let options = QualityOptions {
            external_wrench: Some(SMatrix::from_row_slice(&center)),
            ..QualityOptions::new(Criterion::Sum)
        };
        (contacts, options)
    };
    check::<6>(problem, 1e-6);
}

#[test]
fn outside_closure_the_gradient_is_that_of_the_distance() {
    let problem = |random: &mut Random| loop {
        let contacts = support::problems::ellipsoid_contacts(random, 3);
        let open = Grasp::<6>::new(&contacts).unwrap().quality(Criterion::Max).unwrap().rho > 0.02;
        if open {
            return (contacts, QualityOptions::new(Criterion::Max));
        }
    };
    check::<6>(problem, 1e-5);
}

#[test]
fn a_center_of_zero_changes_nothing_on_a_closed_grasp() {
    let corners = [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)];
    let mut grasps = support::problems::closed_grasps(3, 10, 5, 8);
    for friction in [0.3, 0.5, 0.8] {
        let contacts = corners.map(|(x, y, z)| {
            let corner = Vector3::new(x, y, z).normalize();
            Contact::new(corner, -corner).friction(friction)
        });
        grasps.push(Grasp::new(&contacts).unwrap());
    }
    for grasp in &grasps {
        for criterion in [Criterion::Max, Criterion::Sum] {
            let plain = QualityOptions::new(criterion);
            let zero = QualityOptions { external_wrench: Some(SMatrix::zeros()), ..plain };
            let ask = |options| grasp.gradient(options, &mut QualityWorkspace::default()).unwrap();
            let (plain, zero) = (ask(&plain), ask(&zero));
            assert_eq!(plain.unique, zero.unique, "{criterion:?}");
            if plain.unique {
                for (a, b) in plain.positions.iter().zip(&zero.positions) {
                    assert!((a - b).norm() < 1e-9, "{criterion:?}: {a} {b}");
                }
            }
        }
    }
}
