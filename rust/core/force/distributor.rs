//! The distributor: one grasp, one objective, any number of external wrenches.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use crate::error::{Error, Result};
use crate::force::certificate::{Certificate, Found};
use crate::force::linear_cones::program::{LinearProgram, LinearWorkspace};
use crate::force::preload::program::{PreloadProgram, PreloadWorkspace, checked_bounds};
use crate::force::simplex::pricing::Objective;
use crate::force::solution::{Distribution, DistributionOptions, Method, check_options, check_wrench};
use crate::force::true_cones::program::{ConeProgram, ConeWorkspace};
use crate::grasp::contact::{ContactForce, contact_force};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::wrench_set::Criterion;

/// Computes least contact forces for one grasp and any number of external wrenches.
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
/// let answer = distributor.solve(&Wrench::<3>::new(0.0, -1.0, 0.0))?;
/// // Each finger lifts 0.5 N by friction and presses with 1 N of its 4 N.
/// assert!((answer.sigma_max - 0.25).abs() < 1e-12);
/// assert!((answer.forces[0][0] - 1.0).abs() < 1e-12);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug)]
pub struct ForceDistributor<const D: usize> {
    grasp: Arc<Grasp<D>>,
    objective: Criterion,
    options: DistributionOptions,
    program: Arc<Program<D>>,
    workspace: Mutex<Workspace<D>>,
}

/// The program of a grasp with finitely many extreme forces, with true cones, or with lower bounds.
#[derive(Debug)]
enum Program<const D: usize> {
    Linear(Box<LinearProgram<D>>),
    Cone(Box<ConeProgram<D>>),
    Preload(Box<PreloadProgram<D>>),
}

#[derive(Debug)]
enum Workspace<const D: usize> {
    Linear(Box<LinearWorkspace<D>>),
    Cone(Box<ConeWorkspace<D>>, Found),
    Preload(Box<PreloadWorkspace>, Found),
}

impl<const D: usize> Program<D> {
    fn workspace(&self, contacts: usize) -> Workspace<D> {
        match self {
            Self::Linear(program) => Workspace::Linear(Box::new(program.workspace())),
            Self::Cone(program) => Workspace::Cone(Box::new(program.workspace()), Found::new(contacts)),
            Self::Preload(program) => Workspace::Preload(Box::new(program.workspace()), Found::new(contacts)),
        }
    }
}

