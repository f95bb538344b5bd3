//! A distributor with its workspace, whatever the dimension.

use graspforce_core::{ForceDistributor, ForceWorkspace, Grasp, NearestOptions, Wrench, write_components};

use crate::distributor_options::DistributorOptions;
use crate::fault::{Fault, Outcome};
use crate::grasp::AnyGrasp;
use crate::memory::check_length;
use crate::solution::Solution;

/// Which forces are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Question {
    /// Those that balance the wrench.
    Balance,
    /// Those whose wrench comes nearest to balance.
    Nearest,
}

/// The calls of a distributor.
pub(crate) trait ControlLoop {
    /// Number of contacts times components of a force.
    fn num_forces(&self) -> usize;

    /// Forces row by row, and their distance. `solution` gets what is known beside them, also about an error.
    fn compute(
        &mut self,
        question: Question,
        external_wrench: &[f64],
        solution: Option<&mut Solution>,
    ) -> Outcome<(&[f64], f64)>;

    /// Goes on with other upper bounds of the normal forces, in N.
    fn set_limits(&mut self, limits: &[f64]) -> Outcome<()>;

    /// Goes on with another grasp.
    fn update(&mut self, grasp: &AnyGrasp) -> Outcome<()>;

    /// Forgets earlier wrenches.
    fn forget(&mut self);
}

/// A distributor of a grasp of either dimension.
///
/// # Safety
///
/// The pointers of the options keep the header's rules.
pub(crate) unsafe fn control_loop(
    grasp: &AnyGrasp,
    options: &DistributorOptions,
) -> Outcome<Box<dyn ControlLoop>> {
    // SAFETY: the caller's promise.
    Ok(unsafe {
        match grasp {
            AnyGrasp::Planar(grasp) => Box::new(Loop::<3>::new(grasp, options)?),
            AnyGrasp::Spatial(grasp) => Box::new(Loop::<6>::new(grasp, options)?),
        }
    })
}

/// A distributor with its workspace, and the rows of its last forces.
struct Loop<const D: usize> {
    distributor: ForceDistributor<D>,
    workspace: ForceWorkspace<D>,
    nearest: NearestOptions<D>,
    rows: Vec<f64>,
}

impl<const D: usize> Loop<D> {
    /// # Safety
    ///
    /// The pointers of the options keep the header's rules.
    unsafe fn new(grasp: &Grasp<D>, options: &DistributorOptions) -> Outcome<Self> {
        // SAFETY: the caller's promise.
        let (distributor, nearest) = unsafe { (options.distributor(grasp)?, options.nearest()?) };
        let mut workspace = distributor.workspace();
        distributor.prepare_nearest(&mut workspace, &nearest)?;
        let rows = vec![0.0; grasp.num_contacts() * grasp.force_dim()];
        Ok(Self { distributor, workspace, nearest, rows })
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

    fn compute(
        &mut self,
        question: Question,
        external_wrench: &[f64],
        solution: Option<&mut Solution>,
    ) -> Outcome<(&[f64], f64)> {
        check_length("external_wrench", external_wrench.len(), D)?;
        let wrench = Wrench::<D>::from_column_slice(external_wrench);
        let Self { distributor, workspace, nearest, rows } = self;
        let Some(solution) = solution else {
            let distance = match question {
                Question::Balance => distributor.solve_into(workspace, &wrench, rows).map(|_| 0.0),
                Question::Nearest => distributor.nearest_into(workspace, &wrench, nearest, rows),
            }?;
            return Ok((rows, distance));
        };
        let found = match question {
            Question::Balance => distributor.solve(workspace, &wrench),
            Question::Nearest => distributor.nearest(workspace, &wrench, nearest),
        };
        let found = found.inspect_err(|error| *solution = error.into())?;
        *solution = (&found).into();
        write_components(&found.forces, distributor.grasp().force_components(), rows);
        Ok((rows, found.distance))
    }

    fn set_limits(&mut self, limits: &[f64]) -> Outcome<()> {
        check_length("max_normal_force", limits.len(), self.distributor.grasp().num_contacts())?;
        Ok(self.distributor.set_limits(&mut self.workspace, limits)?)
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
