//! What `graspforce.least_friction` and `graspforce.grade` ask of the core.

use graspforce::{Criterion, Error, FrictionOptions, Grasp, LeastFriction, Wrench, least_friction_batch};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::{float_vector, vector};
use crate::convert::dimension::by_dimension;
use crate::convert::errors::{invalid_grasp, invalid_input, to_python};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::quality_options::parse_criterion;
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{Given, instance, number};
use crate::grasp::PyGrasp;
use crate::runtime::interrupt::{detached, on_all_cores};
use crate::runtime::memory::{Work, check_kept_rows, check_work};

type Columns<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyDict>);

/// The bracket of the least friction of one grasp.
#[pyfunction]
pub fn least_friction(
    py: Python<'_>,
    grasp: &Bound<'_, PyAny>,
    external_wrench: Option<&Bound<'_, PyAny>>,
    criterion: Given<'_>,
    rtol: &Bound<'_, PyAny>,
    max_friction: &Bound<'_, PyAny>,
) -> PyResult<(f64, f64)> {
    let wrong = |message: String| invalid_input(py, message);
    let grasp = instance::<PyGrasp>("grasp", grasp).map_err(wrong)?;
    let criterion = parse_criterion("criterion", &criterion).map_err(wrong)?;
    let numbers = (|| Ok((number("rtol", rtol)?, number("max_friction", max_friction)?)))().map_err(wrong)?;
    let LeastFriction { lower, upper } = by_dimension!(&grasp.get().inner, of => {
        let options = options(criterion, numbers, external_wrench).map_err(wrong)?;
        check_work(py, of, Work::Distributor)?;
        detached(py, || of.least_friction(&options))?
    })
    .map_err(|error| to_python(py, &error))?;
    Ok((lower, upper))
}

fn options<const D: usize>(
    criterion: Criterion,
    (rtol, max_friction): (f64, f64),
    external_wrench: Option<&Bound<'_, PyAny>>,
) -> Result<FrictionOptions<D>, String> {
    let wrench = external_wrench.map(|value| float_vector("external_wrench", value, D)).transpose()?;
    Ok(FrictionOptions { external_wrench: wrench.map(Wrench::from_vec), criterion, rtol, max_friction })
}

/// Both ends of the brackets of many grasps, NaN with a reason where a row has none.
#[pyfunction]
#[pyo3(signature = (*arguments, **options))]
pub fn least_friction_many<'py>(
    py: Python<'py>,
    arguments: &Bound<'py, PyTuple>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Columns<'py>> {
    let raw = Raw::new("least_friction_many", arguments, options)?;
    let arguments = Arguments::parse(&raw, true).map_err(|message| invalid_grasp(py, message))?;
    arguments.options.check().map_err(|error| to_python(py, &error))?;
    check_kept_rows(py, &arguments)?;
    let found =
        if arguments.dim == 2 { brackets::<3>(py, &arguments) } else { brackets::<6>(py, &arguments) }?;
    let errors = PyDict::new(py);
    for (row, one) in found.iter().enumerate() {
        match one {
            Err(error @ (Error::OutOfMemory { .. } | Error::Interrupted)) => {
                return Err(to_python(py, error));
            }
            Err(error) => errors.set_item(row, error.to_string())?,
            Ok(_) => {}
        }
    }
    let column = |end: fn(&LeastFriction) -> f64| {
        vector(py, "rows", found.len(), found.iter().map(|one| one.as_ref().map_or(f64::NAN, end)))
    };
    Ok((column(|one| one.lower)?, column(|one| one.upper)?, errors))
}

fn brackets<const D: usize>(
    py: Python<'_>,
    arguments: &Arguments<'_>,
) -> PyResult<Vec<graspforce::Result<LeastFriction>>> {
    let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
    on_all_cores(py, || least_friction_batch(0..arguments.batch, grasp, &FrictionOptions::default()))
}
