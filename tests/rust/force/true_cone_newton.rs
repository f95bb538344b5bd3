//! True cones by Newton's method: precise, and the same answer whatever was solved before.

use graspforce::{Contact, Criterion, Distribution, DistributionOptions, Error, Grasp, Wrench, WrenchSet};
use nalgebra::Vector3;
use support::control_loop::ControlLoop;
use support::friction_cone::load;
use support::problems::Random;
use support::tile::{OPTIMUM, tile, wrench};

/// Every kind of objective, with its weight of the sum.
const OBJECTIVES: [(Criterion, f64); 3] =
    [(Criterion::Max, 0.0), (Criterion::Sum, 0.0), (Criterion::Max, 0.3)];

/// What Newton's method leaves of the gap.
const PRECISE: f64 = 1e-11;

fn distributor(grasp: &Grasp<6>, (criterion, weight): (Criterion, f64)) -> ControlLoop<6> {
    let mut options = DistributionOptions::default();
    options.weight = weight;
    ControlLoop::with_options(grasp, criterion, options).unwrap()
}

/// Hard or soft fingers on an ellipsoid, of different friction and strength.
fn fingers(random: &mut Random, count: usize, torsion: f64) -> Grasp<6> {
    let contacts: Vec<Contact> = (0..count)
        .map(|_| {
            let p = random.direction();
            let position = Vector3::new(p.x, 0.8 * p.y, 1.3 * p.z);
            Contact::new(position, -Vector3::new(p.x, p.y / 0.8, p.z / 1.3))
                .friction(random.within(0.2, 1.0))
                .torsion(torsion)
                .max_normal_force(random.within(0.5, 3.0))
                .cone()
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

fn anywhere(random: &mut Random) -> Wrench<6> {
    Wrench::<6>::from_fn(|_, _| random.within(-1.0, 1.0))
}

/// Balance, cones and gap, computed anew from the forces and the multiplier.
fn assert_optimal(grasp: &Grasp<6>, external: &Wrench<6>, found: &Distribution<6>, weight: f64, gap: f64) {
    let resultant: Wrench<6> = found.contact_wrenches(grasp).iter().sum();
    let size = external.amax().max(found.sigma_sum);
    assert!((resultant + external).amax() <= 1e-11 * size, "{:e}", (resultant + external).amax() / size);
    for (contact, f) in grasp.contacts().iter().zip(&found.forces) {
        let limit = found.sigma_max * contact.max_normal_force;
        assert!(load(contact, false, f) <= f[0] + 1e-10 * limit, "{f}");
    }
    assert!(found.gap <= gap, "{:e}", found.gap);
    if weight == 0.0 {
        let criterion = if found.sigma == found.sigma_max { Criterion::Max } else { Criterion::Sum };
        let bound = -external.dot(&found.dual) / WrenchSet::new(grasp, criterion).value(&found.dual);
        assert!((1.0 - bound / found.sigma).abs() <= gap.max(1e-10), "{bound} {}", found.sigma);
    }
}

#[test]
fn random_wrenches_and_paths_from_them_are_solved_to_eleven_digits() {
    let mut random = Random::new(11);
    let (mut jumps, mut steps) = (0, 0);
    for case in 0..240 {
        let grasp = fingers(&mut random, 3 + case % 5, [0.0, 0.1][case % 2]);
        let objective = OBJECTIVES[case % 3];
        let distributor = distributor(&grasp, objective);
        for _ in 0..4 {
            let (from, along) = (anywhere(&mut random), anywhere(&mut random));
            for step in 0..8 {
                let external = from + along * (1e-3 * f64::from(step));
                match distributor.solve(&external) {
                    Ok(found) => {
                        assert_optimal(&grasp, &external, &found, objective.1, PRECISE);
                        jumps += usize::from(step == 0);
                        steps += usize::from(step > 0 && found.pivots == 0);
                    }
                    Err(Error::InfeasibleWrench { .. }) => {}
                    Err(error) => panic!("{error}"),
                }
            }
        }
    }
    assert!(jumps > 400 && steps * 10 > jumps * 7 * 9, "{jumps} jumps, {steps} steps");
}

#[test]
fn forces_depend_on_the_wrench_alone() {
    let mut random = Random::new(12);
    for case in 0..120 {
        let torsion = [0.0, 0.1][case % 2];
        let grasp = if case % 3 == 0 {
            feet(3 + case % 4, torsion)
        } else {
            fingers(&mut random, 3 + case % 5, torsion)
        };
        let pick = |random: &mut Random| {
            if case % 3 == 0 { weight_within_the_feet(random) } else { anywhere(random) }
        };
        for objective in OBJECTIVES {
            let external = pick(&mut random);
            let Ok(expected) = distributor(&grasp, objective).solve(&external) else { continue };
            let largest = expected.forces.iter().map(graspforce::ContactForce::amax).fold(0.0, f64::max);
            for past in 0..3 {
                let distributor = distributor(&grasp, objective);
                let other = pick(&mut random);
                let shares: &[f64] = [&[1.0][..], &[0.5, 0.02, 1e-4], &[1e-7]][past];
                for share in shares {
                    let _ = distributor.solve(&(external + (other - external) * *share));
                }
                let found = distributor.solve(&external).unwrap();
                let far = found.forces.iter().zip(&expected.forces).map(|(a, b)| (a - b).amax());
                let far = far.fold(0.0, f64::max) / largest;
                assert!(far <= 1e-9, "{case} {objective:?} after {past}: {far:e}");
                assert_eq!(found.unique, expected.unique, "{case} {objective:?} after {past}");
            }
        }
    }
}

/// Feet at corners of a hexagon; fewer than six leave some out.
fn feet(count: usize, torsion: f64) -> Grasp<6> {
    let contacts: Vec<Contact> = (0..count)
        .map(|k| {
            let (s, c) = (std::f64::consts::TAU * (k as f64 + 0.1 * (k % 2) as f64) / count as f64).sin_cos();
            Contact::new(Vector3::new(c, s, 0.0), Vector3::z()).friction(0.6).torsion(torsion).cone()
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

fn weight_within_the_feet(random: &mut Random) -> Wrench<6> {
    let (x, y) = (random.within(-0.25, 0.25), random.within(-0.25, 0.25));
    -Wrench::<6>::new(random.within(-0.2, 0.2), random.within(-0.2, 0.2), 1.0, y, -x, 0.0)
}

#[test]
fn feet_that_need_no_friction_share_a_push_by_least_squares() {
    // Under a weight in the middle of four feet each of them pushes a quarter: with the same normal force in all of
    // them, least squares share the push equally, too.
    let contacts = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
        .map(|(x, y)| Contact::new(Vector3::new(x, y, 0.0), Vector3::z()).friction(0.6).cone());
    let grasp = Grasp::<6>::new(&contacts).unwrap();
    let external = -Wrench::<6>::new(0.2, 0.1, 1.0, 0.0, 0.0, 0.0);
    let found = distributor(&grasp, OBJECTIVES[0]).solve(&external).unwrap();
    assert!(!found.unique);
    for f in grasp.frames().iter().zip(&found.forces).map(|(frame, f)| frame * f.fixed_rows::<3>(0)) {
        assert!((f - Vector3::new(0.05, 0.025, 0.25)).amax() < 1e-12, "{f}");
    }
}

#[test]
fn two_fingers_that_press_against_each_other_press_no_more_than_the_balance_needs() {
    // The third finger carries the load at the level of the maximum. The other two could press harder against each
    // other up to that level; the least sum forbids it, and they share what is left of the load.
    let contact = |p: Vector3<f64>, n: Vector3<f64>, limit: f64| {
        Contact::new(p, n).friction(0.5).max_normal_force(limit).cone()
    };
    let contacts = [
        contact(-Vector3::x(), Vector3::x(), 10.0),
        contact(Vector3::x(), -Vector3::x(), 10.0),
        contact(-Vector3::z(), Vector3::z(), 1.0),
    ];
    let grasp = Grasp::<6>::new(&contacts).unwrap();
    let external = Wrench::<6>::new(0.0, 0.0, -0.9, 0.0, 0.0, 0.0);
    let found = distributor(&grasp, OBJECTIVES[0]).solve(&external).unwrap();
    // s + 2 * 0.5 * 10 s = 0.9
    assert!((found.sigma_max - 0.9 / 11.0).abs() < 1e-10, "{}", found.sigma_max);
}

#[test]
fn forces_along_the_tile_are_precise_and_do_not_jump() {
    let contacts = tile(OPTIMUM, 0).contacts().to_vec();
    for torsion in [0.0, 0.02] {
        let soft: Vec<_> = contacts.iter().map(|c| c.clone().torsion(torsion)).collect();
        let grasp = Grasp::<6>::new(&soft).unwrap();
        let distributor = distributor(&grasp, OBJECTIVES[0]);
        let moved = |a: &Distribution<6>, b: &Distribution<6>| {
            a.forces.iter().zip(&b.forces).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
        };
        let mut before: Option<Distribution<6>> = None;
        let (mut cold, mut steepest) = (0, (0.0, 0));
        for step in 0..10_000 {
            let external = wrench(f64::from(step) * 1e-3);
            let found = distributor.solve(&external).unwrap();
            assert_optimal(&grasp, &external, &found, 0.0, PRECISE);
            cold += usize::from(found.pivots > 0);
            let far = before.as_ref().map_or(0.0, |before| moved(&found, before));
            steepest = if far > steepest.0 { (far, step) } else { steepest };
            before = Some(found);
        }
        assert!(cold <= 100, "{cold} starts from nothing");
        // The steepest millisecond is no jump: a hundredth of it moves the forces by a small part.
        let (far, step) = steepest;
        assert!(far <= 0.5, "{step}: {far} N");
        let at = |k: i32| {
            distributor.solve(&wrench((f64::from(step) - 1.0 + 0.01 * f64::from(k)) * 1e-3)).unwrap()
        };
        for k in 0..100 {
            let part = moved(&at(k), &at(k + 1));
            assert!(part <= 0.1 * far, "{step} {k}: {part} of {far} N");
        }
    }
}
