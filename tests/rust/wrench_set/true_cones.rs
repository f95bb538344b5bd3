//! True cones: known values, brackets, and linearisations that converge to them from inside.

use std::f64::consts::FRAC_1_SQRT_2;

use graspforce::{Closure, Contact, Criterion, Error, Grasp, Quality, QualityOptions, QualityWorkspace};
use nalgebra::Vector3;

fn sphere(points: &[[f64; 3]], change: impl Fn(Contact) -> Contact) -> Grasp<6> {
    let contacts: Vec<_> = points
        .iter()
        .map(|&p| {
            let p = Vector3::from(p).normalize();
            change(Contact::new(p, -p).friction(0.5))
        })
        .collect();
    Grasp::new(&contacts).unwrap()
}

const TETRAHEDRON: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
const EQUATOR: [[f64; 3]; 4] = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
const PAIR: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];

fn bracketed(quality: &Quality<6>, low: f64, high: f64) {
    assert!(quality.lower <= quality.rho && quality.rho <= quality.upper);
    assert!(-quality.upper <= high && -quality.lower >= low, "{quality:?} is not within [{low}, {high}]");
}

#[test]
fn symmetric_grasps_are_bracketed_within_the_work_limit() {
    let tetrahedron = sphere(&TETRAHEDRON, Contact::cone);
    let sum = tetrahedron.quality(Criterion::Sum).unwrap();
    let max = tetrahedron.quality(Criterion::Max).unwrap();
    // Bounds by inscribed and circumscribed polyhedral cones.
    bracketed(&sum, 0.351_865, 0.354_791);
    bracketed(&max, 1.11536, 1.154_701);
    assert!(sum.converged && (sum.rho + 0.125_f64.sqrt()).abs() < 1e-6, "{sum:?}");
    assert!(max.converged && (max.rho + 2.0 / 3.0_f64.sqrt()).abs() < 2e-6, "{max:?}");
    let equator = sphere(&EQUATOR, Contact::cone).quality(Criterion::Max).unwrap();
    assert!(equator.converged && (equator.rho + 1.0).abs() < 2e-6, "{equator:?}");
}

#[test]
fn a_soft_pair_is_as_strong_as_its_weakest_twist_or_slip() {
    // About the axis only torsion resists: two fingers of torsional coefficient 0.3 m under a sum of 1 N.
    let pair = sphere(&PAIR, |c| c.cone().torsion(0.3));
    let sum = pair.quality(Criterion::Sum).unwrap();
    assert_eq!(sum.closure, Closure::Force);
    bracketed(&sum, 0.3 - 1e-6, 0.3 + 1e-6);
    assert_eq!(sphere(&PAIR, Contact::cone).quality(Criterion::Max).unwrap().closure, Closure::Partial);
}

#[test]
fn a_continuum_of_minimisers_ends_with_its_bracket() {
    let soft = sphere(&TETRAHEDRON, |c| c.cone().torsion(0.2));
    let within = |max_facets| {
        let max_facets = Some(max_facets);
        let options = QualityOptions { rtol: Some(1e-9), max_facets, ..QualityOptions::new(Criterion::Max) };
        soft.quality_with(&options, &mut QualityWorkspace::default()).unwrap()
    };
    let (short, long) = (within(5000), within(50_000));
    assert!(!short.converged);
    assert!(short.lower < short.upper && short.upper < 0.0, "{short:?}");
    assert!((long.upper - long.lower) < 0.02 * -long.rho, "{long:?}");
    assert!(short.lower <= long.upper && long.lower <= short.upper, "{short:?} {long:?}");
}

#[test]
fn linearised_cones_converge_from_inside() {
    for criterion in [Criterion::Sum, Criterion::Max] {
        for torsion in [0.0, 0.25] {
            let grasp = |change: fn(Contact) -> Contact| {
                sphere(&[[1.0, 0.2, 0.1], [-0.9, 0.3, -0.2], [0.1, -1.0, 0.4], [0.0, 0.3, 1.0]], move |c| {
                    change(c.torsion(torsion))
                })
            };
            let exact = grasp(Contact::cone).quality(criterion).unwrap();
            let errors: Vec<f64> = [
                grasp(|c| c.edges(4)),
                grasp(|c| c.edges(8)),
                grasp(|c| c.edges(16)),
                grasp(|c| c.edges(32)),
            ]
            .iter()
            .map(|grasp| grasp.quality(criterion).unwrap().rho - exact.rho)
            .collect();
            // From inside: less is resisted, so rho is larger; twice the edges contain the old ones; and eight
            // times as many leave at most a tenth of the error (a quadratic law would leave a sixty-fourth).
            let law = format!("{criterion:?} {torsion}: {errors:?}");
            assert!(errors.iter().all(|error| *error > -1e-6), "{law}");
            assert!(errors.windows(2).all(|pair| pair[1] <= pair[0] + 1e-6), "{law}");
            assert!(errors[3] <= 0.1 * errors[0] + 1e-6, "{law}");
        }
    }
}

