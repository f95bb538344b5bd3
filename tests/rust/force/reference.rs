//! Force distribution against the reference answers: linear programs solved by `HiGHS`.

use graspforce::{Criterion, Distribution, DistributionOptions, Error, Grasp, Method, Wrench};
use support::control_loop::ControlLoop;
use support::reference_cases::{assert_sound, close, numbers, racket, reference, spatial_cases, value};

/// Enumerations larger than this are left to the implicit method.
const SMALL: usize = 20_000;

fn distributor<const D: usize>(grasp: &Grasp<D>, criterion: Criterion, method: Method) -> ControlLoop<D> {
    let mut options = DistributionOptions::default();
    options.method = method;
    ControlLoop::with_options(grasp, criterion, options).unwrap()
}

fn assert_separates(grasp: &Grasp<6>, external: &Wrench<6>, result: Result<Distribution<6>, Error>) {
    let Err(Error::InfeasibleWrench { direction, .. }) = result else {
        panic!("expected infeasible: {result:?}")
    };
    let e = Wrench::<6>::from_row_slice(&direction);
    assert!((e.norm() - 1.0).abs() < 1e-12);
    assert!(-external.dot(&e) > 0.0);
    for w in grasp.primitive_wrenches().unwrap() {
        assert!(w.dot(&e) <= 1e-10 * w.norm(), "{}", w.dot(&e));
    }
}

#[test]
fn every_spatial_case_has_its_least_sum_and_maximum_by_both_methods() {
    for case in spatial_cases() {
        let grasp = Grasp::<6>::new(&case.contacts).unwrap();
        let points: usize = (0..grasp.num_contacts())
            .try_fold(1_usize, |n, i| n.checked_mul(grasp.edges(i)?.len() + 1))
            .map_or(usize::MAX, |n| n - 1);
        for criterion in [Criterion::Sum, Criterion::Max] {
            let mut methods = vec![Method::Implicit];
            if criterion == Criterion::Sum || points < SMALL {
                methods.push(Method::Enumerated);
            }
            for method in methods {
                let distributor = distributor(&grasp, criterion, method);
                for (external, sum, max) in &case.wrenches {
                    let expected = if criterion == Criterion::Sum { sum } else { max };
                    let result = distributor.solve(external);
                    let Some(expected) = expected else {
                        assert_separates(&grasp, external, result);
                        continue;
                    };
                    let answer = result.unwrap_or_else(|e| panic!("{} {method:?}: {e}", case.name));
                    let sigma = value(criterion, &answer);
                    assert!(close(sigma, *expected, 1e-9), "{} {method:?}: {sigma} {expected}", case.name);
                    assert!(close(answer.dual.dot(&-external), *expected, 1e-9));
                    assert_sound(&grasp, external, &answer);
                }
            }
        }
    }
}

#[test]
fn table_1_of_the_paper_is_computed_by_both_methods() {
    let table = &reference("racket")["table1"];
    let external = Wrench::<3>::from_row_slice(&numbers(&table["external_wrench"]));
    for (row, data) in table["rows"].as_object().unwrap() {
        let grasp = Grasp::<3>::new(&racket(&numbers(&data["params"]))).unwrap();
        let expected = numbers(&data["computed"]);
        for method in [Method::Implicit, Method::Enumerated] {
            let sum = distributor(&grasp, Criterion::Sum, method).solve(&external).unwrap();
            let max = distributor(&grasp, Criterion::Max, method).solve(&external).unwrap();
            let computed = [sum.sigma_max, sum.sigma_sum, max.sigma_max, max.sigma_sum];
            for (a, b) in computed.iter().zip(&expected) {
                assert!(close(*a, *b, 1e-9), "row {row}, {method:?}: {computed:?} {expected:?}");
            }
            assert_sound(&grasp, &external, &sum);
            assert_sound(&grasp, &external, &max);
        }
    }
}
