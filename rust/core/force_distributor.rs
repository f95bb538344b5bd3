//! The distributor: one grasp, one objective, any number of external wrenches.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::columns::Objective;
use crate::cone_program::{ConeAnswer, ConeProgram, ConeWorkspace};
use crate::contact::ContactForce;
use crate::distribution::{Distribution, DistributionOptions, Method, check_options, check_wrench};
use crate::error::{Error, Result};
use crate::grasp::{Grasp, Wrench};
use crate::interrupt;
use crate::law::objective_value;
use crate::linear_program::{LinearProgram, LinearWorkspace};
use crate::preload::{Found, PreloadProgram, PreloadWorkspace, checked_bounds};
use crate::region::UNBALANCED;
use crate::wrench_set::Criterion;

/// What forces may leave unbalanced, as a share of what is at work.
const BALANCED: f64 = 1e-7;

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
    Cone(ConeProgram<D>),
    Preload(PreloadProgram<D>),
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

    fn objective(&self) -> Objective {
        match self {
            Self::Linear(program) => program.objective(),
            Self::Cone(program) => program.objective(),
            Self::Preload(program) => program.objective(),
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
            Program::Preload(PreloadProgram::new(grasp, program_objective, &bounds, options.tolerance))
        } else if grasp.is_finite() {
            Program::Linear(Box::new(LinearProgram::new(grasp, program_objective, &options)?))
        } else if options.method == Method::Implicit {
            Program::Cone(ConeProgram::new(grasp, program_objective, options.tolerance))
        } else {
            grasp.require_finite("points of the wrench set to list")?;
            return Err(Error::grasp("edges", "true cones have no points to list"));
        };
        let workspace = Mutex::new(program.workspace(grasp.num_contacts()));
        let (grasp, program) = (Arc::new(grasp.clone()), Arc::new(program));
        Ok(Self { grasp, objective, options, program, workspace })
    }

    /// Goes on with another grasp, in which contacts have rolled or slid a little: the last basis is kept where
    /// contacts and edges are as many as before. On an error nothing changes.
    pub fn update(&mut self, grasp: &Grasp<D>) -> Result<()> {
        let mut updated = Self::with_options(grasp, self.objective, self.options.clone())?;
        let old = self.workspace.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let (Program::Linear(new), Program::Linear(program), Workspace::Linear(old)) =
            (&*updated.program, &*self.program, old)
            && new.matches(program)
        {
            updated.workspace = Mutex::new(Workspace::Linear(Box::new(new.adopt(old))));
        }
        *self = updated;
        Ok(())
    }

    /// Forgets what earlier wrenches taught, so that the next solve starts cold. The answers do not change.
    pub fn forget(&self) {
        if let Ok(mut workspace) = self.workspace.try_lock() {
            match &mut *workspace {
                Workspace::Linear(workspace) => workspace.forget(),
                Workspace::Cone(workspace, _) => workspace.forget(),
                Workspace::Preload(workspace, _) => workspace.forget(),
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
        let preloaded = matches!(&*self.program, Program::Preload(_));
        if !preloaded && external_wrench.iter().all(|x| *x == 0.0) {
            return Ok(nothing_to_balance(self.grasp.num_contacts()));
        }
        let mut workspace = self.workspace.try_lock().map_err(|_| Error::Busy)?;
        let b = -external_wrench;
        match (&*self.program, &mut *workspace) {
            (Program::Linear(program), Workspace::Linear(workspace)) => {
                self.solve_linear(program, workspace, &b)
            }
            (program, workspace) => self.solve_cones(program, workspace, &b).map(|(answer, found)| {
                let (sigma_max, sigma_sum) = found.totals();
                let sigma = objective_value(program.objective(), sigma_max, sigma_sum);
                Distribution {
                    forces: found.forces.clone(),
                    sigma,
                    sigma_max,
                    sigma_sum,
                    dual: answer.dual,
                    gap: answer.gap.max((1.0 - answer.sigma / sigma).abs()),
                    pivots: answer.pivots,
                    unique: found.unique,
                    fell_back: answer.fell_back,
                }
            }),
        }
        .map_err(|error| named(error, external_wrench))
    }

    /// Leaves the forces over true cones, or with lower bounds, in the workspace.
    fn solve_cones<'a>(
        &self,
        program: &Program<D>,
        workspace: &'a mut Workspace<D>,
        b: &Wrench<D>,
    ) -> Result<(ConeAnswer<D>, &'a Found)> {
        let (answer, found) = match (program, workspace) {
            (Program::Cone(program), Workspace::Cone(workspace, found)) => {
                (program.solve(workspace, b, found)?, found)
            }
            (Program::Preload(program), Workspace::Preload(workspace, found)) => {
                (program.solve(workspace, b, found)?, found)
            }
            _ => return Err(Error::Busy),
        };
        let gap = unbalanced_share(&self.grasp, b, &found.forces);
        if gap <= BALANCED {
            return Ok((answer, found));
        }
        Err(Error::NotConverged { solver: "balance of forces", iterations: answer.pivots, gap })
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
        let mut normals = vec![0.0; m];
        region.forces.multiply(b, &mut rows);
        region.normals.multiply(b, &mut normals);
        let sigma_max = normals.iter().copied().fold(0.0, f64::max);
        let sigma_sum = normals.iter().sum();
        let sigma = objective_value(program.objective(), sigma_max, sigma_sum);
        let lower = region.dual.dot(b) / region.reach;
        Ok(Distribution {
            forces: rows.chunks(components.len()).map(|row| contact_force(row, components)).collect(),
            sigma,
            sigma_max,
            sigma_sum,
            dual: region.dual,
            gap: ((sigma - lower) / sigma).abs(),
            pivots,
            unique: region.unique,
            fell_back: region.fell_back,
        })
    }

    /// The same, written as rows of [`Grasp::force_components`] into `forces`; returns the objective.
    ///
    /// Nothing is allocated once the wrench's region is known, and on an error `forces` is untouched.
    pub fn solve_into(&self, external_wrench: &Wrench<D>, forces: &mut [f64]) -> Result<f64> {
        let length = self.grasp.num_contacts() * self.grasp.force_dim();
        if forces.len() != length {
            let reason = format!("{} numbers, expected {length}", forces.len());
            return Err(Error::input("forces", reason));
        }
        let mut workspace = self.workspace.try_lock().map_err(|_| Error::Busy)?;
        self.solve_in(&mut workspace, external_wrench, forces)
    }

    fn solve_in(
        &self,
        workspace: &mut Workspace<D>,
        external_wrench: &Wrench<D>,
        forces: &mut [f64],
    ) -> Result<f64> {
        let b = -external_wrench;
        let preloaded = matches!(&*self.program, Program::Preload(_));
        let solved = match (&*self.program, workspace) {
            (Program::Linear(program), Workspace::Linear(workspace)) => {
                program.locate(workspace, &b).map(|(region, _)| {
                    region.forces.multiply(&b, forces);
                    region.dual.dot(&b)
                })
            }
            (program, workspace) => self.solve_cones(program, workspace, &b).map(|(answer, found)| {
                let components = self.grasp.force_components();
                for (row, force) in forces.chunks_mut(components.len()).zip(&found.forces) {
                    for (x, &component) in row.iter_mut().zip(components) {
                        *x = force[component];
                    }
                }
                answer.sigma
            }),
        };
        match solved {
            Err(_) if !preloaded && external_wrench.iter().all(|x| *x == 0.0) => {
                forces.fill(0.0);
                Ok(0.0)
            }
            solved => solved.map_err(|error| named(error, external_wrench)),
        }
    }
}

