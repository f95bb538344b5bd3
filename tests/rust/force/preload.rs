//! Lower bounds on normal forces: agreement with an interior-point solver, and the laws of the answer.

use graspforce::{
    Contact, Criterion, Distribution, DistributionOptions, Error, ForceModel, Grasp, Method, Wrench,
};
use nalgebra::Vector3;
use proptest::prelude::*;
use support::control_loop::ControlLoop;
use support::friction_cone::slip;
use support::interior_point::interior_point;
use support::reference_cases::{close, seeded, value};

const BOTH: [Criterion; 2] = [Criterion::Sum, Criterion::Max];

fn contacts(count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Contact>> {
    let contact = (prop::array::uniform3(-1.0..1.0_f64), 0.3..1.0_f64, 0.5..4.0_f64, 3..9_usize);
    prop::collection::vec(contact, count).prop_map(|rows| {
        let contact = |(p, mu, limit, edges): ([f64; 3], f64, f64, usize)| {
            let direction = (Vector3::from(p) + Vector3::new(1e-3, 2e-3, 3e-3)).normalize();
            Contact::new(direction, -direction.component_div(&Vector3::new(1.0, 0.7, 0.5)))
                .friction(mu)
                .max_normal_force(limit)
                .edges(edges)
        };
        rows.into_iter().map(contact).collect()
    })
}

fn bounds() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(prop_oneof![Just(0.0), 0.0..0.5_f64], 7)
}

/// A wrench that forces above the bounds can balance.
fn balanced(grasp: &Grasp<6>, bounds: &[f64], shares: &[f64]) -> Wrench<6> {
    let wrenches = grasp.primitive_wrenches().unwrap();
    let mut total = Wrench::<6>::zeros();
    for (i, bound) in bounds.iter().enumerate().take(grasp.num_contacts()) {
        let range = grasp.edges(i).unwrap();
        total += wrenches[range.start] * *bound;
        total += range.map(|j| wrenches[j] * shares[j % shares.len()]).sum::<Wrench<6>>();
    }
    -total
}

fn distributor(grasp: &Grasp<6>, criterion: Criterion, bounds: &[f64], weight: f64) -> ControlLoop<6> {
    let mut options = DistributionOptions::default();
    options.min_normal = bounds[..grasp.num_contacts()].to_vec();
    options.weight = weight;
    ControlLoop::with_options(grasp, criterion, options).unwrap()
}

fn assert_sound(grasp: &Grasp<6>, external: &Wrench<6>, bounds: &[f64], answer: &Distribution<6>) {
    let resultant: Wrench<6> = answer.contact_wrenches(grasp).iter().sum();
    let scale = external.amax().max(answer.sigma_sum);
    assert!((resultant + external).amax() <= 1e-9 * scale, "{:e}", (resultant + external).amax());
    for ((contact, force), bound) in grasp.contacts().iter().zip(&answer.forces).zip(bounds) {
        let slip = slip(contact, false, force);
        assert!(slip <= 1e-9 * contact.max_normal_force * answer.sigma_max, "{slip:e}");
        let normal = force[0] / contact.max_normal_force;
        assert!(normal >= bound - 1e-9 * answer.sigma_max && normal <= answer.sigma_max * (1.0 + 1e-12));
    }
    assert!(answer.gap <= 1e-9, "{:e}", answer.gap);
}