impl<const D: usize> Workspace<D> {
    fn forget(&mut self) {
        match self {
            Self::Linear(workspace) => workspace.forget(),
            Self::Cone(workspace, _) => workspace.forget(),
            Self::Preload(workspace, _) => workspace.forget(),
        }
    }
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
        let program_objective = Objective::new(objective, options.weight);
        let program = if let Some(bounds) = checked_bounds(grasp, &options)? {
            Program::Preload(Box::new(PreloadProgram::new(grasp, program_objective, &bounds, options.rtol)))
        } else if grasp.is_finite() {
            Program::Linear(Box::new(LinearProgram::new(grasp, program_objective, &options)?))
        } else if options.method == Method::Implicit {
            Program::Cone(Box::new(ConeProgram::new(grasp, program_objective, options.rtol)))
        } else {
            grasp.require_finite("points of the wrench set to list")?;
            return Err(Error::grasp("edges", "true cones have no points to list"));
        };
        let workspace = Mutex::new(program.workspace(grasp.num_contacts()));
        let (grasp, program) = (Arc::new(grasp.clone()), Arc::new(program));
        Ok(Self { grasp, objective, options, program, workspace })
    }

    /// Goes on with another grasp, in which contacts have rolled or slid a little: over listed extreme forces and
    /// without lower bounds the last basis is kept where contacts and edges are as many as before. On an error
    /// nothing changes.
    pub fn update(&mut self, grasp: &Grasp<D>) -> Result<()> {
        let mut updated = Self::with_options(grasp, self.objective, self.options.clone())?;
        let old = self.workspace.get_mut().unwrap_or_else(PoisonError::into_inner);
        let fresh = updated.workspace.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let (Program::Linear(new), Program::Linear(program)) = (&*updated.program, &*self.program)
            && let (Workspace::Linear(fresh), Workspace::Linear(old)) = (fresh, old)
            && new.matches(program)
        {
            new.adopt(fresh, old);
        }
        *self = updated;
        Ok(())
    }

    /// Forgets what earlier wrenches taught, so that the next solve starts cold. The answers do not change. While
    /// another thread solves, nothing is forgotten.
    pub fn forget(&self) {
        if let Ok(mut workspace) = self.workspace() {
            workspace.forget();
        }
    }

    /// The workspace, unless another thread solves in it. What a panic left there is forgotten.
    fn workspace(&self) -> Result<MutexGuard<'_, Workspace<D>>> {
        match self.workspace.try_lock() {
            Ok(workspace) => Ok(workspace),
            Err(TryLockError::WouldBlock) => Err(Error::Busy),
            Err(TryLockError::Poisoned(poisoned)) => {
                let mut workspace = poisoned.into_inner();
                workspace.forget();
                self.workspace.clear_poison();
                Ok(workspace)
            }
        }
    }

    /// The grasp whose forces are distributed.
    pub fn grasp(&self) -> &Grasp<D> {
        &self.grasp
    }

    /// The points that [`Method::Reduced`] keeps, as indices into the [`MinkowskiSum`](crate::MinkowskiSum)
    /// (with [`Criterion::Sum`], into the primitive wrenches); `None` with other methods.
    pub fn reduced_points(&self) -> Option<&[u32]> {
        match &*self.program {
            Program::Linear(program) => program.reduced.as_deref(),
            _ => None,
        }
    }

    /// What is minimised.
    pub fn objective(&self) -> Criterion {
        self.objective
    }

    /// The options in force.
    pub fn options(&self) -> &DistributionOptions {
        &self.options
    }

    /// Least contact forces that balance `external_wrench`: `sum_i G_i f_i = -w_ext` (Eq. 11).
    pub fn solve(&self, external_wrench: &Wrench<D>) -> Result<Distribution<D>> {
        if !self.preloaded() && external_wrench.iter().all(|x| *x == 0.0) {
            return Ok(nothing_to_balance(self.grasp.num_contacts(), self.options.rtol));
        }
        let mut workspace = self.workspace()?;
        let b = -external_wrench;
        match (&*self.program, &mut *workspace) {
            (Program::Linear(program), Workspace::Linear(workspace)) => {
                self.solve_linear(program, workspace, &b)
            }
            (program, workspace) => solve_cones(program, workspace, &b).map(|(answer, found)| {
                let (sigma_max, sigma_sum) = found.totals();
                Distribution {
                    forces: found.forces.clone(),
                    shares: found.normals.clone(),
                    sigma: answer.sigma,
                    sigma_max,
                    sigma_sum,
                    dual: answer.dual,
                    gap: answer.gap,
                    pivots: answer.pivots,
                    unique: found.unique,
                    fell_back: answer.fell_back,
                    residual: self.residual(&b, &found.forces),
                    tolerance: self.options.rtol,
                }
            }),
        }
        .map_err(|error| Self::named(error, external_wrench))
    }

    fn preloaded(&self) -> bool {
        matches!(&*self.program, Program::Preload(_))
    }

    /// A wrench that is not finite, or an interrupt, leads to some error or other; this is the one to see.
    fn named(error: Error, external_wrench: &Wrench<D>) -> Error {
        check_wrench(external_wrench).and_then(|()| interrupt::check()).err().unwrap_or(error)
    }

    fn solve_linear(
        &self,
        program: &LinearProgram<D>,
        workspace: &mut LinearWorkspace<D>,
        b: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        let m = self.grasp.num_contacts();
        let (region, pivots) = program.locate(workspace, b)?;
        let components = self.grasp.force_components();
        let mut rows = vec![0.0; m * components.len()];
        region.forces.multiply(b, &mut rows);
        let mut shares = vec![0.0; m];
        region.normals.multiply(b, &mut shares);
        let (sigma_max, sigma_sum) = region.totals(b);
        let (dual, gap) = region.proof(b);
        let forces: Vec<_> =
            rows.chunks(components.len()).map(|row| contact_force(row, components)).collect();
        Ok(Distribution {
            residual: self.residual(b, &forces),
            forces,
            shares,
            sigma: program.objective().value(sigma_max, sigma_sum),
            sigma_max,
            sigma_sum,
            dual,
            gap,
            pivots,
            unique: region.unique,
            fell_back: region.fell_back,
            tolerance: self.options.rtol,
        })
    }

    /// What forces leave of `b`, with the sign of the external wrench: `sum_i G_i f_i - b`.
    pub(crate) fn residual(&self, b: &Wrench<D>, forces: &[ContactForce]) -> Wrench<D> {
        self.grasp.maps().iter().zip(forces).fold(-b, |rest, (map, force)| rest + map * force)
    }

    /// The same, written as rows of [`Grasp::force_components`] into `forces`; returns the objective.
    ///
    /// Over listed extreme forces and without lower bounds nothing is allocated once the wrench's region is known. On
    /// an error `forces` is untouched.
    pub fn solve_into(&self, external_wrench: &Wrench<D>, forces: &mut [f64]) -> Result<f64> {
        let length = self.grasp.num_contacts() * self.grasp.force_dim();
        if forces.len() != length {
            let reason = format!("{} numbers, expected {length}", forces.len());
            return Err(Error::input("forces", reason));
        }
        let mut workspace = self.workspace()?;
        self.solve_in(&mut workspace, external_wrench, forces)
    }

    fn solve_in(
        &self,
        workspace: &mut Workspace<D>,
        external_wrench: &Wrench<D>,
        forces: &mut [f64],
    ) -> Result<f64> {
        let b = -external_wrench;
        if external_wrench.iter().all(|x| *x == 0.0) && !self.preloaded() {
            forces.fill(0.0);
            return Ok(0.0);
        }
        match (&*self.program, workspace) {
            (Program::Linear(program), Workspace::Linear(workspace)) => {
                program.locate(workspace, &b).map(|(region, _)| {
                    region.forces.multiply(&b, forces);
                    region.dual.dot(&b)
                })
            }
            (program, workspace) => solve_cones(program, workspace, &b).map(|(answer, found)| {
                let components = self.grasp.force_components();
                for (row, force) in forces.chunks_mut(components.len()).zip(&found.forces) {
                    for (x, &component) in row.iter_mut().zip(components) {
                        *x = force[component];
                    }
                }
                answer.sigma
            }),
        }
        .map_err(|error| Self::named(error, external_wrench))
    }
}

