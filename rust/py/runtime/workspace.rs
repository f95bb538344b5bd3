//! Workspaces of quality queries, one for each thread and dimension.

use std::cell::Cell;
use std::thread::LocalKey;

use graspforce::{Grasp, Quality, QualityOptions, QualityWorkspace};
use pyo3::prelude::*;

use crate::convert::errors::to_python;
use crate::runtime::interrupt::detached;
use crate::runtime::memory::{Work, check_work};

thread_local! {
    static PLANAR: Cell<Option<QualityWorkspace<3>>> = const { Cell::new(None) };
    static SPATIAL: Cell<Option<QualityWorkspace<6>>> = const { Cell::new(None) };
}

/// Takes the workspace for as long as it is used: a signal handler may compute qualities meanwhile.
fn with_workspace<W: Default, R>(
    kept: &'static LocalKey<Cell<Option<W>>>,
    body: impl FnOnce(&mut W) -> R,
) -> R {
    let mut workspace = kept.take().unwrap_or_default();
    let result = body(&mut workspace);
    kept.set(Some(workspace));
    result
}

/// Dimensions that keep a workspace for each thread.
pub trait Workspace: Sized {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R;
}

impl Workspace for QualityWorkspace<3> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        with_workspace(&PLANAR, body)
    }
}

impl Workspace for QualityWorkspace<6> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        with_workspace(&SPATIAL, body)
    }
}

/// Computes a quality in this thread's workspace, without the interpreter.
pub fn quality_of<const D: usize>(
    py: Python<'_>,
    grasp: &Grasp<D>,
    options: &QualityOptions<D>,
) -> PyResult<Quality<D>>
where
    QualityWorkspace<D>: Workspace,
{
    check_work(py, grasp, Work::Quality)?;
    detached(py, || QualityWorkspace::<D>::with(|workspace| grasp.quality_with(options, workspace)))?
        .map_err(|error| to_python(py, &error))
}