proptest! {
    #![proptest_config(seeded(300))]

    #[test]
    fn the_interior_point_solver_agrees(c in contacts(2..7), low in bounds(), s in prop::collection::vec(prop_oneof![Just(0.0), 0.0..0.3_f64], 7..23)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &low, &s);
        for criterion in BOTH {
            let answer = distributor(&grasp, criterion, &low, 0.0).solve(&external).unwrap();
            if external.amax() > 0.0 {
                assert_sound(&grasp, &external, &low, &answer);
            }
            let Some(expected) = interior_point(&grasp, criterion, &low, &external) else { continue };
            let computed = value(criterion, &answer);
            prop_assert!((expected - computed).abs() < 1e-7 * (1.0 + expected), "{} {}", expected, computed);
        }
    }

    #[test]
    fn forces_do_not_depend_on_the_wrenches_before(c in contacts(3..7), low in bounds(), s in prop::collection::vec(0.0..0.3_f64, 23), t in prop::collection::vec(0.0..0.3_f64, 19)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let (first, second) = (balanced(&grasp, &low, &s), balanced(&grasp, &low, &t));
        for criterion in BOTH {
            let cold = distributor(&grasp, criterion, &low, 0.0).solve(&second).unwrap();
            let warm = distributor(&grasp, criterion, &low, 0.0);
            warm.solve(&first).unwrap();
            warm.solve(&((first + second * 4.0) / 5.0)).unwrap();
            let warm = warm.solve(&second).unwrap();
            for (a, b) in cold.forces.iter().zip(&warm.forces) {
                prop_assert!((a - b).amax() <= 1e-8 * cold.sigma_sum * 4.0, "{:e}", (a - b).amax());
            }
            prop_assert!(close(cold.sigma_sum, warm.sigma_sum, 1e-9));
        }
    }

    #[test]
    fn the_objective_changes_by_the_dual(c in contacts(5..8), low in bounds(), s in prop::collection::vec(0.0..0.3_f64, 23), axis in 0..6_usize) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &low, &s);
        for criterion in BOTH {
            let d = distributor(&grasp, criterion, &low, 0.0);
            let here = d.solve(&external).unwrap();
            let mut step = Wrench::<6>::zeros();
            step[axis] = 1e-3;
            // Convexity: the tangent at one point bounds the objective from below at any other.
            let Ok(there) = d.solve(&(external + step)) else { continue };
            let tangent = value(criterion, &here) - here.dual.dot(&step);
            prop_assert!(value(criterion, &there) >= tangent - 1e-9 * (1.0 + tangent.abs()));
        }
    }

    #[test]
    fn more_preload_never_makes_the_forces_smaller(c in contacts(3..7), low in bounds(), s in prop::collection::vec(0.0..0.3_f64, 23), weight in 0.01..1.0_f64) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &low, &s);
        let less: Vec<f64> = low.iter().map(|c| 0.5 * c).collect();
        for (criterion, weight) in [(Criterion::Sum, 0.0), (Criterion::Max, 0.0), (Criterion::Max, weight)] {
            let sigma = |low: &[f64]| distributor(&grasp, criterion, low, weight).solve(&external).unwrap();
            let (free, half, full) = (sigma(&[0.0; 7]), sigma(&less), sigma(&low));
            prop_assert!(free.sigma <= half.sigma * (1.0 + 1e-9) && half.sigma <= full.sigma * (1.0 + 1e-9));
            prop_assert!(full.gap <= 1e-9);
        }
    }

    #[test]
    fn an_infeasible_wrench_comes_with_a_direction_that_separates(c in contacts(1..6), low in bounds(), w in prop::array::uniform6(-1.0..1.0_f64)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = Wrench::<6>::from(w);
        for criterion in BOTH {
            match distributor(&grasp, criterion, &low, 0.0).solve(&external) {
                Ok(answer) => assert_sound(&grasp, &external, &low, &answer),
                Err(Error::InfeasibleWrench { direction, .. }) => {
                    let e = Wrench::<6>::from_row_slice(&direction);
                    let mut held = 0.0;
                    for (i, low) in low.iter().enumerate().take(c.len()) {
                        let range = grasp.edges(i).unwrap();
                        let along = grasp.primitive_wrenches().unwrap()[range].iter().map(|w| w.dot(&e));
                        let best = along.fold(f64::NEG_INFINITY, f64::max);
                        prop_assert!(best <= 1e-9);
                        held += low * best;
                    }
                    prop_assert!(-external.dot(&e) > held - 1e-9);
                }
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }

    #[test]
    fn true_cones_lie_below_their_edges_and_keep_the_bounds(c in contacts(3..7), low in bounds(), s in prop::collection::vec(0.0..0.3_f64, 23)) {
        let grasp = Grasp::<6>::new(&c).unwrap();
        let external = balanced(&grasp, &low, &s);
        let cones = Grasp::<6>::new(&c.iter().cloned().map(Contact::cone).collect::<Vec<_>>()).unwrap();
        for criterion in BOTH {
            let mut options = DistributionOptions::default();
            options.rtol = 1e-6;
            options.min_normal = low[..c.len()].to_vec();
            let exact = ControlLoop::with_options(&cones, criterion, options).unwrap();
            let exact = exact.solve(&external).unwrap();
            let linear = distributor(&grasp, criterion, &low, 0.0).solve(&external).unwrap();
            prop_assert!(exact.sigma <= linear.sigma * (1.0 + 2e-6));
            // Cones around the edges reach as far as the true ones, and the whole balances.
            let around: Vec<_> = c
                .iter()
                .map(|c| c.clone().edges(48).friction(c.friction / (std::f64::consts::PI / 48.0).cos()))
                .collect();
            let around = Grasp::<6>::new(&around).unwrap();
            let outer = distributor(&around, criterion, &low, 0.0).solve(&external).unwrap();
            prop_assert!(exact.sigma >= outer.sigma * (1.0 - 2e-6), "{} {}", exact.sigma, outer.sigma);
            let resultant: Wrench<6> = exact.contact_wrenches(&cones).iter().sum();
            prop_assert!((resultant + external).amax() <= 1e-8 * external.amax().max(exact.sigma_sum));
            for ((contact, f), low) in c.iter().zip(&exact.forces).zip(&low) {
                prop_assert!(f[0] >= contact.max_normal_force * (low - 1e-9));
            }
        }
    }
}

#[test]
fn fingers_that_hold_press_against_each_other_without_a_wrench() {
    let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
        Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).max_normal_force(4.0)
    });
    let grasp = Grasp::<3>::new(&fingers).unwrap();
    let mut options = DistributionOptions::default();
    options.min_normal = vec![0.25, 0.5];
    for criterion in BOTH {
        let d = ControlLoop::with_options(&grasp, criterion, options.clone()).unwrap();
        let answer = d.solve(&Wrench::<3>::zeros()).unwrap();
        assert!(close(answer.forces[0][0], 2.0, 1e-12) && close(answer.sigma_sum, 1.0, 1e-12));
        let mut forces = [0.0; 4];
        let sigma = d.solve_into(&Wrench::<3>::zeros(), &mut forces).unwrap();
        assert!(close(sigma, answer.sigma, 1e-12) && close(forces[2], 2.0, 1e-12));
    }
    // One finger alone cannot hold anything.
    let grasp = Grasp::<3>::new(&fingers[..1]).unwrap();
    options.min_normal = vec![0.25];
    let d = ControlLoop::with_options(&grasp, Criterion::Max, options).unwrap();
    let mut forces = [7.0; 2];
    for refused in [d.solve(&Wrench::<3>::zeros()).err(), d.solve_into(&Wrench::zeros(), &mut forces).err()] {
        assert!(matches!(refused, Some(Error::InfeasibleWrench { .. })), "{refused:?}");
    }
    assert_eq!(forces, [7.0; 2]);
}

#[test]
fn bounds_that_make_no_sense_are_refused_by_name() {
    let contact = Contact::new(Vector3::x(), -Vector3::x());
    let mut extreme = contact.clone();
    extreme.forces = ForceModel::Extreme(vec![graspforce::ContactForce::x()]);
    let cases = [
        (contact.clone(), vec![0.1, 0.1], Method::Implicit),
        (contact.clone(), vec![-0.1], Method::Implicit),
        (contact.clone(), vec![f64::NAN], Method::Implicit),
        (contact, vec![0.1], Method::Enumerated),
        (extreme, vec![0.1], Method::Implicit),
    ];
    for (contact, bounds, method) in cases {
        let grasp = Grasp::<6>::new(&[contact]).unwrap();
        let mut options = DistributionOptions::default();
        (options.min_normal, options.method) = (bounds, method);
        let refused = ControlLoop::with_options(&grasp, Criterion::Max, options).err();
        assert!(matches!(refused, Some(Error::InvalidInput { argument: "min_normal", .. })), "{refused:?}");
    }
}
