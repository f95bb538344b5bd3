//! Calls of a distributor: wrenches in, forces out.

use graspforce::{Distribution, Error, ForceDistributor, ForceWorkspace, Method, NearestOptions, Wrench};
use numpy::PyUntypedArrayMethods;
use pyo3::intern;
use pyo3::prelude::*;

use crate::convert::arrays::{contents, float_array, output_array, shaped, vectors};
use crate::convert::errors::{invalid_input, to_python};
use crate::force::batch::PyForceBatch;
use crate::force::shared::{SharedDistributor, unless_busy};
use crate::runtime::interrupt::{detached, on_all_cores, watched};
use crate::runtime::memory::{Work, check_work};

/// The forces for one wrench.
pub fn solve<const D: usize>(
    py: Python<'_>,
    shared: &SharedDistributor<D>,
    external_wrench: &[f64],
) -> PyResult<Distribution<D>> {
    let wrench = Wrench::<D>::from_column_slice(external_wrench);
    check_work(py, shared.distributor.grasp(), Work::Solve)?;
    let work = || shared.solve(|distributor, workspace| distributor.solve(workspace, &wrench));
    // Listed points take long enough for others to want the interpreter.
    let implicit = shared.distributor.options().method == Method::Implicit;
    let solved = if implicit { watched(work) } else { detached(py, work) };
    unless_busy(py, solved?)?.map_err(|error| raised(py, &error, &shared.distributor))
}

/// The same, written into an array of the caller's; returns the objective.
pub fn solve_into<const D: usize>(
    py: Python<'_>,
    shared: &SharedDistributor<D>,
    external_wrench: &Bound<'_, PyAny>,
    forces: &Bound<'_, PyAny>,
) -> PyResult<f64> {
    let solve = |distributor: &ForceDistributor<D>, workspace: &mut _, wrench: &_, rows: &mut _| {
        distributor.solve_into(workspace, wrench, rows)
    };
    written(py, shared, (external_wrench, forces), Work::Solve, solve)?
        .map_err(|error| raised(py, &error, &shared.distributor))
}

/// Runs a call that writes the forces for a wrench into an array of the caller's.
pub fn written<const D: usize, T>(
    py: Python<'_>,
    shared: &SharedDistributor<D>,
    (external_wrench, forces): (&Bound<'_, PyAny>, &Bound<'_, PyAny>),
    work: Work,
    call: impl FnOnce(
        &ForceDistributor<D>,
        &mut ForceWorkspace<D>,
        &Wrench<D>,
        &mut [f64],
    ) -> graspforce::Result<T>,
) -> PyResult<graspforce::Result<T>> {
    let refused = |message: String| invalid_input(py, message);
    let array = float_array("external_wrench", external_wrench).map_err(refused)?;
    if array.shape() != [D] {
        let message = format!("external_wrench: shape {}, expected ({D},)", shaped(array.shape()));
        return Err(refused(message));
    }
    let wrench = Wrench::<D>::from_column_slice(contents(&array));
    let grasp = shared.distributor.grasp();
    check_work(py, grasp, work)?;
    // A view of the wrench that is also a view of the forces would change while it is read.
    drop(array);
    let mut forces = output_array(forces, grasp.num_contacts(), grasp.force_dim()).map_err(refused)?;
    let Ok(rows) = forces.as_slice_mut() else { return Err(refused("forces: not C-contiguous".into())) };
    let run = || shared.solve(|distributor, workspace| call(distributor, workspace, &wrench, rows));
    unless_busy(py, watched(run)?)
}

/// The exception for an error, which says where contacts that are off may be the reason.
fn raised<const D: usize>(py: Python<'_>, error: &Error, distributor: &ForceDistributor<D>) -> PyErr {
    let raised = to_python(py, error);
    let limits = distributor.changed_limits().filter(|_| error.is_infeasible()).unwrap_or_default();
    let off = limits.iter().enumerate().filter(|(_, limit)| **limit == 0.0);
    let off: Vec<String> = off.map(|(contact, _)| contact.to_string()).collect();
    if off.is_empty() {
        return raised;
    }
    let message = format!("{error}; set_limits switched off contacts {}", off.join(", "));
    raised.value(py).setattr(intern!(py, "args"), (message,)).err().unwrap_or(raised)
}

/// The forces for many wrenches.
pub fn solve_many<const D: usize>(
    py: Python<'_>,
    shared: &SharedDistributor<D>,
    external_wrenches: &Bound<'_, PyAny>,
    parallel: bool,
    nearest: bool,
) -> PyResult<PyForceBatch> {
    let array =
        float_array("external_wrenches", external_wrenches).map_err(|message| invalid_input(py, message))?;
    if array.shape().len() != 2 || array.shape()[1] != D {
        let message = format!("external_wrenches: shape {}, expected (T, {D})", shaped(array.shape()));
        return Err(invalid_input(py, message));
    }
    let work = if nearest { Work::Nearest } else { Work::Solve };
    check_work(py, shared.distributor.grasp(), work)?;
    let wrenches = vectors::<D>("external_wrenches", &array)?;
    let work = || {
        shared.solve(|distributor, workspace| {
            if nearest {
                distributor.nearest_many(workspace, &wrenches, &NearestOptions::default(), parallel)
            } else {
                distributor.solve_many(workspace, &wrenches, parallel)
            }
        })
    };
    let batch = if parallel { on_all_cores(py, work) } else { detached(py, work) }?;
    let batch = unless_busy(py, batch)?.map_err(|error| to_python(py, &error))?;
    PyForceBatch::new(py, shared.distributor.grasp(), batch)
}
