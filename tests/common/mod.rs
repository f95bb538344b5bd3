//! The reference grasps, read from `tests/reference`.
#![allow(dead_code, reason = "each test file uses its own part")]

use graspforce::{Contact, Grasp};
use nalgebra::{SVector, Vector3};
use serde_json::Value;

/// One case of `spatial.json`.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) grasp: Grasp<6>,
    pub(crate) closure: String,
    pub(crate) rho_sum: f64,
    pub(crate) rho_max: f64,
    /// External wrench, least sum, least maximum; `None` where it cannot be balanced.
    pub(crate) wrenches: Vec<(SVector<f64, 6>, Option<f64>, Option<f64>)>,
}

pub(crate) fn read(file: &str) -> Value {
    let path = format!("{}/tests/reference/{file}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub(crate) fn contacts(case: &Value) -> Vec<Contact> {
    let vector = |name: &str, i: usize| Vector3::from_vec(numbers(&case[name][i]));
    let count = case["positions"].as_array().unwrap().len();
    let contact = |i: usize| {
        Contact::new(vector("positions", i), vector("normals", i))
            .tangent(vector("tangents", i))
            .friction(case["friction"][i].as_f64().unwrap())
            .max_normal_force(case["max_normal_force"][i].as_f64().unwrap())
            .edges(case["edges"].as_u64().unwrap() as usize)
    };
    (0..count).map(contact).collect()
}

pub(crate) fn spatial_cases() -> Vec<Case> {
    let cases = read("spatial.json");
    let case = |case: &Value| Case {
        name: case["name"].as_str().unwrap().to_owned(),
        grasp: Grasp::new(&contacts(case)).unwrap(),
        closure: case["closure"].as_str().unwrap().to_owned(),
        rho_sum: case["rho_sum"].as_f64().unwrap(),
        rho_max: case["rho_max"].as_f64().unwrap(),
        wrenches: case["wrenches"].as_array().unwrap().iter().map(wrench).collect(),
    };
    cases.as_array().unwrap().iter().map(case).collect()
}

fn wrench(entry: &Value) -> (SVector<f64, 6>, Option<f64>, Option<f64>) {
    let external = SVector::from_vec(numbers(&entry["external"]));
    (external, entry["sigma_sum"].as_f64(), entry["sigma_max"].as_f64())
}
