//! Extreme forces from joint torque limits.

use graspforce::{ContactForce, torque_limited_forces};
use nalgebra::Vector3;
use proptest::prelude::*;

mod force_cases;

use force_cases::seeded;

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
        let force = |f: &ContactForce| Vector3::new(f[0], f[1], f[2]);
        let allowed = |f: &Vector3<f64>, slack: f64| {
            f.x <= most + slack
                && f.y.hypot(f.z) <= mu * f.x + slack
                && jacobian.iter().all(|j| (-limit - slack..=0.7 * limit + slack).contains(&j.dot(f)))
        };
        prop_assert!(vertices.iter().all(|f| allowed(&force(f), 1e-7)));
        for direction in directions.into_iter().map(Vector3::from) {
            // Shrink a random force until it is allowed, also by the linearised cone.
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
