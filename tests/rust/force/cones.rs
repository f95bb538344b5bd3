//! True friction cones against interior-point references, and the laws they share with linearised cones.

use std::f64::consts::PI;

use graspforce::{Contact, ContactForce, Criterion, DistributionOptions, Error, Grasp, Wrench};
use nalgebra::Vector3;
use support::control_loop::ControlLoop;
use support::friction_cone::load;
use support::reference_cases::{close, numbers, reference, spatial_cases};

fn cones(contacts: &[Contact]) -> Grasp<6> {
    Grasp::new(&contacts.iter().cloned().map(Contact::cone).collect::<Vec<_>>()).unwrap()
}

fn with_tolerance(grasp: &Grasp<6>, criterion: Criterion, tolerance: f64) -> ControlLoop<6> {
    let mut options = DistributionOptions::default();
    options.rtol = tolerance;
    ControlLoop::with_options(grasp, criterion, options).unwrap()
}

/// Balance, and forces strictly within their cones.
fn assert_in_cones(grasp: &Grasp<6>, external: &Wrench<6>, answer: &graspforce::Distribution<6>) {
    let resultant: Wrench<6> = answer.contact_wrenches(grasp).iter().sum();
    assert!(
        (resultant + external).amax() <= 1e-9 * external.amax().max(answer.sigma_sum),
        "{:e}",
        (resultant + external).amax()
    );
    for (contact, f) in grasp.contacts().iter().zip(&answer.forces) {
        let load = load(contact, false, f);
        assert!(load <= f[0] * (1.0 + 1e-9) + 1e-15, "{load} {}", f[0]);
    }
}

#[test]
fn every_spatial_case_has_its_least_sum_and_maximum_over_true_cones() {
    let data = reference("spatial");
    for (case, data) in spatial_cases().iter().zip(data.as_array().unwrap()) {
        let grasp = cones(&case.contacts);
        for criterion in [Criterion::Sum, Criterion::Max] {
            let key = if criterion == Criterion::Sum { "exact_sum" } else { "exact_max" };
            let distributor = with_tolerance(&grasp, criterion, 1e-7);
            for w in data["wrenches"].as_array().unwrap() {
                let external = Wrench::<6>::from_row_slice(&numbers(&w["external"]));
                match (w[key].as_f64(), distributor.solve(&external)) {
                    (Some(expected), Ok(answer)) => {
                        assert!(
                            close(answer.sigma, expected, 3e-6),
                            "{} {} {expected}",
                            case.name,
                            answer.sigma
                        );
                        assert!(answer.gap <= 1e-7);
                        assert_in_cones(&grasp, &external, &answer);
                    }
                    (None, Err(Error::InfeasibleWrench { direction, .. })) => {
                        let e = Wrench::<6>::from_row_slice(&direction);
                        assert!(-external.dot(&e) > 0.0);
                        let set = graspforce::WrenchSet::new(&grasp, Criterion::Sum);
                        assert!(set.value(&e) <= 1e-9, "{}", set.value(&e));
                    }
                    (expected, answer) => panic!("{}: {expected:?} {answer:?}", case.name),
                }
            }
        }
    }
}

#[test]
fn more_edges_approach_the_true_cone_from_above_and_with_their_square() {
    for case in spatial_cases().iter().take(7) {
        let exact = cones(&case.contacts);
        let distributor = with_tolerance(&exact, Criterion::Max, 1e-8);
        // Each of these pyramids holds the one before.
        let pyramids = [8, 16, 32, 64].map(|edges| {
            let contacts: Vec<_> = case.contacts.iter().map(|c| c.clone().edges(edges)).collect();
            (edges, Grasp::<6>::new(&contacts).unwrap())
        });
        let radius = -pyramids[0].1.quality(Criterion::Max).unwrap().rho;
        for (external, ..) in &case.wrenches {
            let answer = distributor.solve(external).unwrap();
            // Normal forces larger by 1 / cos(pi / l) put each force into its pyramid, and push the object by this.
            let pushed: Wrench<6> =
                exact.maps().iter().zip(&answer.forces).map(|(map, f)| map.column(0) * f[0]).sum();
            let mut before = f64::INFINITY;
            for (edges, grasp) in &pyramids {
                let more = 1.0 / (PI / *edges as f64).cos() - 1.0;
                let most = answer.sigma + more * (answer.sigma + pushed.norm() / radius);
                let sigma = ControlLoop::new(grasp, Criterion::Max).unwrap().solve(external).unwrap().sigma;
                assert!(
                    answer.sigma <= sigma * (1.0 + 1e-8) && sigma <= most * (1.0 + 1e-8),
                    "{} {edges}: {} {sigma} {most}",
                    case.name,
                    answer.sigma
                );
                assert!(sigma <= before * (1.0 + 1e-9), "{} {edges}: {sigma} after {before}", case.name);
                before = sigma;
            }
        }
    }
}

#[test]
fn extreme_forces_lie_on_their_pyramids_and_rays_of_the_true_cone_between_them_outside() {
    for edges in 3..40 {
        let hard = Contact::new(Vector3::x(), -Vector3::x()).friction(0.3).max_normal_force(7.0).edges(edges);
        for contact in [hard.clone(), hard.clone().torsion(0.02)] {
            let grasp = Grasp::<6>::new(std::slice::from_ref(&contact)).unwrap();
            for force in grasp.extreme_forces().unwrap() {
                assert!(close(load(&contact, false, force), 7.0, 1e-13), "{edges} {force}");
            }
        }
        let (s, c) = (PI / edges as f64).sin_cos();
        let between = ContactForce::new(1.0, 0.3 * c, 0.3 * s, 0.0);
        assert!(close(load(&hard, false, &between), 1.0 / c, 1e-13), "{edges}");
        assert!(close(load(&hard.cone(), false, &between), 1.0, 1e-13));
    }
}

#[test]
fn soft_fingers_balance_what_hard_ones_cannot() {
    let cases = spatial_cases();
    let pair = cases.iter().find(|case| case.contacts.len() == 2).unwrap();
    let hard = cones(&pair.contacts);
    let soft: Vec<_> = pair.contacts.iter().map(|c| c.clone().torsion(0.02)).collect();
    let soft = cones(&soft);
    let axis = soft.contacts()[0].normal;
    let twist = Wrench::<6>::from_iterator([0.0; 3].into_iter().chain(axis.iter().map(|x| 0.01 * x)));
    let infeasible = with_tolerance(&hard, Criterion::Max, 1e-8).solve(&twist);
    assert!(matches!(infeasible, Err(Error::InfeasibleWrench { .. })), "{infeasible:?}");
    let answer = with_tolerance(&soft, Criterion::Max, 1e-8).solve(&twist).unwrap();
    assert_in_cones(&soft, &twist, &answer);
    // Each finger twists with half of the torque: f_n = 0.005 / 0.02.
    assert!(close(answer.sigma, 0.25, 1e-7), "{}", answer.sigma);
}
