//! A distributor whose workspace one thread at a time uses.

use std::sync::Mutex;

use graspforce::{ContactForce, ForceDistributor, ForceWorkspace, Grasp, Result};
use pyo3::prelude::*;

use crate::convert::errors::busy;
use crate::runtime::thread_pool::lock;

/// A distributor with its workspace.
pub struct SharedDistributor<const D: usize> {
    pub distributor: ForceDistributor<D>,
    workspace: Mutex<ForceWorkspace<D>>,
}

impl<const D: usize> SharedDistributor<D> {
    pub fn new(distributor: ForceDistributor<D>) -> Self {
        let workspace = Mutex::new(distributor.workspace());
        Self { distributor, workspace }
    }

    /// Solves in the workspace; `None` while another thread solves. A panic leaves a workspace that remembers nothing.
    pub fn solve<R>(
        &self,
        solve: impl FnOnce(&ForceDistributor<D>, &mut ForceWorkspace<D>) -> R,
    ) -> Option<R> {
        if self.workspace.is_poisoned() {
            lock(&self.workspace)?.forget();
        }
        lock(&self.workspace).map(|mut workspace| solve(&self.distributor, &mut workspace))
    }

    /// Replaces the upper bounds of the normal forces.
    pub fn set_limits(&mut self, limits: &[f64]) -> Result<()> {
        let (distributor, workspace) = self.parts();
        distributor.set_limits(workspace, limits)
    }

    /// Replaces the reference of least squares.
    pub fn set_reference(&mut self, reference: &[ContactForce]) -> Result<()> {
        let (distributor, workspace) = self.parts();
        distributor.set_reference(workspace, reference)
    }

    /// Goes on with another grasp.
    pub fn update(&mut self, grasp: &Grasp<D>) -> Result<()> {
        let (distributor, workspace) = self.parts();
        distributor.update(workspace, grasp)
    }

    fn parts(&mut self) -> (&mut ForceDistributor<D>, &mut ForceWorkspace<D>) {
        let workspace = self.workspace.get_mut().unwrap_or_else(|poisoned| {
            let workspace = poisoned.into_inner();
            workspace.forget();
            workspace
        });
        (&mut self.distributor, workspace)
    }
}

impl<const D: usize> Clone for SharedDistributor<D> {
    /// Shares what does not change while solving, and no workspace.
    fn clone(&self) -> Self {
        Self::new(self.distributor.clone())
    }
}

/// The result of [`SharedDistributor::solve`], or a `BusyError`.
pub fn unless_busy<R>(py: Python<'_>, solved: Option<R>) -> PyResult<R> {
    solved.ok_or_else(|| busy(py))
}