/// A distributor held for many solves in a row.
pub(crate) struct Session<'a, const D: usize> {
    distributor: &'a ForceDistributor<D>,
    workspace: MutexGuard<'a, Workspace<D>>,
}

impl<const D: usize> ForceDistributor<D> {
    pub(crate) fn session(&self) -> Result<Session<'_, D>> {
        let workspace = self.workspace()?;
        Ok(Session { distributor: self, workspace })
    }
}

impl<const D: usize> Session<'_, D> {
    /// Writes the forces; returns the largest normalised normal force and their sum.
    pub(crate) fn solve(&mut self, external_wrench: &Wrench<D>, forces: &mut [f64]) -> Result<(f64, f64)> {
        let sigma = self.distributor.solve_in(&mut self.workspace, external_wrench, forces)?;
        if sigma == 0.0 {
            return Ok((0.0, 0.0));
        }
        Ok(match &*self.workspace {
            Workspace::Linear(workspace) => workspace.latest().totals(&-external_wrench),
            Workspace::Cone(_, found) | Workspace::Preload(_, found) => found.totals(),
        })
    }
}

impl<const D: usize> Clone for ForceDistributor<D> {
    /// An independent distributor: it shares no workspace with this one.
    fn clone(&self) -> Self {
        Self {
            grasp: Arc::clone(&self.grasp),
            objective: self.objective,
            options: self.options.clone(),
            program: Arc::clone(&self.program),
            workspace: Mutex::new(self.program.workspace(self.grasp.num_contacts())),
        }
    }
}

/// Leaves the forces over true cones, or with lower bounds, in the workspace.
fn solve_cones<'a, const D: usize>(
    program: &Program<D>,
    workspace: &'a mut Workspace<D>,
    b: &Wrench<D>,
) -> Result<(Certificate<D>, &'a Found)> {
    match (program, workspace) {
        (Program::Cone(program), Workspace::Cone(workspace, found)) => {
            Ok((program.solve(workspace, b, found)?, found))
        }
        (Program::Preload(program), Workspace::Preload(workspace, found)) => {
            Ok((program.solve(workspace, b, found)?, found))
        }
        _ => Err(Error::Busy),
    }
}

fn nothing_to_balance<const D: usize>(contacts: usize, tolerance: f64) -> Distribution<D> {
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
        tolerance,
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use nalgebra::Vector3;

    use super::*;
    use crate::grasp::contact::Contact;

    #[test]
    fn a_panic_while_solving_is_forgotten_and_the_next_solve_answers() {
        let fingers = [(-1.0, 1.0), (1.0, -1.0)]
            .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
        let distributor = ForceDistributor::new(&Grasp::<3>::new(&fingers).unwrap(), Criterion::Max).unwrap();
        let weight = Wrench::<3>::new(0.0, -1.0, 0.0);
        let expected = distributor.solve(&weight).unwrap();
        let held = catch_unwind(AssertUnwindSafe(|| {
            let _workspace = distributor.workspace().unwrap();
            std::panic::resume_unwind(Box::new("while the workspace is held"));
        }));
        assert!(held.is_err());
        assert_eq!(distributor.solve(&weight).unwrap(), expected);
        let _held = distributor.workspace().unwrap();
        assert_eq!(distributor.solve(&weight), Err(Error::Busy));
    }
}
