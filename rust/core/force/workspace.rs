//! The buffers in which a distributor solves, with the bases and critical regions of earlier wrenches.

use crate::force::limits::LimitedWorkspace;
use crate::force::problem::ProblemWorkspace;

/// The memory of a [`ForceDistributor`](crate::ForceDistributor): buffers, and the bases and regions of earlier
/// wrenches, from which the next solve starts.
///
/// [`ForceDistributor::workspace`](crate::ForceDistributor::workspace) creates it. A distributor that is given the
/// workspace of another one replaces it by a new one of its own. The answers do not depend on what it remembers.
#[derive(Debug, Clone)]
pub struct ForceWorkspace<const D: usize> {
    /// That of all contacts, with the limits of the grasp.
    pub(crate) all: ProblemWorkspace<D>,
    /// That of the contacts that are on, where limits were set.
    pub(crate) limited: Option<Box<LimitedWorkspace<D>>>,
}

impl<const D: usize> ForceWorkspace<D> {
    /// Forgets earlier wrenches, so that the next solve starts cold. The answers do not change.
    pub fn forget(&mut self) {
        self.limited = None;
        self.all.forget();
    }

    /// The workspace of the last answer.
    pub(crate) fn last(&self) -> &ProblemWorkspace<D> {
        self.limited.as_ref().map_or(&self.all, |limited| &limited.active)
    }
}
