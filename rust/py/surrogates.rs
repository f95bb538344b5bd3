//! `graspforce.surrogates`: numbers that stand in for the quality, of many grasps on all cores.

use std::num::NonZero;
use std::thread::available_parallelism;

use graspforce::{Error, Grasp, Status, Surrogate, SurrogateValue, check_room, surrogate_batch};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::vector;
use crate::convert::errors::{invalid_grasp, invalid_input, to_python};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{choice, number};
use crate::convert::views::{Layout, Views};
use crate::force::many::ERROR_BYTES;
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::memory::{Work, check_rows};

/// A surrogate of many grasps, as a dictionary of arrays; `graspforce.surrogates` documents the arguments.
#[pyfunction]
#[pyo3(signature = (surrogate, positions, normals, *, limit=None, offsets=None, **options))]
pub fn surrogate_arrays<'py>(
    py: Python<'py>,
    surrogate: &Bound<'py, PyAny>,
    positions: Bound<'py, PyAny>,
    normals: Bound<'py, PyAny>,
    limit: Option<&Bound<'py, PyAny>>,
    offsets: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let words = ["min_weight", "differentiable_force_closure", "span_residual"];
    let wrong = |message: String| invalid_input(py, message);
    let name = choice("surrogate", surrogate, &words).map_err(wrong)?;
    let raw = Raw::new(name, &PyTuple::new(py, [positions, normals])?, options)?;
    let views = Views::of(&raw).map_err(|message| invalid_grasp(py, message))?;
    let layout = offsets.map_or(Ok(Layout::Batch), |offsets| Layout::ragged(offsets, views.rows()));
    let layout = layout.map_err(wrong)?;
    let arguments = Arguments::of(&raw, &views, layout).map_err(|message| invalid_grasp(py, message))?;
    let limit = limit.map(|limit| number("limit", limit)).transpose().map_err(wrong)?;
    let surrogate = match (name, limit) {
        ("min_weight", _) => Surrogate::MinWeight,
        (_, Some(limit)) => Surrogate::SpanResidual { limit },
        _ => Surrogate::ForceClosure,
    };
    surrogate.check().and_then(|()| arguments.options.check()).map_err(|error| to_python(py, &error))?;
    if arguments.dim == 2 { run::<3>(py, &arguments, surrogate) } else { run::<6>(py, &arguments, surrogate) }
}

fn run<'py, const D: usize>(
    py: Python<'py>,
    arguments: &Arguments<'_>,
    surrogate: Surrogate,
) -> PyResult<Bound<'py, PyDict>> {
    let (rows, dim) = (arguments.batch, arguments.dim);
    check_rows(py, arguments, available_parallelism().map_or(1, NonZero::get), Work::Quality)?;
    let shape = if arguments.is_ragged() { vec![arguments.contacts] } else { vec![rows, arguments.contacts] };
    let contacts: usize = shape.iter().product();
    // Vectors of each contact in space, once by grasps, and once in arrays.
    let bytes = size_of::<f64>() * (64 * rows).saturating_add((8 + 2 * dim) * contacts);
    check_room("positions", 1, bytes).map_err(|error| to_python(py, &error))?;
    let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
    let found = on_all_cores(py, || surrogate_batch(0..rows, grasp, surrogate))?;
    let failed = found.iter().filter(|item| item.is_err()).count();
    check_room("errors", failed, ERROR_BYTES).map_err(|error| to_python(py, &error))?;
    let errors = PyDict::new(py);
    for (row, error) in found.iter().enumerate().filter_map(|(row, item)| Some((row, item.as_ref().err()?))) {
        if matches!(error, Error::OutOfMemory { .. }) {
            return Err(to_python(py, error));
        }
        errors.set_item(row, error.to_string())?;
    }
    let each = |of: fn(&SurrogateValue) -> f64| {
        vector(py, "values", rows, found.iter().map(|item| item.as_ref().map_or(f64::NAN, of)))
    };
    let vectors = |name, of: fn(&SurrogateValue) -> &[Vector3<f64>]| {
        let row =
            |row: usize, k: usize| found[row].as_ref().map_or(f64::NAN, |found| of(found)[k / dim][k % dim]);
        let count = |row| arguments.contacts_in(row) * dim;
        let values = (0..rows).flat_map(|at| (0..count(at)).map(move |k| row(at, k)));
        vector(py, name, contacts * dim, values)?.reshape([&shape[..], &[dim]].concat())
    };
    let spin = |row: usize, k: usize| found[row].as_ref().map_or(f64::NAN, |found| found.spins[k]);
    let spins = (0..rows).flat_map(|row| (0..arguments.contacts_in(row)).map(move |k| spin(row, k)));
    let unique = found.iter().map(|item| item.as_ref().is_ok_and(|found| found.unique));
    let status = found.iter().map(|item| match item {
        Ok(_) => Status::Solved as i8,
        Err(error) => Status::of(error) as i8,
    });
    let status: Bound<'py, PyArray1<i8>> = vector(py, "status", rows, status)?;
    let result = PyDict::new(py);
    result.set_item("values", each(|found| found.value)?)?;
    result.set_item("positions", vectors("positions", |found| &found.positions)?)?;
    result.set_item("normals", vectors("normals", |found| &found.normals)?)?;
    result.set_item("spins", vector(py, "spins", contacts, spins)?.reshape(shape.clone())?)?;
    result.set_item("unique", vector(py, "unique", rows, unique)?)?;
    result.set_item("status", status)?;
    result.set_item("errors", errors)?;
    Ok(result)
}
