//! `graspforce.forces_many`: many grasps, each for some wrenches, on all cores.

use std::num::NonZero;
use std::thread::available_parallelism;

use graspforce::{
    Error, Grasp, GraspForceGradients, GraspForces, GraspForcesOptions, check_room, forces_batch,
};
use numpy::{Element, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::convert::arrays::{float_array, shaped, vector, vectors};
use crate::convert::errors::{invalid_grasp, invalid_input, to_python};
use crate::convert::grasp_arguments::Arguments;
use crate::convert::raw_arguments::Raw;
use crate::convert::scalars::{Given, choice, flag};
use crate::force::construction::{distributor, refuse_beside_squares};
use crate::force::distribution_options::{distribution_options, parse_objective};
use crate::force::nearest::nearest_options;
use crate::force::squares_arguments::SquaresArguments;
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::memory::{Work, check_rows_of};

/// What Python takes for the reason of a row that is no grasp.
pub const ERROR_BYTES: usize = 512;

/// What a row takes beside its numbers.
const ROW_BYTES: usize = 1024;

/// Least forces of many grasps, as a dictionary of arrays; `graspforce.forces_many` documents the arguments.
#[pyfunction]
#[pyo3(signature = (positions, normals, external_wrenches, *, objective=Given::default(), weight=Given::default(),
    min_normal=None, rtol=Given::default(), reference=None, weights=None, slack=None, limits=Given::default(),
    infeasible=Given::default(), metric=None, gradient=Given::default(), **options))]
#[allow(clippy::too_many_arguments, reason = "the contract with Python")]
pub fn forces_many<'py>(
    py: Python<'py>,
    positions: Bound<'py, PyAny>,
    normals: Bound<'py, PyAny>,
    external_wrenches: &Bound<'py, PyAny>,
    objective: Given<'py>,
    weight: Given<'py>,
    min_normal: Option<&Bound<'py, PyAny>>,
    rtol: Given<'py>,
    reference: Option<&Bound<'py, PyAny>>,
    weights: Option<&Bound<'py, PyAny>>,
    slack: Option<&Bound<'py, PyAny>>,
    limits: Given<'py>,
    infeasible: Given<'py>,
    metric: Option<&Bound<'py, PyAny>>,
    gradient: Given<'py>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let raw = Raw::new("forces_many", &PyTuple::new(py, [positions, normals])?, options)?;
    let arguments = Arguments::parse(&raw, true).map_err(|message| invalid_grasp(py, message))?;
    let wrong = |message: String| invalid_input(py, message);
    let (_, criterion) = parse_objective(&objective).map_err(wrong)?;
    let limits = limits.or(false, |value| flag("limits", value)).map_err(wrong)?;
    let gradient = gradient.or(false, |value| flag("gradient", value)).map_err(wrong)?;
    let words = ["status", "nearest"];
    let infeasible = infeasible.or(words[0], |value| choice("infeasible", value, &words)).map_err(wrong)?;
    let force_dim = arguments.force_dim();
    let wrench_dim = if arguments.dim == 2 { 3 } else { 6 };
    let sizes = [arguments.contacts, force_dim, wrench_dim];
    let squares = match criterion {
        Some(_) => SquaresArguments::refuse(reference, weights, slack, limits),
        None => SquaresArguments::parse(reference, weights, slack, limits, sizes),
    };
    let squares = squares.map_err(wrong)?;
    let method = Given::default();
    let distribution = distribution_options(&method, &weight, min_normal, None, &rtol, arguments.contacts);
    let (distribution, _) = distribution.map_err(wrong)?;
    if criterion.is_none() {
        refuse_beside_squares(&distribution).map_err(wrong)?;
    }
    if metric.is_some() && infeasible != "nearest" {
        return Err(wrong("metric: only infeasible=\"nearest\" takes it".into()));
    }
    macro_rules! run {
        ($d:literal) => {{
            let nearest = nearest_options(metric, true).map_err(wrong)?;
            let nearest = (infeasible == "nearest").then_some(nearest);
            let options = GraspForcesOptions { nearest, gradient, force_dim };
            let make = |grasp: &Grasp<$d>| distributor(grasp, criterion, distribution.clone(), &squares);
            run(py, &arguments, external_wrenches, &options, make)
        }};
    }
    if arguments.dim == 2 { run!(3) } else { run!(6) }
}

