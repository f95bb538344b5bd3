//! The distributor: one grasp, one objective, any number of external wrenches (section 4, Eqs. 11 and 24 to 31).

use std::sync::Arc;

use crate::error::{Error, Result, digits};
use crate::force::limits::{Limited, Request};
use crate::force::nearest::options::NearestOptions;
use crate::force::problem::Problem;
use crate::force::program::Program;
use crate::force::solution::{Distribution, DistributionOptions};
use crate::force::squares::options::SquaresOptions;
use crate::force::workspace::ForceWorkspace;
use crate::grasp::contact::ContactForce;
use crate::grasp::{Grasp, REPRESENTABLE, Wrench};
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
    pub(crate) problem: Problem<D>,
    /// The limits that were set.
    limited: Option<Arc<Limited<D>>>,
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
        Ok(Self { problem: Problem::shares(grasp, objective, options)?, limited: None })
    }

    /// Minimises `sum_i weights_i |f_i - reference_i|^2 / 2`. The optimal forces are unique and change continuously
    /// with wrench, limits and reference.
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
        Ok(Self { problem: Problem::squares(grasp, squares)?, limited: None })
    }

    /// A workspace that remembers no wrench yet.
    pub fn workspace(&self) -> ForceWorkspace<D> {
        ForceWorkspace { all: self.problem.workspace(), limited: None }
    }

    /// Goes on with another grasp, in which contacts have rolled or slid a little, or with more or fewer contacts. The
    /// workspace becomes one of that grasp. Over listed extreme forces without lower bounds it keeps the last basis, if
    /// contacts and edges are as many as before; least squares keep their multiplier. Limits are those of the new grasp. On
    /// an error nothing changes.
    pub fn update(&mut self, workspace: &mut ForceWorkspace<D>, grasp: &Grasp<D>) -> Result<()> {
        let updated = Self { problem: self.problem.with_grasp(grasp)?, limited: None };
        let mut fresh = updated.workspace();
        if workspace.all.belongs_to(&self.problem) {
            fresh.all.adopt(&workspace.all);
            fresh.all.adopt(workspace.last());
            if let Some(options) = workspace.last().nearest_options() {
                updated.prepare_nearest(&mut fresh, &options)?;
            }
        }
        (*self, *workspace) = (updated, fresh);
        Ok(())
    }

    /// Replaces the upper bounds of the normal forces, in N; zero switches a contact off. What earlier wrenches taught the
    /// workspace goes on. Shares are those of the new limits. On an error nothing changes.
    ///
    /// Extreme forces that were listed grow and shrink with their limit.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let feet = [-1.0, 0.0, 1.0].map(|x| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)));
    /// let mut distributor = ForceDistributor::new(&Grasp::<3>::new(&feet)?, Criterion::Max)?;
    /// let mut workspace = distributor.workspace();
    /// distributor.set_limits(&mut workspace, &[1.0, 0.0, 1.0])?;
    /// let answer = distributor.solve(&mut workspace, &Wrench::<3>::new(0.0, -1.0, 0.0))?;
    /// assert_eq!(answer.forces[1][0], 0.0);
    /// assert!((answer.forces[0][0] - 0.5).abs() < 1e-12);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn set_limits(&mut self, workspace: &mut ForceWorkspace<D>, limits: &[f64]) -> Result<()> {
        let contacts = self.grasp().num_contacts();
        let refused = |row, reason| Err(Error::InvalidInput { argument: "max_normal_force", row, reason });
        if limits.len() != contacts {
            return refused(None, format!("{} limits for {contacts} contacts", limits.len()));
        }
        if let Some(row) = limits.iter().position(|limit| !(*limit == 0.0 || REPRESENTABLE.contains(limit))) {
            return refused(
                Some(row),
                format!("{} must be zero, or within 1e-140 to 1e140 N", digits(limits[row])),
            );
        }
        let limited = Limited::new(&self.problem, limits)?;
        self.claim(workspace);
        limited.adopt(&workspace.all, &mut workspace.limited)?;
        self.limited = Some(Arc::new(limited));
        Ok(())
    }

    /// Replaces the reference of least squares, which takes no other objective; empty for zero. The multiplier of the last
    /// wrench and the limits in force stay. On an error nothing changes.
    pub fn set_reference(
        &mut self,
        workspace: &mut ForceWorkspace<D>,
        reference: &[ContactForce],
    ) -> Result<()> {
        let Program::Squares(squares, _) = &self.problem.program else {
            return Err(Error::input("reference", "only the objective \"squares\" takes it"));
        };
        let squares = SquaresOptions { reference: reference.to_vec(), ..squares.as_ref().clone() };
        let problem = Problem::squares(self.grasp(), squares)?;
        let limited = match &self.limited {
            Some(limited) => Some(Arc::new(Limited::new(&problem, &limited.limits)?)),
            None => None,
        };
        self.claim(workspace);
        let updated = Self { problem, limited };
        let mut fresh = updated.workspace();
        fresh.all.adopt(&workspace.all);
        fresh.limited = workspace.limited.take();
        if let Some(limited) = &updated.limited {
            limited.adopt(&fresh.all, &mut fresh.limited)?;
        }
        (*self, *workspace) = (updated, fresh);
        Ok(())
    }

    /// The limits that [`Self::set_limits`] was given last, in N; `None` where the grasp's are in force.
    pub fn changed_limits(&self) -> Option<Vec<f64>> {
        self.limited.as_ref().map(|limited| limited.limits.clone())
    }

    /// The upper bounds of the normal forces that are in force, in N.
    pub fn limits(&self) -> Vec<f64> {
        let own = || self.grasp().contacts().iter().map(|contact| contact.max_normal_force).collect();
        self.changed_limits().unwrap_or_else(own)
    }

    /// The grasp whose forces are distributed.
    pub fn grasp(&self) -> &Grasp<D> {
        &self.problem.grasp
    }

    /// The points that [`Method::Reduced`](crate::Method::Reduced) keeps, as indices into the
    /// [`MinkowskiSum`](crate::MinkowskiSum) (with [`Criterion::Sum`], into the primitive wrenches); `None` with other
    /// methods.
    pub fn reduced_points(&self) -> Option<&[u32]> {
        if let Program::Shares(_, program) = &self.problem.program { program.reduced_points() } else { None }
    }

    /// What is minimised; `None` for least squares.
    pub fn objective(&self) -> Option<Criterion> {
        self.problem.program.criterion()
    }

    /// The options of least squares; `None` for other objectives.
    pub fn squares_options(&self) -> Option<&SquaresOptions<D>> {
        self.problem.program.squares()
    }

    /// The options in force.
    pub fn options(&self) -> &DistributionOptions {
        &self.problem.options
    }

    /// Least contact forces that balance `external_wrench`: `sum_i G_i f_i = -w_ext` (Eq. 11).
    pub fn solve(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        self.claim(workspace);
        match &self.limited {
            None => self.problem.solve(&mut workspace.all, external_wrench),
            Some(limited) => {
                limited.answer(self.grasp(), &mut workspace.limited, external_wrench, Request::Balance)
            }
        }
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
        self.claim(workspace);
        match &self.limited {
            None => self.problem.solve_into(&mut workspace.all, external_wrench, forces),
            Some(of) => {
                let (grasp, request) = (self.grasp(), Request::Balance);
                let limited = &mut workspace.limited;
                let answer = of.answer_into(grasp, limited, external_wrench, request, forces);
                answer.map(|(value, _)| value)
            }
        }
    }

    /// The forces whose wrench comes nearest to balance, the least among those: [`Self::solve`]'s where that succeeds
    /// within the limits.
    ///
    /// `residual` is what stays unbalanced and `distance` its norm. `gap` is the larger of two: the objective's at the
    /// wrench that the forces balance, and that of the distance, relative to the norm of the wrench.
    ///
    /// Every wrench has an answer. Where rounding leaves no tighter proof, the gap is larger than `rtol` and 1e-9: 1 if
    /// nothing is proven. After a search in 32 digits (`fell_back`) the forces are the least of all that come as near.
    /// Without limits the distance is proven for forces up to ten times as strong as those returned, or as one contact needs.
    ///
    /// ```
    /// use graspforce::{Contact, Criterion, ForceDistributor, Grasp, NearestOptions, Wrench};
    /// use nalgebra::Vector3;
    ///
    /// let fingers = [(-1.0, 1.0), (1.0, -1.0)].map(|(x, n)| {
    ///     Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)).friction(0.5).max_normal_force(4.0)
    /// });
    /// let distributor = ForceDistributor::new(&Grasp::<3>::new(&fingers)?, Criterion::Max)?;
    /// // Two fingers of 4 N and friction 0.5 lift 4 N of a weight of 5 N.
    /// let weight = Wrench::<3>::new(0.0, -5.0, 0.0);
    /// let nearest = distributor.nearest(&mut distributor.workspace(), &weight, &NearestOptions::default())?;
    /// assert!((nearest.distance - 1.0).abs() < 1e-9);
    /// assert!((nearest.forces[0][0] - 4.0).abs() < 1e-6);
    /// # Ok::<(), graspforce::Error>(())
    /// ```
    pub fn nearest(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
    ) -> Result<Distribution<D>> {
        self.claim(workspace);
        match &self.limited {
            None => self.problem.nearest(&mut workspace.all, external_wrench, options),
            Some(limited) => {
                let request = Request::Nearest(options);
                limited.answer(self.grasp(), &mut workspace.limited, external_wrench, request)
            }
        }
    }

    /// Makes the workspace ready for nearest forces with these options, so that the first wrench needs no memory. It stays
    /// so when limits or grasp change.
    pub fn prepare_nearest(
        &self,
        workspace: &mut ForceWorkspace<D>,
        options: &NearestOptions<D>,
    ) -> Result<()> {
        self.claim(workspace);
        self.problem.prepare_nearest(&mut workspace.all, options)?;
        match &self.limited {
            None => Ok(()),
            Some(limited) => limited.adopt(&workspace.all, &mut workspace.limited),
        }
    }

    /// The same as [`Self::nearest`], written as [`Self::solve_into`] does; returns the distance. With a workspace that is
    /// [ready](Self::prepare_nearest) nothing is allocated where the faces of the nearest wrench alone determine the forces,
    /// as they mostly do beyond the limits.
    pub fn nearest_into(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
        forces: &mut [f64],
    ) -> Result<f64> {
        self.nearest_into_with_gap(workspace, external_wrench, options, forces).map(|(distance, _)| distance)
    }

    /// The same; returns the distance and the gap, as [`Self::nearest`] explains it.
    pub fn nearest_into_with_gap(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
        forces: &mut [f64],
    ) -> Result<(f64, f64)> {
        self.check_rows(forces)?;
        self.claim(workspace);
        match &self.limited {
            None => self.problem.nearest_into(&mut workspace.all, external_wrench, options, forces),
            Some(limited) => {
                let request = Request::Nearest(options);
                limited.answer_into(self.grasp(), &mut workspace.limited, external_wrench, request, forces)
            }
        }
    }

    /// The gap up to which nearest forces count as proven: `rtol`, or 1e-9 if that is less.
    pub(crate) fn proven_gap(&self) -> f64 {
        self.problem.proven_gap()
    }

    /// Refuses an array that does not hold the components of all forces.
    fn check_rows(&self, forces: &[f64]) -> Result<()> {
        let length = self.grasp().num_contacts() * self.grasp().force_dim();
        if forces.len() != length {
            let reason = format!("{} numbers, expected {length}", forces.len());
            return Err(Error::input("forces", reason));
        }
        Ok(())
    }

    /// Replaces the workspace of another distributor.
    fn claim(&self, workspace: &mut ForceWorkspace<D>) {
        if !workspace.all.belongs_to(&self.problem) {
            *workspace = self.workspace();
        }
        if self.limited.is_none() && workspace.limited.is_some() {
            workspace.limited = None;
        }
    }
}
