//! Brackets of the least friction.

use graspforce::{Closure, Contact, Criterion, ForceDistributor, FrictionOptions, Grasp, Wrench};
use support::problems::{Random, ellipsoid_contacts};

fn grasp(contacts: &[Contact], friction: f64) -> Grasp<6> {
    let contacts: Vec<_> = contacts.iter().map(|contact| contact.clone().friction(friction)).collect();
    Grasp::new(&contacts).unwrap()
}

fn contacts(random: &mut Random) -> Vec<Contact> {
    let count = 3 + (3.0 * random.uniform()) as usize;
    let edges = 4 + (9.0 * random.uniform()) as usize;
    ellipsoid_contacts(random, count).into_iter().map(|contact| contact.edges(edges)).collect()
}

#[test]
fn a_grasp_closes_above_the_least_friction_and_not_below() {
    let mut random = Random::new(41);
    let (mut bracketed, mut never) = (0, 0);
    for case in 0..150 {
        let contacts = contacts(&mut random);
        // Few grasps of a friction of 0.3 close, most of one of 3.
        let max_friction = if case % 3 == 0 { 0.3 } else { 3.0 };
        let options = FrictionOptions { max_friction, ..FrictionOptions::default() };
        let least = grasp(&contacts, 0.5).least_friction(&options).unwrap();
        let closure = |friction: f64| grasp(&contacts, friction).quality(Criterion::Max).unwrap().closure;
        if least.upper.is_infinite() {
            never += 1;
            assert_eq!(least.lower, max_friction);
            assert_ne!(closure(max_friction), Closure::Force);
            continue;
        }
        assert!(least.upper - least.lower <= 1e-6 * least.upper, "{least:?}");
        assert_eq!(closure(least.upper), Closure::Force, "{least:?}");
        if least.lower > 0.0 {
            bracketed += 1;
            assert_ne!(closure(least.lower), Closure::Force, "{least:?}");
            // Monotone: no coefficient on either side says otherwise.
            assert_eq!(closure(least.upper * (1.0 + 2.0 * random.uniform())), Closure::Force);
            assert_ne!(closure(least.lower * random.uniform()), Closure::Force);
        }
    }
    assert!(bracketed > 50 && never > 5, "{bracketed} {never}");
}

#[test]
fn limited_forces_hold_a_wrench_above_the_least_friction_and_not_below() {
    let mut random = Random::new(42);
    let mut bracketed = 0;
    for case in 0..60 {
        let contacts = contacts(&mut random);
        let criterion = if case % 2 == 0 { Criterion::Max } else { Criterion::Sum };
        let wrench = Wrench::from_fn(|_, _| random.within(-0.2, 0.2));
        let options = FrictionOptions {
            external_wrench: Some(wrench),
            criterion,
            max_friction: 3.0,
            ..FrictionOptions::default()
        };
        let least = grasp(&contacts, 0.5).least_friction(&options).unwrap();
        let sigma = |friction: f64| {
            let distributor = ForceDistributor::new(&grasp(&contacts, friction), criterion).unwrap();
            distributor
                .solve(&mut distributor.workspace(), &wrench)
                .map_or(f64::INFINITY, |found| found.sigma)
        };
        if least.upper.is_finite() {
            assert!(sigma(least.upper) <= 1.0 + 1e-8, "{least:?}");
        }
        if least.lower > 0.0 {
            bracketed += usize::from(least.upper.is_finite());
            assert!(sigma(least.lower) > 1.0, "{least:?}");
        }
    }
    assert!(bracketed > 10, "{bracketed}");
}
