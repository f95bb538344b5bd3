//! Options of a force distributor: checked, and in the words of the core.

use graspforce::{Criterion, DistributionOptions, Method, check_room};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, shaped};
use crate::convert::errors::{invalid_input, to_python};
use crate::convert::scalars::{Given, choice, flag, number};
use crate::runtime::interrupt::keep;

/// The words for them; the first is the default.
const METHODS: [&str; 3] = ["implicit", "enumerated", "reduced"];

/// The core's options, and the name of the method; `contacts` is how many the grasp has.
pub fn distribution_options(
    method: &Given<'_>,
    weight: &Given<'_>,
    min_normal: Option<&Bound<'_, PyAny>>,
    samples: Option<&Bound<'_, PyAny>>,
    rtol: &Given<'_>,
    contacts: usize,
) -> Result<(DistributionOptions, &'static str), String> {
    let mut options = DistributionOptions::default();
    let name = method.or(METHODS[0], |value| choice("method", value, &METHODS))?;
    options.method = match name {
        "enumerated" => Method::Enumerated,
        "reduced" => Method::Reduced,
        _ => Method::Implicit,
    };
    options.weight = weight.or(options.weight, |value| number("weight", value))?;
    options.rtol = rtol.or(options.rtol, |value| number("rtol", value))?;
    if let Some(min_normal) = min_normal {
        options.min_normal = lower_bounds(min_normal, contacts)?;
    }
    if let Some(samples) = samples {
        options.samples = rows("samples", samples)?;
    }
    Ok((options, name))
}

/// The name of an objective, and the criterion that it minimises: none for least squares.
pub fn parse_objective(given: &Given<'_>) -> Result<(&'static str, Option<Criterion>), String> {
    let word = given.or("max", |given| choice("objective", given, &["max", "sum", "squares"]))?;
    let criterion = match word {
        "max" => Some(Criterion::Max),
        "sum" => Some(Criterion::Sum),
        _ => None,
    };
    Ok((word, criterion))
}

/// One number for all contacts, or one for each.
fn lower_bounds(value: &Bound<'_, PyAny>, contacts: usize) -> Result<Vec<f64>, String> {
    let array = float_array("min_normal", value)?;
    match (array.shape(), contents(&array)) {
        ([], &[bound]) => Ok(vec![bound]),
        ([m], bounds) if *m == contacts => Ok(bounds.to_vec()),
        (given, _) => Err(format!("min_normal: shape {}, expected a number or ({contacts},)", shaped(given))),
    }
}

fn rows(argument: &str, value: &Bound<'_, PyAny>) -> Result<Vec<Vec<f64>>, String> {
    let array = float_array(argument, value)?;
    match array.shape() {
        &[_, columns] if columns > 0 => {
            // Each row is an allocation of its own.
            let each = size_of::<Vec<f64>>() + size_of_val(contents(&array)) / array.shape()[0].max(1) + 16;
            check_room("samples", array.shape()[0], each).map_err(|error| {
                keep(to_python(value.py(), &error));
                error.to_string()
            })?;
            Ok(contents(&array).chunks_exact(columns).map(<[f64]>::to_vec).collect())
        }
        given => Err(format!("{argument}: shape {}, expected (S, d)", shaped(given))),
    }
}

/// Whether `nearest_into` returns the gap.
pub fn gap_flag(py: Python<'_>, given: &Given<'_>) -> PyResult<bool> {
    given.or(false, |value| flag("return_gap", value)).map_err(|message| invalid_input(py, message))
}

/// Whether `nearest` keeps the limits.
pub fn limits_flag(py: Python<'_>, given: &Given<'_>) -> PyResult<bool> {
    given.or(true, |value| flag("limits", value)).map_err(|message| invalid_input(py, message))
}
