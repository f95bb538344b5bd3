//! A distributor with its workspace, whatever the dimension.

use graspforce_core::{Criterion, DistributionOptions, ForceDistributor, ForceWorkspace, Grasp, Wrench};

use crate::fault::{Fault, Outcome};
use crate::grasp::AnyGrasp;
use crate::memory::check_length;
use crate::solution::Solution;

/// The calls of a distributor.
pub(crate) trait ControlLoop {
    /// Number of contacts times components of a force.
    fn num_forces(&self) -> usize;

    /// Least forces, row by row.
    fn solve(&mut self, external_wrench: &[f64]) -> Outcome<&[f64]>;

    /// The same, with what it says beside the forces, also about an error.
    fn solve_with(&mut self, external_wrench: &[f64], solution: &mut Solution) -> Outcome<&[f64]>;

    /// Goes on with another grasp.
    fn update(&mut self, grasp: &AnyGrasp) -> Outcome<()>;

    /// Forgets earlier wrenches.
    fn forget(&mut self);
}

/// A distributor of a grasp of either dimension.
pub(crate) fn control_loop(
    grasp: &AnyGrasp,
    objective: Criterion,
    options: DistributionOptions,
) -> Outcome<Box<dyn ControlLoop>> {
    Ok(match grasp {
        AnyGrasp::Planar(grasp) => Box::new(Loop::<3>::new(grasp, objective, options)?),
        AnyGrasp::Spatial(grasp) => Box::new(Loop::<6>::new(grasp, objective, options)?),
    })
}

/// A distributor with its workspace, and the rows of its last forces.
struct Loop<const D: usize> {
    distributor: ForceDistributor<D>,
    workspace: ForceWorkspace<D>,
    rows: Vec<f64>,
}

impl<const D: usize> Loop<D> {
    fn new(grasp: &Grasp<D>, objective: Criterion, options: DistributionOptions) -> Outcome<Self> {
        let distributor = ForceDistributor::with_options(grasp, objective, options)?;
        let workspace = distributor.workspace();
        Ok(Self { distributor, workspace, rows: vec![0.0; grasp.num_contacts() * grasp.force_dim()] })
    }
}

/// The grasp of this dimension.
trait OfDimension<const D: usize> {
    fn of_dimension(&self) -> Option<&Grasp<D>>;
}

impl OfDimension<3> for AnyGrasp {
    fn of_dimension(&self) -> Option<&Grasp<3>> {
        if let Self::Planar(grasp) = self { Some(grasp) } else { None }
    }
}

impl OfDimension<6> for AnyGrasp {
    fn of_dimension(&self) -> Option<&Grasp<6>> {
        if let Self::Spatial(grasp) = self { Some(grasp) } else { None }
    }
}

impl<const D: usize> ControlLoop for Loop<D>
where
    AnyGrasp: OfDimension<D>,
{
    fn num_forces(&self) -> usize {
        self.rows.len()
    }

    fn solve(&mut self, external_wrench: &[f64]) -> Outcome<&[f64]> {
        check_length("external_wrench", external_wrench.len(), D)?;
        let wrench = Wrench::<D>::from_column_slice(external_wrench);
        self.distributor.solve_into(&mut self.workspace, &wrench, &mut self.rows)?;
        Ok(&self.rows)
    }

    fn solve_with(&mut self, external_wrench: &[f64], solution: &mut Solution) -> Outcome<&[f64]> {
        check_length("external_wrench", external_wrench.len(), D)?;
        let wrench = Wrench::<D>::from_column_slice(external_wrench);
        let found = self.distributor.solve(&mut self.workspace, &wrench);
        let found = found.inspect_err(|error| *solution = error.into())?;
        *solution = (&found).into();
        let components = self.distributor.grasp().force_components();
        for (row, force) in self.rows.chunks_exact_mut(components.len()).zip(&found.forces) {
            for (x, &component) in row.iter_mut().zip(components) {
                *x = force[component];
            }
        }
        Ok(&self.rows)
    }

    fn update(&mut self, grasp: &AnyGrasp) -> Outcome<()> {
        let grasp = grasp.of_dimension().ok_or(Fault::Argument(
            "grasp",
            "planar for a spatial distributor, or spatial for a planar one",
        ))?;
        self.distributor.update(&mut self.workspace, grasp)?;
        self.rows.resize(grasp.num_contacts() * grasp.force_dim(), 0.0);
        Ok(())
    }

    fn forget(&mut self) {
        self.workspace.forget();
    }
}
