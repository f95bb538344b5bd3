//! True friction cones against interior-point references, and the laws they share with linearised cones.

mod force_cases;

use force_cases::{close, numbers, reference, spatial_cases};
use graspforce::{Contact, Criterion, DistributionOptions, Error, ForceDistributor, Grasp, Wrench};

fn cones(contacts: &[Contact]) -> Grasp<6> {
    Grasp::new(&contacts.iter().cloned().map(Contact::cone).collect::<Vec<_>>()).unwrap()
}

fn with_tolerance(grasp: &Grasp<6>, criterion: Criterion, tolerance: f64) -> ForceDistributor<6> {
    let mut options = DistributionOptions::default();
    options.tolerance = tolerance;
    ForceDistributor::with_options(grasp, criterion, options).unwrap()
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
        let load = if contact.torsion == 0.0 {
            assert_eq!(f[3], 0.0);
            f[1].hypot(f[2]) / contact.friction
        } else {
            (f[1].hypot(f[2]) / contact.friction).hypot(f[3] / contact.torsion)
        };
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
                    (None, Err(Error::InfeasibleWrench { direction })) => {
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
fn more_edges_approach_the_true_cone_from_above() {
    for case in spatial_cases().iter().take(7) {
        let exact = with_tolerance(&cones(&case.contacts), Criterion::Max, 1e-8);
        for (external, ..) in &case.wrenches {
            let least = exact.solve(external).unwrap().sigma;
            let fine: Vec<_> = case.contacts.iter().map(|c| c.clone().edges(64)).collect();
            let fine = ForceDistributor::new(&Grasp::<6>::new(&fine).unwrap(), Criterion::Max).unwrap();
            let approximate = fine.solve(external).unwrap().sigma;
            assert!(
                least <= approximate * (1.0 + 1e-8) && close(least, approximate, 2e-2),
                "{least} {approximate}"
            );
        }
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
