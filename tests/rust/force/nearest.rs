//! The nearest forces: no direction proves that others come nearer, and `solve` gives the same where it succeeds.

use graspforce::{
    Contact, Criterion, DistributionOptions, ForceDistributor, Grasp, Metric, NearestOptions, SquaresOptions,
    Wrench, WrenchSet,
};
use nalgebra::{SMatrix, Vector3};
use support::friction_cone::slip;
use support::least_squares::least_squares;
use support::problems::{Random, ellipsoid_grasp};

fn grasp(random: &mut Random, count: usize, kind: usize) -> Grasp<6> {
    ellipsoid_grasp(random, count, |random, i, contact| match if kind == 4 { i % 4 } else { kind } {
        0 => contact.cone(),
        1 => contact.cone().torsion(random.within(0.05, 0.3)),
        2 => contact.edges(8),
        _ => contact.friction(0.0).cone(),
    })
}

fn metric(random: &mut Random) -> SMatrix<f64, 6, 6> {
    let root = SMatrix::<f64, 6, 6>::from_fn(|r, c| random.within(-0.3, 0.3) + f64::from(u8::from(r == c)));
    root.transpose() * root
}

fn distributors(grasp: &Grasp<6>) -> Vec<ForceDistributor<6>> {
    let mut weighted = DistributionOptions::default();
    weighted.weight = 0.1;
    weighted.rtol = 1e-6;
    let loose = |criterion| {
        let mut options = DistributionOptions::default();
        options.rtol = 1e-6;
        ForceDistributor::with_options(grasp, criterion, options).unwrap()
    };
    vec![
        loose(Criterion::Max),
        loose(Criterion::Sum),
        ForceDistributor::with_options(grasp, Criterion::Max, weighted).unwrap(),
        ForceDistributor::squares(grasp, SquaresOptions::default()).unwrap(),
    ]
}

#[test]
fn no_direction_proves_that_other_forces_come_nearer() {
    let mut random = Random::new(51);
    let (mut apart, mut fell_back, mut unproven) = (0, 0, 0);
    for turn in 0..200 {
        let grasp = grasp(&mut random, 2 + turn % 5, turn % 5);
        let set = WrenchSet::new(&grasp, Criterion::Max);
        let matrix = metric(&mut random);
        let m = Metric::from_matrix(&matrix).unwrap();
        for limits in [true, false] {
            let options = NearestOptions { metric: Some(m), limits };
            let external = Wrench::<6>::from_fn(|_, _| random.within(-2.0, 2.0));
            for (which, distributor) in distributors(&grasp).into_iter().enumerate() {
                let found = distributor.nearest(&mut distributor.workspace(), &external, &options);
                let Ok(found) = found else {
                    // Without limits the nearest wrench may need forces without end.
                    assert!(!limits, "{turn} {which}: {found:?}");
                    unproven += 1;
                    continue;
                };
                let size = m.norm(&external);
                assert!((m.norm(&found.residual) - found.distance).abs() <= 1e-9 * size);
                for ((contact, force), share) in grasp.contacts().iter().zip(&found.forces).zip(&found.shares)
                {
                    assert!(
                        slip(contact, false, force) <= 1e-8 * (1.0 + force.norm()),
                        "{contact:?} {force}"
                    );
                    assert!(!limits || *share <= 1.0 + 1.1e-6, "{share}");
                }
                // b . z - p(z) for z = -M s bounds the distance from below.
                let z = -(matrix * found.residual);
                let at_limit = |i: usize| {
                    m.norm(&grasp.maps()[i].column(0).into_owned()) * grasp.contacts()[i].max_normal_force
                };
                let strongest_needed = size / (0..grasp.num_contacts()).map(at_limit).fold(0.0, f64::max);
                let reach = |i| {
                    let value = set.contact_support(i, &z).value.max(0.0);
                    let most = found.shares.iter().copied().fold(strongest_needed, f64::max);
                    value * if limits { 1.0 } else { 10.0 * most }
                };
                let reach: f64 = (0..grasp.num_contacts()).map(reach).sum();
                let allowed = 2e-6;
                let lower = if found.distance > 1e-8 * size {
                    (-external.dot(&z) - reach) / found.distance
                } else {
                    found.distance
                };
                assert!(
                    found.distance - lower <= allowed * size,
                    "{turn} {limits} {which}: {} {lower} gap {:e} {}",
                    found.distance,
                    found.gap,
                    found.fell_back
                );
                apart += usize::from(found.distance > 1e-6 * size);
                fell_back += usize::from(found.gap >= 1.0);
            }
        }
    }
    println!("{apart} unbalanced, {fell_back} not told the least, {unproven} unproven");
    assert!(apart > 500 && fell_back * 4 < apart && unproven * 100 < apart, "{apart} {fell_back} {unproven}");
}