#[test]
fn random_cones_converge_and_contain_their_linearisation() {
    for grasp in support::problems::closed_grasps(5, 60, 4, 0) {
        let inner: Vec<_> = grasp.contacts().iter().map(|c| c.clone().edges(24)).collect();
        // Circumscribed: edges at the distance where their sides touch the cone.
        let outer: Vec<_> = grasp
            .contacts()
            .iter()
            .map(|c| c.clone().edges(24).friction(c.friction / (std::f64::consts::PI / 24.0).cos()))
            .collect();
        for criterion in [Criterion::Sum, Criterion::Max] {
            let exact = grasp.quality(criterion).unwrap();
            assert!(exact.converged && exact.upper - exact.lower <= 1.1e-6 * -exact.rho, "{exact:?}");
            let inner = Grasp::<6>::new(&inner).unwrap().quality(criterion).unwrap();
            let outer = Grasp::<6>::new(&outer).unwrap().quality(criterion).unwrap();
            assert!(
                outer.lower <= exact.upper && exact.lower <= inner.upper,
                "{outer:?} {exact:?} {inner:?}"
            );
        }
    }
}

#[test]
fn a_friction_margin_is_less_friction() {
    let contacts: Vec<_> = TETRAHEDRON
        .iter()
        .map(|&p| Contact::new(Vector3::from(p), -Vector3::from(p)).friction(0.6).cone())
        .collect();
    let options = graspforce::GraspOptions { friction_margin: 1.5, ..Default::default() };
    let cautious = Grasp::<6>::with_options(&contacts, options).unwrap();
    let slippery: Vec<_> = contacts.iter().map(|c| c.clone().friction(0.6 / 1.5)).collect();
    let slippery = Grasp::<6>::new(&slippery).unwrap();
    for criterion in [Criterion::Sum, Criterion::Max] {
        assert_eq!(cautious.quality(criterion).unwrap().rho, slippery.quality(criterion).unwrap().rho);
    }
}

#[test]
fn planar_cones_are_exact_already() {
    let contacts = [[1.0, 0.0], [-0.5, 0.75_f64.sqrt()], [-0.5, -0.75_f64.sqrt()]].map(|[x, y]| {
        Contact::new(Vector3::new(x, y, 0.0), Vector3::new(-x, -y, 0.0)).friction(FRAC_1_SQRT_2)
    });
    let cones = contacts.clone().map(Contact::cone);
    let (edges, cones) = (Grasp::<3>::new(&contacts).unwrap(), Grasp::<3>::new(&cones).unwrap());
    assert!(cones.is_finite());
    assert_eq!(edges.quality(Criterion::Max).unwrap().rho, cones.quality(Criterion::Max).unwrap().rho);
}

#[test]
fn a_coefficient_whose_square_overflows_is_computed_with_or_refused_by_its_name() {
    for exponent in [0, 60, 76, 100, 139, 141, 155, 300] {
        let friction = 10_f64.powi(exponent);
        for limit in [1.0, 1e-30, 1e-130] {
            let contacts: Vec<_> = PAIR
                .iter()
                .map(|&p| {
                    let p = Vector3::from(p);
                    Contact::new(p, -p).friction(friction).torsion(0.1).max_normal_force(limit).cone()
                })
                .collect();
            match Grasp::<6>::new(&contacts).and_then(|grasp| grasp.quality(Criterion::Max)) {
                Ok(quality) => {
                    assert!(quality.rho.is_finite() && quality.lower <= quality.upper, "{quality:?}");
                }
                Err(Error::InvalidGrasp { argument, .. }) => {
                    assert!(
                        ["friction", "positions"].contains(&argument),
                        "{argument}: {friction:e}, {limit:e}"
                    );
                }
                Err(error) => panic!("{error}"),
            }
        }
    }
}