/// A distributor held for many solves in a row.
pub(crate) struct Session<'a, const D: usize> {
    distributor: &'a ForceDistributor<D>,
    workspace: MutexGuard<'a, Workspace<D>>,
    normals: Vec<f64>,
}

impl<const D: usize> ForceDistributor<D> {
    pub(crate) fn session(&self) -> Result<Session<'_, D>> {
        let workspace = self.workspace.try_lock().map_err(|_| Error::Busy)?;
        Ok(Session { distributor: self, workspace, normals: vec![0.0; self.grasp.num_contacts()] })
    }
}

impl<const D: usize> Session<'_, D> {
    /// Writes the forces; returns the largest normalised normal force and their sum.
    pub(crate) fn solve(&mut self, external_wrench: &Wrench<D>, forces: &mut [f64]) -> Result<(f64, f64)> {
        let sigma = self.distributor.solve_in(&mut self.workspace, external_wrench, forces)?;
        if sigma == 0.0 {
            return Ok((0.0, 0.0));
        }
        match &*self.workspace {
            Workspace::Linear(workspace) => {
                workspace.latest().normals.multiply(&-external_wrench, &mut self.normals);
            }
            Workspace::Cone(_, found) | Workspace::Preload(_, found) => return Ok(found.totals()),
        }
        let levels = self.normals.iter();
        Ok(levels.fold((0.0, 0.0), |(largest, sum), level| (f64::max(largest, *level), sum + level)))
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

/// What forces leave unbalanced, as a share of what they and the wrench exert: of forces and torques the larger. The
/// simplex measures rounding by the strongest contact, which may be far stronger than what is at work.
fn unbalanced_share<const D: usize>(grasp: &Grasp<D>, b: &Wrench<D>, forces: &[ContactForce]) -> f64 {
    let (mut rest, mut effort) = (-b, b.abs());
    for (map, force) in grasp.maps().iter().zip(forces) {
        rest += map * force;
        effort += map.abs() * force.abs();
    }
    let split = if D == 3 { 2 } else { 3 };
    let levers = grasp.maps().iter().map(|map| map.rows_range(split..).amax());
    let lever = Some(levers.fold(0.0, f64::max)).filter(|lever| *lever > 0.0).unwrap_or(1.0);
    let sizes = |w: &Wrench<D>| (w.rows_range(..split).amax(), w.rows_range(split..).amax());
    let ((force, torque), (pressed, turned)) = (sizes(&rest), sizes(&effort));
    // What no contact can act on is rounding of the whole wrench, in units of the longest lever.
    let allowance = UNBALANCED / BALANCED;
    let share =
        |rest: f64, own: f64, other: f64| if rest > 0.0 { rest / (own + allowance * other) } else { 0.0 };
    share(force, pressed, turned / lever).max(share(torque, turned, pressed * lever))
}

/// A wrench that is not finite, or an interrupt, leads to some error or other; this is the one to see.
fn named<const D: usize>(error: Error, external_wrench: &Wrench<D>) -> Error {
    check_wrench(external_wrench).and_then(|()| interrupt::check()).err().unwrap_or(error)
}

fn contact_force(row: &[f64], components: &[usize]) -> ContactForce {
    let mut force = ContactForce::zeros();
    for (&component, x) in components.iter().zip(row) {
        force[component] = *x;
    }
    force
}

fn nothing_to_balance<const D: usize>(contacts: usize) -> Distribution<D> {
    Distribution {
        forces: vec![ContactForce::zeros(); contacts],
        sigma: 0.0,
        sigma_max: 0.0,
        sigma_sum: 0.0,
        dual: Wrench::zeros(),
        gap: 0.0,
        pivots: 0,
        unique: true,
        fell_back: false,
    }
}
