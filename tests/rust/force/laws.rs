//! Laws of force distribution on random grasps, and agreement with an interior-point solver.

use graspforce::{Contact, Criterion, DistributionOptions, Error, Grasp, Method, Wrench, WrenchSet};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use support::control_loop::ControlLoop;
use support::interior_point::interior_point;
use support::reference_cases::{assert_sound, close, seeded, value};

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

/// Contacts that press inwards on an ellipsoid, with random friction, limits and edges.
fn contacts(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Contact>> {
    let contact = (prop::array::uniform3(-1.0..1.0_f64), 0.2..1.0_f64, -1.0..1.0_f64, 3..9_usize);
    prop::collection::vec(contact, count).prop_map(|rows| {
        let contact = |(p, mu, exponent, edges): ([f64; 3], f64, f64, usize)| {
            let direction = (Vector3::from(p) + Vector3::new(1e-3, 2e-3, 3e-3)).normalize();
            let position = direction.component_mul(&Vector3::new(1.0, 0.7, 0.5));
            let normal = -direction.component_div(&Vector3::new(1.0, 0.7, 0.5));
            Contact::new(position, normal).friction(mu).max_normal_force(10_f64.powf(exponent)).edges(edges)
        };
        rows.into_iter().map(contact).collect()
    })
}

/// A wrench that the grasp can certainly balance: the opposite of some of its own.
fn balanced(grasp: &Grasp<6>, shares: &[f64]) -> Wrench<6> {
    let wrenches = grasp.primitive_wrenches().unwrap();
    -wrenches.iter().zip(shares.iter().cycle()).map(|(w, share)| w * *share).sum::<Wrench<6>>()
}

fn shares() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(prop_oneof![Just(0.0), 0.0..1.0_f64], 7..23)
}

fn sigma(contacts: &[Contact], criterion: Criterion, external: &Wrench<6>) -> f64 {
    let grasp = Grasp::<6>::new(contacts).unwrap();
    let answer = ControlLoop::new(&grasp, criterion).unwrap().solve(external).unwrap();
    value(criterion, &answer)
}