#[test]
fn the_distance_is_that_of_an_interior_point_solver() {
    let mut random = Random::new(52);
    let mut compared = 0;
    for turn in 0..150 {
        let grasp = grasp(&mut random, 2 + turn % 5, turn % 5);
        let external = Wrench::<6>::from_fn(|_, _| random.within(-3.0, 3.0));
        let distributor = ForceDistributor::new(&grasp, Criterion::Max).unwrap();
        let found =
            distributor.nearest(&mut distributor.workspace(), &external, &NearestOptions::default()).unwrap();
        // Weights of nearly nothing beside a price of one.
        let options = SquaresOptions { limits: true, weights: vec![1e-9], ..SquaresOptions::default() };
        let Ok((_, objective)) = least_squares(&grasp, &options, Some(1.0), &external) else { continue };
        // The weights leave something of the objective where the distance is zero.
        let theirs = (2.0 * objective).sqrt();
        assert!(
            found.distance <= theirs + 1e-6 && theirs <= found.distance + 1e-3,
            "{} {}",
            found.distance,
            (2.0 * objective).sqrt()
        );
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn the_nearest_forces_are_those_of_solve_where_it_succeeds() {
    let mut random = Random::new(53);
    let mut same = 0;
    for turn in 0..60 {
        let grasp = grasp(&mut random, 4 + turn % 3, [0, 2][turn % 2]);
        for distributor in distributors(&grasp) {
            let mut workspace = distributor.workspace();
            let external = Wrench::<6>::from_fn(|_, _| random.within(-0.3, 0.3));
            let nearest = distributor.nearest(&mut workspace, &external, &NearestOptions::default()).unwrap();
            let Ok(solved) = distributor.solve(&mut workspace, &external) else { continue };
            if solved.sigma_max > 1.0 {
                continue;
            }
            let size = solved.forces.iter().map(graspforce::ContactForce::norm).fold(0.0, f64::max);
            for (a, b) in nearest.forces.iter().zip(&solved.forces) {
                assert!((a - b).norm() <= 1e-3 * size, "{a} {b}");
            }
            assert!((nearest.sigma - solved.sigma).abs() <= 1e-6 * solved.sigma);
            assert!(nearest.distance <= 1e-8 * external.norm());
            same += 1;
        }
    }
    assert!(same > 60, "{same}");
}

#[test]
fn the_least_sum_within_limits_keeps_them() {
    let mut random = Random::new(54);
    let mut limited = 0;
    for turn in 0..200 {
        let grasp = grasp(&mut random, 4 + turn % 3, [0, 2][turn % 2]);
        let mut options = DistributionOptions::default();
        options.rtol = 1e-7;
        let distributor = ForceDistributor::with_options(&grasp, Criterion::Sum, options).unwrap();
        let external = Wrench::<6>::from_fn(|_, _| random.within(-0.8, 0.8));
        let Ok(unlimited) = distributor.solve(&mut distributor.workspace(), &external) else { continue };
        let found =
            distributor.nearest(&mut distributor.workspace(), &external, &NearestOptions::default()).unwrap();
        if unlimited.sigma_max <= 1.0 || found.distance > 1e-8 * external.norm() {
            continue;
        }
        assert!(found.sigma_max <= 1.0 + 2e-9 && found.sigma_sum >= unlimited.sigma_sum * (1.0 - 1e-7));
        assert!(found.gap <= 1e-6, "{turn} {:e} {}", found.gap, found.fell_back);
        limited += 1;
    }
    assert!(limited > 5, "{limited}");
}

#[test]
fn a_grasp_that_can_do_nothing_stays_where_it_is() {
    let contact = Contact::new(Vector3::new(1.0, 0.0, 0.0), Vector3::new(-1.0, 0.0, 0.0)).friction(0.0);
    let grasp = Grasp::<6>::new(&[contact]).unwrap();
    for distributor in distributors(&grasp) {
        let external = Wrench::<6>::new(-1.0, 0.5, 0.0, 0.0, 0.0, 0.1);
        let mut workspace = distributor.workspace();
        let found = distributor.nearest(&mut workspace, &external, &NearestOptions::default()).unwrap();
        assert!(found.forces[0].norm() < 1e-12 && (found.distance - external.norm()).abs() < 1e-12);
        let mut rows = [1.0; 3];
        let options = NearestOptions::default();
        let distance = distributor.nearest_into(&mut workspace, &-external, &options, &mut rows).unwrap();
        assert!((rows[0] - 1.0).abs() < 1e-9 && (distance - 0.26_f64.sqrt()).abs() < 1e-9, "{rows:?}");
    }
}

/// Limits and friction spread over a factor of 100, over cones and pyramids.
fn spread_grasp(random: &mut Random, count: usize, kind: usize) -> Grasp<6> {
    let contacts: Vec<Contact> = (0..count)
        .map(|_| {
            let u = random.direction();
            let contact = Contact::new(u, -u + 0.3 * random.direction())
                .friction(random.within(0.05, 1.0))
                .max_normal_force(10.0_f64.powf(random.within(-1.0, 1.0)));
            if kind == 0 { contact.cone() } else { contact.edges(6 + kind) }
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

#[test]
fn beyond_the_limits_the_gap_is_proven_and_wrenches_on_the_boundary_are_their_own_nearest() {
    let mut random = Random::new(57);
    let options = NearestOptions::default();
    for turn in 0..150 {
        let grasp = spread_grasp(&mut random, 2 + turn % 5, turn % 4);
        let squares = SquaresOptions { limits: true, ..SquaresOptions::default() };
        let distributor = match turn % 3 {
            0 => ForceDistributor::new(&grasp, Criterion::Max).unwrap(),
            1 => ForceDistributor::new(&grasp, Criterion::Sum).unwrap(),
            _ => ForceDistributor::squares(&grasp, squares).unwrap(),
        };
        let mut workspace = distributor.workspace();
        for _ in 0..4 {
            let size = 10.0_f64.powf(random.within(-2.0, 2.0));
            let external = Wrench::<6>::from_fn(|_, _| random.within(-size, size));
            let far = distributor.nearest(&mut workspace, &external, &options).unwrap();
            assert!(far.gap <= 1e-9, "{turn}: gap {:e}", far.gap);
            // Asked without a past, and with one.
            let touching = external - far.residual;
            for known in [&mut distributor.workspace(), &mut workspace] {
                let found = distributor.nearest(known, &touching, &options).unwrap();
                assert!(found.gap <= 1e-9, "{turn}: gap {:e} on the boundary", found.gap);
                assert!(found.distance <= 2e-7 * touching.norm(), "{turn}: {:e}", found.distance);
            }
        }
    }
}
