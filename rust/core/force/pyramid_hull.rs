//! Pyramids around true friction cones: what they cannot balance, the cones cannot.
//!
//! Column generation over true cones takes a hundred times as long to prove that nothing balances a wrench as the simplex
//! method takes over pyramids. Of many wrenches for one grasp, all that follow the first failure ask the pyramids first.

use std::f64::consts::PI;

use crate::error::{Error, Result};
use crate::force::distributor::ForceDistributor;
use crate::force::solution::Distribution;
use crate::force::workspace::ForceWorkspace;
use crate::grasp::contact::ForceModel;
use crate::grasp::{Grasp, Wrench};
use crate::wrench_set::Criterion;

/// Edges of a pyramid.
const EDGES: usize = 8;

/// The pyramids of one grasp, made when the first wrench fails.
#[derive(Debug, Default)]
pub(crate) struct PyramidHull<const D: usize> {
    around: Option<(ForceDistributor<D>, ForceWorkspace<D>)>,
    /// Nothing more can be told of this grasp.
    unknown: bool,
}

impl<const D: usize> PyramidHull<D> {
    /// What [`ForceDistributor::solve`] answers.
    pub(crate) fn solve(
        &mut self,
        distributor: &ForceDistributor<D>,
        workspace: &mut ForceWorkspace<D>,
        wrench: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        if let Some(error) = self.separates(wrench) {
            return Err(error);
        }
        let squares = distributor.squares_options();
        if squares.is_some_and(|squares| squares.slack.is_some()) {
            return distributor.solve(workspace, wrench);
        }
        if self.unknown || squares.is_none() {
            let solved = distributor.solve(workspace, wrench);
            if solved.as_ref().is_err_and(Error::is_infeasible) {
                self.surround(distributor.grasp());
            }
            return solved;
        }
        let solved = distributor.problem.try_solve(&mut workspace.all, wrench);
        let Err(Error::NotConverged { .. }) = solved else { return solved };
        self.surround(distributor.grasp());
        match self.separates(wrench) {
            Some(error) => Err(error),
            None => distributor.solve(workspace, wrench),
        }
    }

    /// Why nothing balances the wrench, where the pyramids tell.
    fn separates(&mut self, wrench: &Wrench<D>) -> Option<Error> {
        let (around, workspace) = self.around.as_mut()?;
        around.solve(workspace, wrench).err().filter(Error::is_infeasible)
    }

    fn surround(&mut self, grasp: &Grasp<D>) {
        if self.around.is_some() || self.unknown {
            return;
        }
        let hard = |contact: &crate::Contact| contact.forces == ForceModel::Cone && contact.torsion == 0.0;
        let pyramids = grasp.contacts().iter().map(|contact| {
            let friction = contact.friction / (PI / EDGES as f64).cos() * (1.0 + 4.0 * f64::EPSILON);
            crate::Contact { friction, ..contact.clone().edges(EDGES) }
        });
        let options = crate::GraspOptions { friction_margin: 1.0, ..*grasp.options() };
        let made = if grasp.contacts().iter().all(hard) {
            let pyramids: Vec<_> = pyramids.collect();
            Grasp::with_options(&pyramids, options)
                .and_then(|grasp| ForceDistributor::new(&grasp, Criterion::Sum))
                .ok()
        } else {
            None
        };
        self.unknown = made.is_none();
        self.around = made.map(|distributor| {
            let workspace = distributor.workspace();
            (distributor, workspace)
        });
    }
}
