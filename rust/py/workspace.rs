//! Workspaces of quality queries, one for each thread and dimension.

use std::cell::RefCell;

use graspforce::{Grasp, Quality, QualityOptions, QualityWorkspace};
use pyo3::prelude::*;

use crate::errors::to_python;

thread_local! {
    static PLANAR: RefCell<QualityWorkspace<3>> = RefCell::default();
    static SPATIAL: RefCell<QualityWorkspace<6>> = RefCell::default();
}

/// Dimensions that keep a workspace for each thread.
pub trait Workspace: Sized {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R;
}

impl Workspace for QualityWorkspace<3> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        PLANAR.with_borrow_mut(body)
    }
}

impl Workspace for QualityWorkspace<6> {
    fn with<R>(body: impl FnOnce(&mut Self) -> R) -> R {
        SPATIAL.with_borrow_mut(body)
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
    py.detach(|| QualityWorkspace::<D>::with(|workspace| grasp.quality_with(options, workspace)))
        .map_err(|error| to_python(py, &error))
}