proptest! {
    #![proptest_config(seeded(200))]

    #[test]
    fn forces_balance_stay_in_their_cones_and_close_the_duality_gap(c in contacts(1..8), s in shares()) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &s);
        for criterion in BOTH {
            let answer = ControlLoop::new(&grasp, criterion).unwrap().solve(&external).unwrap();
            assert_sound(&grasp, &external, &answer);
            if external.amax() > 0.0 {
                // The bound, once more, from the oracle alone.
                let reach = WrenchSet::new(&grasp, criterion).value(&answer.dual);
                prop_assert!(close(-external.dot(&answer.dual) / reach, answer.sigma, 1e-9));
            }
        }
    }

    #[test]
    fn the_interior_point_solver_agrees(c in contacts(3..7), s in shares()) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &s);
        for criterion in BOTH {
            let Some(expected) = interior_point(&grasp, criterion, &[], &external) else { continue };
            let computed = sigma(&c, criterion, &external);
            prop_assert!((expected - computed).abs() < 1e-6 * (1.0 + expected), "{} {}", expected, computed);
        }
    }

    #[test]
    fn both_methods_agree(c in contacts(1..4), s in shares(), infeasible in prop::array::uniform6(-1.0..1.0_f64)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let mut options = DistributionOptions::default();
        options.method = Method::Enumerated;
        for criterion in BOTH {
            let implicit = ControlLoop::new(&grasp, criterion).unwrap();
            let enumerated = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
            let external = balanced(&grasp, &s);
            let (a, b) = (implicit.solve(&external).unwrap(), enumerated.solve(&external).unwrap());
            prop_assert!(close(a.sigma, b.sigma, 1e-9), "{} {}", a.sigma, b.sigma);
            if criterion == Criterion::Max {
                prop_assert!(close(a.sigma_sum, b.sigma_sum, 1e-8), "{} {}", a.sigma_sum, b.sigma_sum);
            }
            let wild = Wrench::<6>::from(infeasible);
            prop_assert_eq!(implicit.solve(&wild).is_ok(), enumerated.solve(&wild).is_ok());
        }
    }

    #[test]
    fn the_least_forces_scale_with_the_wrench(c in contacts(1..6), s in shares(), exponent in -200..200_i32) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &s);
        let factor = 2_f64.powi(exponent);
        for criterion in BOTH {
            let distributor = ControlLoop::new(&grasp, criterion).unwrap();
            let (once, scaled) = (distributor.solve(&external).unwrap(), distributor.solve(&(external * factor)).unwrap());
            prop_assert!(close(once.sigma * factor, scaled.sigma, 1e-10));
        }
    }

    #[test]
    fn the_order_of_contacts_does_not_matter(c in contacts(2..7), s in shares(), turn in 1..6_usize) {
        let external = balanced(&Grasp::<6>::new(&c).unwrap(), &s);
        let mut turned = c.clone();
        turned.rotate_left(turn % c.len());
        for criterion in BOTH {
            prop_assert!(close(sigma(&c, criterion, &external), sigma(&turned, criterion, &external), 1e-9));
        }
    }

    #[test]
    fn turning_the_world_does_not_matter(c in contacts(2..7), s in shares(), angles in prop::array::uniform3(-3.0..3.0_f64)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &s);
        let turn = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let turned: Vec<_> = c.iter().zip(grasp.frames()).map(|(contact, frame)| Contact {
            position: turn * contact.position,
            normal: turn * contact.normal,
            tangent: Some(turn * frame.column(1)),
            ..contact.clone()
        }).collect();
        let (force, torque) = (turn * external.fixed_rows::<3>(0), turn * external.fixed_rows::<3>(3));
        let external_turned = Wrench::<6>::from_iterator(force.iter().chain(torque.iter()).copied());
        for criterion in BOTH {
            prop_assert!(close(sigma(&c, criterion, &external), sigma(&turned, criterion, &external_turned), 1e-8));
        }
    }

    #[test]
    fn units_of_length_and_force_do_not_matter(c in contacts(4..7), s in shares(), length in -6..7_i32, force in -9..10_i32) {
        let (length, force) = (10_f64.powi(length), 10_f64.powi(force));
        let external = balanced(&Grasp::<6>::new(&c).unwrap(), &s);
        let scaled: Vec<_> = c.iter().map(|contact| Contact {
            position: contact.position * length,
            max_normal_force: contact.max_normal_force * force,
            ..contact.clone()
        }).collect();
        let mut other = external * force;
        other.fixed_rows_mut::<3>(3).scale_mut(length);
        for criterion in BOTH {
            prop_assert!(close(sigma(&c, criterion, &external), sigma(&scaled, criterion, &other), 1e-8));
        }
    }

    #[test]
    fn more_friction_and_more_contacts_never_hurt(c in contacts(2..6), extra in contacts(1..3), s in shares()) {
        let external = balanced(&Grasp::<6>::new(&c).unwrap(), &s);
        let rougher: Vec<_> = c.iter().map(|contact| contact.clone().friction(1.3 * contact.friction)).collect();
        let more: Vec<_> = c.iter().chain(&extra).cloned().collect();
        for criterion in BOTH {
            let before = sigma(&c, criterion, &external);
            prop_assert!(sigma(&rougher, criterion, &external) <= before * (1.0 + 1e-9));
            prop_assert!(sigma(&more, criterion, &external) <= before * (1.0 + 1e-9));
        }
    }

    #[test]
    fn limits_spread_over_six_orders_are_no_trouble(c in contacts(4..7), s in shares(), exponents in prop::collection::vec(-3.0..3.0_f64, 7)) {
        let spread: Vec<_> = c.iter().zip(exponents).map(|(contact, e)| contact.clone().max_normal_force(10_f64.powf(e))).collect();
        let grasp = Grasp::<6>::new(&spread).unwrap();
        let external = balanced(&grasp, &s);
        for criterion in BOTH {
            let answer = ControlLoop::new(&grasp, criterion).unwrap().solve(&external).unwrap();
            assert_sound(&grasp, &external, &answer);
        }
    }

    #[test]
    fn an_infeasible_wrench_comes_with_a_direction_that_separates(c in contacts(1..6), w in prop::array::uniform6(-1.0..1.0_f64)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = Wrench::<6>::from(w);
        for criterion in BOTH {
            match ControlLoop::new(&grasp, criterion).unwrap().solve(&external) {
                Ok(answer) => assert_sound(&grasp, &external, &answer),
                Err(Error::InfeasibleWrench { direction, .. }) => {
                    let e = Wrench::<6>::from_row_slice(&direction);
                    prop_assert!(-external.dot(&e) > 0.0);
                    for w in grasp.primitive_wrenches().unwrap() {
                        prop_assert!(w.dot(&e) <= 1e-10 * w.norm());
                    }
                }
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }

    #[test]
    fn the_weight_leads_from_the_maximum_to_the_sum(c in contacts(3..6), s in shares(), weights in (0.001..1.0_f64, 1.0..100.0_f64)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &s);
        let solve = |weight: f64| {
            let mut options = DistributionOptions::default();
            options.weight = weight;
            ControlLoop::with_options(&grasp, Criterion::Max, options).unwrap().solve(&external).unwrap()
        };
        let answers = [solve(0.0), solve(weights.0), solve(weights.1)];
        for pair in answers.windows(2) {
            prop_assert!(pair[0].sigma_max <= pair[1].sigma_max * (1.0 + 1e-8));
            prop_assert!(pair[1].sigma_sum <= pair[0].sigma_sum * (1.0 + 1e-8));
        }
        let sum = sigma(&c, Criterion::Sum, &external);
        prop_assert!(sum <= answers[2].sigma_sum * (1.0 + 1e-9));
    }
}

#[test]
fn a_wrench_that_is_not_finite_is_refused_by_name_and_value() {
    let grasp = Grasp::<6>::new(&[Contact::new(Vector3::x(), -Vector3::x())]).unwrap();
    let distributor = ControlLoop::new(&grasp, Criterion::Max).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        let mut external = Wrench::<6>::zeros();
        external[4] = bad;
        let Err(Error::InvalidInput { argument, reason, .. }) = distributor.solve(&external) else {
            panic!()
        };
        assert_eq!(argument, "external_wrench");
        assert!(reason.contains("component 4") && reason.contains(&bad.to_string()), "{reason}");
    }
    let nothing = distributor.solve(&Wrench::zeros()).unwrap();
    assert_eq!((nothing.sigma, nothing.forces[0].amax()), (0.0, 0.0));
}
