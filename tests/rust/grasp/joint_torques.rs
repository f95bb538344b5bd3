//! Extreme forces from joint torque limits.

use graspforce::{Contact, ContactForce, Error, torque_limited_forces};
use nalgebra::Vector3;
use proptest::prelude::*;

use support::friction_cone::slip;
use support::reference_cases::seeded;

proptest! {
    #![proptest_config(seeded(200))]

    #[test]
    fn vertices_are_allowed_and_random_allowed_forces_are_within_their_reach(
        jacobian in prop::collection::vec(prop::array::uniform3(-0.2..0.2_f64), 1..5),
        limit in 0.05..2.0_f64,
        directions in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 20),
    ) {
        let jacobian: Vec<_> = jacobian.into_iter().map(Vector3::from).collect();
        let (lower, upper) = (vec![-limit; jacobian.len()], vec![0.7 * limit; jacobian.len()]);
        let (mu, most, edges) = (0.5, 10.0, 6);
        let vertices = torque_limited_forces(&jacobian, &lower, &upper, mu, most, edges).unwrap();
        let finger = Contact::new(Vector3::x(), -Vector3::x()).friction(mu).edges(edges);
        let force = |f: &ContactForce| Vector3::new(f[0], f[1], f[2]);
        let allowed = |f: &Vector3<f64>, slack: f64| {
            f.x <= most + slack
                && slip(&finger, false, &ContactForce::new(f.x, f.y, f.z, 0.0)) <= slack
                && jacobian.iter().all(|j| (-limit - slack..=0.7 * limit + slack).contains(&j.dot(f)))
        };
        prop_assert!(vertices.iter().all(|f| allowed(&force(f), 1e-7)));
        for direction in directions.into_iter().map(Vector3::from) {
            // Shrink a random force until it is allowed.
            let mut f = Vector3::new(direction.x.abs() * most, 0.4 * mu * direction.y * most * direction.x.abs(), 0.4 * mu * direction.z * most * direction.x.abs());
            while !allowed(&f, 0.0) {
                f *= 0.9;
            }
            for z in [direction, -direction, f] {
                let reach = vertices.iter().map(|v| force(v).dot(&z)).fold(0.0, f64::max);
                prop_assert!(f.dot(&z) <= reach + 1e-9);
            }
        }
    }
}

#[test]
fn vertices_do_not_depend_on_a_limit_that_torques_never_reach() {
    let jacobian = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.02, 0.0, 0.1]].map(Vector3::from);
    let vertices = |most: f64, size: f64| {
        torque_limited_forces(&jacobian, &[-size; 3], &[size; 3], 0.5, most, 8).unwrap()
    };
    for size in [0.5, 1e-9, 1e6] {
        let expected = vertices(20.0 * size, size);
        for most in [1e3, 1e6, 1e9, 1e10, 1e12] {
            let found = vertices(most * size, size);
            assert_eq!(found.len(), expected.len(), "limit {most:e} times {size:e}");
            for f in &found {
                assert!(expected.iter().any(|g| (f - g).amax() <= 1e-9 * size), "{f}");
                let torques = jacobian.iter().map(|j| j.dot(&f.fixed_rows::<3>(0)).abs());
                assert!(torques.fold(0.0, f64::max) <= size * (1.0 + 1e-9));
                assert!(slip(&Contact::new(Vector3::x(), -Vector3::x()), false, f) <= 1e-9 * size);
            }
        }
    }
}

#[test]
fn many_edges_and_joints_take_no_more_than_a_moment() {
    let jacobian: Vec<_> =
        (0..6_u8).map(|i| Vector3::new(1.0, f64::from(i).sin(), f64::from(i).cos()) * 0.1).collect();
    // The fastest of several: what else the machine does is not what is asked.
    let seconds = (0..5).map(|_| {
        let started = std::time::Instant::now();
        let forces = torque_limited_forces(&jacobian, &[-0.5; 6], &[0.5; 6], 0.5, 100.0, 256).unwrap();
        assert!(forces.len() > 6);
        started.elapsed().as_secs_f64()
    });
    let fastest = seconds.fold(f64::INFINITY, f64::min);
    // All triples of bounds would take seconds.
    assert!(fastest < 1.0, "{fastest} s");
}

#[test]
fn each_option_is_refused_by_its_own_name() {
    let solve = |mu, most, edges| torque_limited_forces(&[Vector3::x()], &[-1.0], &[1.0], mu, most, edges);
    for (argument, refused) in [
        ("friction", solve(0.0, 1.0, 8)),
        ("max_normal_force", solve(0.5, f64::INFINITY, 8)),
        ("edges", solve(0.5, 1.0, 2)),
        ("jacobian", torque_limited_forces(&[Vector3::repeat(f64::NAN)], &[-1.0], &[1.0], 0.5, 1.0, 8)),
        ("jacobian", torque_limited_forces(&[Vector3::repeat(1e200)], &[-1.0], &[1.0], 0.5, 1.0, 8)),
        ("torque_limits", torque_limited_forces(&[Vector3::x()], &[1.0], &[-1.0], 0.5, 1.0, 8)),
        ("torque_limits", torque_limited_forces(&[Vector3::x()], &[-1.0], &[], 0.5, 1.0, 8)),
    ] {
        assert!(
            matches!(&refused, Err(Error::InvalidInput { argument: named, .. }) if *named == argument),
            "{refused:?}"
        );
    }
}
