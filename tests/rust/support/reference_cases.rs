//! Reference grasps and wrenches, and what the tests of force distribution share.

use crate::friction_cone::slip;
use graspforce::{Contact, Criterion, Grasp, Wrench};
use nalgebra::Vector3;
use proptest::test_runner::{Config as ProptestConfig, RngSeed};
use serde_json::Value;

/// The same cases in every run, and no files left behind.
pub fn seeded(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(20_060_315),
        ..ProptestConfig::default()
    }
}

/// One grasp of `spatial.json` with its class, its quality, and wrenches with their least sums and maxima (`None`:
/// infeasible).
pub struct Case {
    pub name: String,
    pub contacts: Vec<Contact>,
    pub closure: String,
    pub rho_sum: f64,
    pub rho_max: f64,
    pub wrenches: Vec<(Wrench<6>, Option<f64>, Option<f64>)>,
}

pub fn reference(name: &str) -> Value {
    let path = format!("{}/../../reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub fn spatial_cases() -> Vec<Case> {
    reference("spatial").as_array().unwrap().iter().map(spatial_case).collect()
}

fn spatial_case(case: &Value) -> Case {
    let rows = |key: &str| -> Vec<Vector3<f64>> {
        case[key].as_array().unwrap().iter().map(|row| Vector3::from_row_slice(&numbers(row))).collect()
    };
    let (friction, limits) = (numbers(&case["friction"]), numbers(&case["max_normal_force"]));
    let (positions, normals, tangents) = (rows("positions"), rows("normals"), rows("tangents"));
    let edges = case["edges"].as_u64().unwrap() as usize;
    let contacts = (0..positions.len()).map(|i| {
        Contact::new(positions[i], normals[i])
            .tangent(tangents[i])
            .friction(friction[i])
            .max_normal_force(limits[i])
            .edges(edges)
    });
    let wrenches = case["wrenches"].as_array().unwrap().iter().map(|w| {
        let external = Wrench::<6>::from_row_slice(&numbers(&w["external"]));
        (external, w["sigma_sum"].as_f64(), w["sigma_max"].as_f64())
    });
    Case {
        name: case["name"].as_str().unwrap().into(),
        contacts: contacts.collect(),
        closure: case["closure"].as_str().unwrap().into(),
        rho_sum: case["rho_sum"].as_f64().unwrap(),
        rho_max: case["rho_max"].as_f64().unwrap(),
        wrenches: wrenches.collect(),
    }
}

/// The racket's contacts of Table 1: three or four fingers at these parameters.
pub fn racket(params: &[f64]) -> Vec<Contact> {
    let at = |position: [f64; 2], tangent: [f64; 2], inside: [f64; 2], mu: f64, limit: f64| {
        let normal = Vector3::new(-tangent[1], tangent[0], 0.0);
        let towards = Vector3::new(inside[0] - position[0], inside[1] - position[1], 0.0);
        let normal = if normal.dot(&towards) < 0.0 { -normal } else { normal };
        Contact::new(Vector3::new(position[0], position[1], 0.0), normal).friction(mu).max_normal_force(limit)
    };
    // The throat's curves with x positive on the right; at phi = 0 their tangent is (0, 1).
    let throat = |phi: f64, side: f64, limit: f64| {
        let tangent = if phi == 0.0 { [0.0, 1.0] } else { [side * 2.04 * phi * phi, 1.6 * phi] };
        let y = 0.8 * phi * phi - 0.315;
        at([side * (0.68 * phi.powi(3) + 0.015), y], tangent, [-side, y], 0.1, limit)
    };
    let head = |phi: f64, a: f64, b: f64, outward: f64| {
        let (s, c) = phi.sin_cos();
        let position = [a * c, b * s];
        let inside = [position[0] * (1.0 + outward), position[1] * (1.0 + outward)];
        at(position, [-a * s, b * c], inside, 0.1, 30.0)
    };
    match *params {
        [one, two, three] => {
            vec![head(one, 0.13, 0.16, -1.0), throat(two, -1.0, 60.0), throat(three, 1.0, 60.0)]
        }
        [one, two, three, four] => vec![
            head(one, 0.12, 0.15, 1.0),
            head(two, 0.12, 0.17, 1.0),
            throat(three, 1.0, 60.0),
            at([-0.015, four], [0.0, 1.0], [1.0, four], 0.2, 100.0),
        ],
        _ => panic!("three or four parameters"),
    }
}

/// Three fingers under a plate, pressing upward.
pub fn plate() -> Grasp<6> {
    let fingers: Vec<_> = (0..3)
        .map(|i| {
            let (s, c) = (2.1 * f64::from(i)).sin_cos();
            Contact::new(Vector3::new(c, s, 0.0), Vector3::z()).friction(0.5).max_normal_force(10.0).edges(12)
        })
        .collect();
    Grasp::new(&fingers).unwrap()
}

/// Whether `a` and `b` agree to a relative tolerance.
pub fn close(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs())
}

/// What any answer must satisfy: balance, friction cones, and the sums it reports. Relative to the wrench.
pub fn assert_sound<const D: usize>(
    grasp: &Grasp<D>,
    external: &Wrench<D>,
    answer: &graspforce::Distribution<D>,
) {
    let resultant: Wrench<D> = answer.contact_wrenches(grasp).iter().sum();
    let strength: f64 = answer.contact_wrenches(grasp).iter().map(Wrench::amax).sum();
    let residual = (resultant + external).amax();
    assert!(residual <= 1e-9 * external.amax() + 1e-13 * strength, "balance residual {residual:e}");
    let mut largest: f64 = 0.0;
    let mut sum = 0.0;
    for (contact, force) in grasp.contacts().iter().zip(&answer.forces) {
        let share = force[0] / contact.max_normal_force;
        largest = largest.max(share);
        sum += share;
        assert!(
            slip(contact, D == 3, force) <= 1e-9 * answer.sigma_max * contact.max_normal_force,
            "{force}"
        );
    }
    assert!(close(largest, answer.sigma_max, 1e-9), "{largest} {}", answer.sigma_max);
    assert!(close(sum, answer.sigma_sum, 1e-9), "{sum} {}", answer.sigma_sum);
    assert!(answer.gap <= 1e-9);
}

/// The objective's value of an answer.
pub fn value<const D: usize>(criterion: Criterion, answer: &graspforce::Distribution<D>) -> f64 {
    match criterion {
        Criterion::Sum => answer.sigma_sum,
        Criterion::Max => answer.sigma_max,
    }
}
