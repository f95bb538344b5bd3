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
use crate::convert::views::{Layout, Views};
use crate::force::construction::{distributor, refuse_beside_squares};
use crate::force::distribution_options::{distribution_options, parse_objective};
use crate::force::nearest::nearest_options;
use crate::force::squares_arguments::SquaresArguments;
use crate::runtime::interrupt::on_all_cores;
use crate::runtime::memory::{Work, check_rows};

/// What Python takes for the reason of a row that is no grasp.
pub const ERROR_BYTES: usize = 512;

/// What a row takes beside its numbers.
const ROW_BYTES: usize = 1024;

/// Least forces of many grasps, as a dictionary of arrays; `graspforce.forces_many` documents the arguments.
#[pyfunction]
#[pyo3(signature = (positions, normals, external_wrenches, *, objective=Given::default(), weight=Given::default(),
    min_normal=None, rtol=Given::default(), reference=None, weights=None, slack=None, limits=Given::default(),
    infeasible=Given::default(), metric=None, gradient=Given::default(), offsets=None, **options))]
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
    offsets: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let raw = Raw::new("forces_many", &PyTuple::new(py, [positions, normals])?, options)?;
    let wrong = |message: String| invalid_input(py, message);
    let views = Views::of(&raw).map_err(|message| invalid_grasp(py, message))?;
    let layout = offsets.map_or(Ok(Layout::Batch), |offsets| Layout::ragged(offsets, views.rows()));
    let layout = layout.map_err(wrong)?;
    let arguments = Arguments::of(&raw, &views, layout).map_err(|message| invalid_grasp(py, message))?;
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
    let each = [
        ("min_normal", distribution.min_normal.len() > 1),
        ("reference", squares.reference.is_some()),
        ("weights", squares.weights.as_ref().is_some_and(|weights| weights.len() > 1)),
    ];
    if let Some((name, _)) = each.iter().find(|(_, given)| arguments.is_ragged() && *given) {
        return Err(wrong(format!("{name}: beside offsets only a number that all contacts share")));
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
    arguments: &Arguments<'_>,
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
    let (k, dim) = (options.force_dim, arguments.dim);
    let contacts = arguments.contacts * if arguments.is_ragged() { 1 } else { arguments.batch };
    let cores = available_parallelism().map_or(1, NonZero::get);
    check_rows(py, arguments, cores, Work::Distributor)?;
    check_rows(py, arguments, cores, Work::Nearest)?;
    let gradients = if options.gradient { 2 } else { 0 };
    let of_contact = k + gradients * (2 * dim + 1);
    let of_wrench = 4 + D + gradients * (D + 1);
    let numbers = (contacts * of_contact).saturating_add(arguments.batch * of_wrench).saturating_mul(count);
    // Once by grasps, and once in arrays.
    let bytes = numbers.saturating_mul(2 * size_of::<f64>()).saturating_add(arguments.batch * ROW_BYTES);
    check_room("forces", 1, bytes).map_err(|error| to_python(py, &error))?;
    let of_row = |row: usize| {
        if shared { &wrenches[..] } else { &wrenches[row * count..(row + 1) * count] }
    };
    let grasp = |row| Grasp::<D>::with_options(&arguments.contacts_of(row)?, arguments.options_of(row));
    let found = on_all_cores(py, || {
        let contacts = |row| arguments.contacts_in(row);
        forces_batch(0..arguments.batch, contacts, grasp, make, of_row, options)
    })?;
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
    let columns = Columns { py, rows: &found, arguments, wrenches: count };
    columns.put(&result, "sigma", &[], |item| item.sigma.iter().copied())?;
    columns.put_contacts(&result, "forces", &[k], |item| &item.forces)?;
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
        let of = |field: fn(&GraspForceGradients) -> &[f64]| move |item| which(item).map_or(&[][..], field);
        columns.put_contacts(&gradient, "positions", &[dim], of(|gradients| &gradients.positions))?;
        columns.put_contacts(&gradient, "normals", &[dim], of(|gradients| &gradients.normals))?;
        columns.put_contacts(&gradient, "spins", &[], of(|gradients| &gradients.spins))?;
        let wrench = |item| which(item).map_or(&[][..], |gradients| &gradients.external_wrench);
        columns.put(&gradient, "external_wrench", &[D], |item| wrench(item).iter().copied())?;
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
    arguments: &'a Arguments<'a>,
    wrenches: usize,
}

impl<'a, 'py> Columns<'a, 'py> {
    /// A field with entries of this shape for each grasp and wrench.
    fn put<T: Element, I: Iterator<Item = T>>(
        &self,
        into: &Bound<'py, PyDict>,
        name: &'static str,
        shape: &[usize],
        field: impl Fn(&'a GraspForces) -> I,
    ) -> PyResult<()> {
        let shape = [&[self.arguments.batch, self.wrenches], shape].concat();
        let values = self.rows.iter().flat_map(field);
        let flat = vector(self.py, name, shape.iter().product(), values)?;
        into.set_item(name, flat.reshape(shape)?)
    }

    /// A field with entries of this shape for each contact. In a ragged batch contacts come before wrenches.
    fn put_contacts(
        &self,
        into: &Bound<'py, PyDict>,
        name: &'static str,
        shape: &[usize],
        field: impl Fn(&'a GraspForces) -> &'a [f64],
    ) -> PyResult<()> {
        let (arguments, wrenches) = (self.arguments, self.wrenches);
        let width: usize = shape.iter().product();
        if !arguments.is_ragged() {
            let shape = [&[arguments.contacts], shape].concat();
            return self.put(into, name, &shape, |item| field(item).iter().copied());
        }
        let values = self.rows.iter().enumerate().flat_map(|(row, item)| {
            let (entries, contacts) = (field(item), arguments.contacts_in(row));
            (0..contacts * wrenches).flat_map(move |at| {
                let (contact, wrench) = (at / wrenches, at % wrenches);
                entries[(wrench * contacts + contact) * width..][..width].iter().copied()
            })
        });
        let shape = [&[arguments.contacts, wrenches], shape].concat();
        let flat = vector(self.py, name, shape.iter().product(), values)?;
        into.set_item(name, flat.reshape(shape)?)
    }
}