fn run<'py, const D: usize>(
    py: Python<'py>,
    arguments: &Arguments,
    external_wrenches: &Bound<'py, PyAny>,
    options: &GraspForcesOptions<D>,
    make: impl Fn(&Grasp<D>) -> graspforce::Result<graspforce::ForceDistributor<D>> + Send + Sync,
) -> PyResult<Bound<'py, PyDict>> {
    arguments.options.check().map_err(|error| to_python(py, &error))?;
    let array = float_array("external_wrenches", external_wrenches);
    let array = array.map_err(|message| invalid_input(py, message))?;
    let (count, shared) = match *array.shape() {
        [count, d] if d == D => (count, true),
        [rows, count, d] if d == D && rows == arguments.batch => (count, false),
        ref given => {
            let (given, rows) = (shaped(given), arguments.batch);
            let message = format!("external_wrenches: shape {given}, expected (K, {D}) or ({rows}, K, {D})");
            return Err(invalid_input(py, message));
        }
    };
    let wrenches = vectors::<D>("external_wrenches", &array)?;
    drop(array);
    let (m, k, dim) = (arguments.contacts, options.force_dim, arguments.dim);
    let cores = available_parallelism().map_or(1, NonZero::get);
    check_rows_of(py, arguments, cores, &[Work::Construction, Work::Distributor, Work::Nearest])?;
    let gradients = if options.gradient { 2 } else { 0 };
    let numbers = 4 + m * k + D + gradients * (m * (2 * dim + 1) + D + 1);
    // Once by grasps, and once in arrays.
    let row = ROW_BYTES.saturating_add((2 * size_of::<f64>() * numbers).saturating_mul(count));
    check_room("forces", arguments.batch, row).map_err(|error| to_python(py, &error))?;
    let of_row = |row: usize| {
        if shared { &wrenches[..] } else { &wrenches[row * count..(row + 1) * count] }
    };
    let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
    let found = on_all_cores(py, || forces_batch(0..arguments.batch, |_| m, grasp, make, of_row, options))?;
    let result = PyDict::new(py);
    let failed = found.iter().filter(|item| item.error.is_some()).count();
    check_room("errors", failed, ERROR_BYTES).map_err(|error| to_python(py, &error))?;
    let errors = PyDict::new(py);
    for (row, error) in found.iter().enumerate().filter_map(|(row, item)| Some((row, item.error.as_ref()?))) {
        if matches!(error, Error::OutOfMemory { .. }) {
            return Err(to_python(py, error));
        }
        errors.set_item(row, error.to_string())?;
    }
    let columns = Columns { py, rows: &found, batch: [arguments.batch, count] };
    columns.put(&result, "sigma", &[], |item| item.sigma.iter().copied())?;
    columns.put(&result, "forces", &[m, k], |item| item.forces.iter().copied())?;
    columns.put(&result, "residual", &[D], |item| item.residual.iter().copied())?;
    columns.put(&result, "distance", &[], |item| item.distance.iter().copied())?;
    columns.put(&result, "gap", &[], |item| item.gap.iter().copied())?;
    columns.put(&result, "balanced", &[], |item| item.balanced.iter().copied())?;
    columns.put(&result, "status", &[], |item| item.status.iter().map(|&status| status as i8))?;
    result.set_item("errors", errors)?;
    let gradient = |which: fn(&GraspForces) -> Option<&GraspForceGradients>, wanted: bool| {
        if !wanted {
            return Ok(None);
        }
        let gradient = PyDict::new(py);
        let of = |field: fn(&GraspForceGradients) -> &[f64]| {
            move |item| which(item).map_or(&[][..], field).iter().copied()
        };
        columns.put(&gradient, "positions", &[m, dim], of(|gradients| &gradients.positions))?;
        columns.put(&gradient, "normals", &[m, dim], of(|gradients| &gradients.normals))?;
        columns.put(&gradient, "spins", &[m], of(|gradients| &gradients.spins))?;
        columns.put(&gradient, "external_wrench", &[D], of(|gradients| &gradients.external_wrench))?;
        let unique = |item| which(item).map_or(&[][..], |gradients| &gradients.unique).iter().copied();
        columns.put(&gradient, "unique", &[], unique)?;
        PyResult::Ok(Some(gradient))
    };
    let nearest = options.nearest.is_some();
    result.set_item("gradient", gradient(|item| item.gradient.as_ref(), options.gradient)?)?;
    let distance = gradient(|item| item.distance_gradient.as_ref(), options.gradient && nearest)?;
    result.set_item("distance_gradient", distance)?;
    Ok(result)
}

/// Makes arrays of what the grasps of a batch have in rows.
struct Columns<'a, 'py> {
    py: Python<'py>,
    rows: &'a [GraspForces],
    batch: [usize; 2],
}

impl<'a, 'py> Columns<'a, 'py> {
    fn put<T: Element, I: Iterator<Item = T>>(
        &self,
        into: &Bound<'py, PyDict>,
        name: &'static str,
        shape: &[usize],
        field: impl Fn(&'a GraspForces) -> I,
    ) -> PyResult<()> {
        let shape = [&self.batch, shape].concat();
        let values = self.rows.iter().flat_map(field);
        let flat = vector(self.py, name, shape.iter().product(), values)?;
        into.set_item(name, flat.reshape(shape)?)
    }
}
