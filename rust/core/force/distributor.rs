//! The distributor: one grasp, one objective, any number of external wrenches (section 4, Eqs. 11 and 24 to 31).

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::force::certificate::exact_rest;
use crate::force::limits::Limited;
use crate::force::linear_cones::program::LinearProgram;
use crate::force::preload::program::{PreloadProgram, checked_bounds};
use crate::force::simplex::pricing::Objective;
use crate::force::solution::{Distribution, DistributionOptions, Method, check_options, check_wrench};
use crate::force::squares::options::SquaresOptions;
use crate::force::squares::program::SquaresProgram;
use crate::force::true_cones::program::ConeProgram;
use crate::force::workspace::{ForceWorkspace, Program};
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::tolerances::LARGE_FORCES;
use crate::wrench_set::Criterion;

/// Computes least contact forces for one grasp and any number of external wrenches.
///
/// A distributor does not change while it solves: threads share it, each with a [`ForceWorkspace`] of its own.
///
/// ```
/// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, Wrench};
/// use nalgebra::Vector3;
///
/// // Two fingers squeeze a disc of radius 1 from left and right and carry 1 N of weight.
/// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5).max_normal_force(4.0)
/// });
/// let grasp = Grasp::<3>::new(&fingers)?;
/// let distributor = ForceDistributor::new(&grasp, Criterion::Max)?;
/// let mut workspace = distributor.workspace();
/// let answer = distributor.solve(&mut workspace, &Wrench::<3>::new(0.0, -1.0, 0.0))?;
/// // Each finger lifts 0.5 N by friction and presses with 1 N of its 4 N.
/// assert!((answer.sigma_max - 0.25).abs() < 1e-12);
/// assert!((answer.forces[0][0] - 1.0).abs() < 1e-12);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ForceDistributor<const D: usize> {
    grasp: Arc<Grasp<D>>,
    objective: Option<Criterion>,
    options: DistributionOptions,
    squares: Option<SquaresOptions<D>>,
    program: Program<D>,
    /// The limits that were set.
    pub(crate) limited: Option<Arc<Limited<D>>>,
}

impl<const D: usize> ForceDistributor<D> {
    /// Minimises the maximum (then the sum) or the sum of normalised normal forces of a grasp.
    pub fn new(grasp: &Grasp<D>, objective: Criterion) -> Result<Self> {
        Self::with_options(grasp, objective, DistributionOptions::default())
    }

    /// A distributor with its method, weight and limits.
    pub fn with_options(
        grasp: &Grasp<D>,
        objective: Criterion,
        options: DistributionOptions,
    ) -> Result<Self> {
        check_options(&options, objective)?;
        let minimised = Objective::new(objective, options.weight);
        let program = if let Some(bounds) = checked_bounds(grasp, &options)? {
            Program::Preload(Arc::new(PreloadProgram::new(grasp, minimised, &bounds, options.rtol)))
        } else if grasp.is_finite() {
            Program::Linear(Arc::new(LinearProgram::new(grasp, minimised, &options)?))
        } else if options.method == Method::Implicit {
            Program::Cone(Arc::new(ConeProgram::new(grasp, minimised, options.rtol)))
        } else {
            grasp.require_finite("points of the wrench set to list")?;
            return Err(Error::grasp("edges", "true cones have no points to list"));
        };
        let objective = Some(objective);
        Ok(Self { grasp: Arc::new(grasp.clone()), objective, options, squares: None, program, limited: None })
    }

