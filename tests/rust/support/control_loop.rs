//! A distributor with one workspace that remembers all its wrenches, as a control loop holds them.

use std::cell::RefCell;
use std::ops::Deref;

use graspforce::{
    Criterion, Distribution, DistributionBatch, DistributionOptions, ForceDistributor, ForceWorkspace, Grasp,
    Result, Wrench,
};

#[derive(Debug)]
pub struct ControlLoop<const D: usize> {
    distributor: ForceDistributor<D>,
    workspace: RefCell<ForceWorkspace<D>>,
}

impl<const D: usize> ControlLoop<D> {
    pub fn new(grasp: &Grasp<D>, objective: Criterion) -> Result<Self> {
        Self::with_options(grasp, objective, DistributionOptions::default())
    }

    pub fn with_options(
        grasp: &Grasp<D>,
        objective: Criterion,
        options: DistributionOptions,
    ) -> Result<Self> {
        let distributor = ForceDistributor::with_options(grasp, objective, options)?;
        let workspace = RefCell::new(distributor.workspace());
        Ok(Self { distributor, workspace })
    }

    pub fn solve(&self, external: &Wrench<D>) -> Result<Distribution<D>> {
        self.distributor.solve(&mut self.workspace.borrow_mut(), external)
    }

    pub fn solve_into(&self, external: &Wrench<D>, forces: &mut [f64]) -> Result<f64> {
        self.distributor.solve_into(&mut self.workspace.borrow_mut(), external, forces)
    }

    pub fn solve_many(&self, externals: &[Wrench<D>], parallel: bool) -> Result<DistributionBatch> {
        self.distributor.solve_many(&mut self.workspace.borrow_mut(), externals, parallel)
    }

    pub fn update(&mut self, grasp: &Grasp<D>) -> Result<()> {
        self.distributor.update(self.workspace.get_mut(), grasp)
    }

    pub fn forget(&self) {
        self.workspace.borrow_mut().forget();
    }

    /// The same distributor with a workspace that remembers nothing.
    pub fn cold(&self) -> Self {
        let workspace = RefCell::new(self.distributor.workspace());
        Self { distributor: self.distributor.clone(), workspace }
    }
}

impl<const D: usize> Deref for ControlLoop<D> {
    type Target = ForceDistributor<D>;

    fn deref(&self) -> &Self::Target {
        &self.distributor
    }
}