    /// Minimises `sum_i weights_i |f_i - reference_i|^2 / 2`. The forces are the only ones, and change continuously with
    /// wrench, limits and reference.
    ///
    /// ```
    /// use graspforce::{Contact, ForceDistributor, Grasp, SquaresOptions, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5).max_normal_force(4.0)
    /// });
    /// let grasp = Grasp::<3>::new(&fingers)?;
    /// let distributor = ForceDistributor::squares(&grasp, SquaresOptions::default())?;
    /// let answer = distributor.solve(&mut distributor.workspace(), &Wrench::<3>::new(0.0, -1.0, 0.0))?;
    /// assert!((answer.forces[0][0] - 1.0).abs() < 1e-12);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn squares(grasp: &Grasp<D>, squares: SquaresOptions<D>) -> Result<Self> {
        let grasp = Arc::new(grasp.clone());
        let program = Program::Squares(Arc::new(SquaresProgram::new(&grasp, &squares)?));
        let (min_normal, rtol) = (squares.min_normal.clone(), squares.rtol);
        let options = DistributionOptions { rtol, min_normal, ..DistributionOptions::default() };
        Ok(Self { grasp, objective: None, options, squares: Some(squares), program, limited: None })
    }

    /// A workspace that remembers no wrench yet.
    pub fn workspace(&self) -> ForceWorkspace<D> {
        ForceWorkspace::new(&self.grasp, &self.program)
    }

    /// Goes on with another grasp, in which contacts have rolled or slid a little, or with more or fewer contacts. The
    /// workspace becomes one of that grasp. Over listed extreme forces without lower bounds it keeps the last basis, if
    /// contacts and edges are as many as before; least squares keep their multiplier. Limits are those of the new grasp. On
    /// an error nothing changes.
    pub fn update(&mut self, workspace: &mut ForceWorkspace<D>, grasp: &Grasp<D>) -> Result<()> {
        let updated = match (&self.squares, self.objective) {
            (Some(squares), _) => Self::squares(grasp, squares.clone())?,
            (None, objective) => {
                Self::with_options(grasp, objective.unwrap_or(Criterion::Max), self.options.clone())?
            }
        };
        let mut fresh = updated.workspace();
        if workspace.belongs_to(&self.grasp) {
            fresh.adopt(workspace);
            if let Some(limited) = &workspace.limited {
                fresh.adopt(limited.inner());
            }
        }
        (*self, *workspace) = (updated, fresh);
        Ok(())
    }

    /// The grasp whose forces are distributed.
    pub fn grasp(&self) -> &Grasp<D> {
        &self.grasp
    }

    /// The points that [`Method::Reduced`] keeps, as indices into the [`MinkowskiSum`](crate::MinkowskiSum)
    /// (with [`Criterion::Sum`], into the primitive wrenches); `None` with other methods.
    pub fn reduced_points(&self) -> Option<&[u32]> {
        match &self.program {
            Program::Linear(program) => program.reduced.as_deref(),
            _ => None,
        }
    }

    /// What is minimised; `None` for least squares.
    pub fn objective(&self) -> Option<Criterion> {
        self.objective
    }

    /// The options of least squares; `None` for other objectives.
    pub fn squares_options(&self) -> Option<&SquaresOptions<D>> {
        self.squares.as_ref()
    }

    /// The options in force.
    pub fn options(&self) -> &DistributionOptions {
        &self.options
    }

    /// Least contact forces that balance `external_wrench`: `sum_i G_i f_i = -w_ext` (Eq. 11).
    pub fn solve(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        if let Some(limited) = &self.limited {
            self.claim(workspace);
            return limited.solve(workspace, external_wrench);
        }
        if self.needs_no_forces(external_wrench) {
            return Ok(no_forces(self.grasp.num_contacts(), self.options.rtol));
        }
        self.claim(workspace);
        let b = -external_wrench;
        let answer = workspace.solve(&b).map_err(|error| cause(error, external_wrench))?;
        let (sigma_max, sigma_sum) = workspace.totals(&b);
        let forces = &workspace.forces;
        Ok(Distribution {
            forces: forces.forces.clone(),
            shares: forces.shares.clone(),
            sigma: answer.sigma,
            sigma_max,
            sigma_sum,
            dual: answer.dual,
            gap: answer.gap,
            pivots: answer.pivots,
            unique: forces.unique,
            fell_back: answer.fell_back,
            residual: self.residual(&b, &forces.forces),
            distance: 0.0,
            tolerance: self.options.rtol,
        })
    }

    /// The same, written as rows of [`Grasp::force_components`] into `forces`; returns the objective.
    ///
    /// Without lower bounds nothing is allocated once the wrench's region is known (over listed extreme forces), or from
    /// the start (over true cones, where nothing falls back). On an error `forces` is untouched.
    pub fn solve_into(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        forces: &mut [f64],
    ) -> Result<f64> {
        self.check_rows(forces)?;
        if let Some(limited) = &self.limited {
            self.claim(workspace);
            return limited.write(&self.grasp, workspace, external_wrench, None, forces);
        }
        if self.needs_no_forces(external_wrench) {
            forces.fill(0.0);
            return Ok(0.0);
        }
        self.claim(workspace);
        workspace.solve_into(&-external_wrench, forces).map_err(|error| cause(error, external_wrench))
    }

    /// Refuses an array that does not hold the components of all forces.
    pub(crate) fn check_rows(&self, forces: &[f64]) -> Result<()> {
        let length = self.grasp.num_contacts() * self.grasp.force_dim();
        if forces.len() != length {
            let reason = format!("{} numbers, expected {length}", forces.len());
            return Err(Error::input("forces", reason));
        }
        Ok(())
    }

    /// The grasp, shared.
    pub(crate) fn shared_grasp(&self) -> &Arc<Grasp<D>> {
        &self.grasp
    }

    /// Lower and upper bounds of the share of each contact.
    pub(crate) fn bounds(&self) -> Vec<(f64, f64)> {
        let least = |i: usize| match self.options.min_normal[..] {
            [] => 0.0,
            [all] => all,
            ref each => each[i],
        };
        (0..self.grasp.num_contacts()).map(|i| (least(i), 1.0)).collect()
    }

    /// The objective of least squares; zero with other objectives.
    pub(crate) fn squared(&self, forces: &[ContactForce]) -> f64 {
        if let Program::Squares(program) = &self.program { program.dual.objective(forces) } else { 0.0 }
    }

    /// What forces leave of `b`, with the sign of the external wrench: `sum_i G_i f_i - b`.
    pub(crate) fn residual(&self, b: &Wrench<D>, forces: &[ContactForce]) -> Wrench<D> {
        let contacts = self.grasp.maps().iter().zip(forces);
        let largest = forces.iter().fold(0.0_f64, |largest, force| largest.max(force.amax()));
        if largest > LARGE_FORCES * b.amax() {
            return -exact_rest(b, contacts.map(|(map, force)| (map, *force)));
        }
        contacts.fold(-b, |rest, (map, force)| rest + map * force)
    }

    /// Whether the wrench is zero and no contact has a lower bound.
    pub(crate) fn needs_no_forces(&self, external_wrench: &Wrench<D>) -> bool {
        external_wrench.iter().all(|x| *x == 0.0)
            && !matches!(self.program, Program::Preload(_) | Program::Squares(_))
    }

    /// Replaces the workspace of another distributor.
    pub(crate) fn claim(&self, workspace: &mut ForceWorkspace<D>) {
        if !workspace.belongs_to(&self.grasp) {
            *workspace = self.workspace();
        }
        if self.limited.is_none() && workspace.limited.is_some() {
            workspace.limited = None;
        }
    }
}

/// A wrench that is not finite, or an interrupt, leads to one error or another; this is the one to report.
fn cause<const D: usize>(error: Error, external_wrench: &Wrench<D>) -> Error {
    check_wrench(external_wrench).and_then(|()| interrupt::check()).err().unwrap_or(error)
}

pub(crate) fn no_forces<const D: usize>(contacts: usize, tolerance: f64) -> Distribution<D> {
    Distribution {
        forces: vec![ContactForce::zeros(); contacts],
        shares: vec![0.0; contacts],
        sigma: 0.0,
        sigma_max: 0.0,
        sigma_sum: 0.0,
        dual: Wrench::zeros(),
        gap: 0.0,
        pivots: 0,
        unique: true,
        fell_back: false,
        residual: Wrench::zeros(),
        distance: 0.0,
        tolerance,
    }
}
