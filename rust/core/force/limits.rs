//! Limits that change while a controller runs: contacts fade in and out, and one with a limit of zero is switched off.
//!
//! The contacts that are on make a grasp of their own, which a problem of the same objective answers. What earlier
//! wrenches taught it goes on: the last basis while the same contacts are on, and the multipliers of least squares
//! always. Bases of sets of contacts that were on before are kept for their return.

use crate::error::Result;
use crate::force::certificate::infeasible;
use crate::force::nearest::options::NearestOptions;
use crate::force::problem::{Problem, ProblemWorkspace};
use crate::force::program::Program;
use crate::force::solution::{Distribution, check_wrench};
use crate::force::squares::options::SquaresOptions;
use crate::grasp::contact::{Contact, ContactForce, ForceModel};
use crate::grasp::{Grasp, GraspOptions, Wrench};

/// Sets of contacts whose bases are kept.
const KEPT_SETS: usize = 8;

/// Which forces are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Request<'a, const D: usize> {
    /// Those that balance the wrench.
    Balance,
    /// Those whose wrench comes nearest to balance.
    Nearest(&'a NearestOptions<D>),
}

/// The contacts that are on, with the limits in force.
#[derive(Debug, Clone)]
pub(crate) struct Limited<const D: usize> {
    /// The limits of all contacts in N.
    pub(crate) limits: Vec<f64>,
    /// Contacts that are on.
    active: Vec<usize>,
    /// None where all are off.
    problem: Option<Problem<D>>,
}

/// The workspace of the contacts that are on, and those of earlier sets of contacts.
#[derive(Debug, Clone)]
pub(crate) struct LimitedWorkspace<const D: usize> {
    contacts: Vec<usize>,
    pub(crate) active: ProblemWorkspace<D>,
    earlier: Vec<(Vec<usize>, ProblemWorkspace<D>)>,
    rows: Vec<f64>,
}

/// Empty before limits were set or used.
type Remembered<const D: usize> = Option<Box<LimitedWorkspace<D>>>;

impl<const D: usize> Limited<D> {
    /// `limits` are zero or positive.
    pub(crate) fn new(of: &Problem<D>, limits: &[f64]) -> Result<Self> {
        let active: Vec<usize> = (0..limits.len()).filter(|&i| limits[i] > 0.0).collect();
        if active.is_empty() {
            return Ok(Self { limits: limits.to_vec(), active, problem: None });
        }
        let contacts: Vec<Contact> =
            active.iter().map(|&i| with_limit(&of.grasp.contacts()[i], limits[i])).collect();
        // The contacts' friction is already divided by the margin.
        let margin = of.grasp.options().friction_margin;
        let options = GraspOptions { friction_margin: 1.0, ..*of.grasp.options() };
        let mut reduced = Grasp::<D>::with_options(&contacts, options)?;
        reduced.set_friction_margin(margin);
        let kept = |values: &[f64]| match values.len() {
            0 | 1 => values.to_vec(),
            _ => active.iter().map(|&i| values[i]).collect(),
        };
        let problem = match &of.program {
            Program::Shares(criterion, _) => {
                let mut options = of.options.clone();
                options.min_normal = kept(&options.min_normal);
                Problem::shares(&reduced, *criterion, options)?
            }
            Program::Squares(squares, _) => {
                let SquaresOptions { reference, weights, min_normal, .. } = squares.as_ref();
                let reference = match reference.len() {
                    0 => Vec::new(),
                    _ => active.iter().map(|&i| reference[i]).collect(),
                };
                let (weights, min_normal) = (kept(weights), kept(min_normal));
                let squares = SquaresOptions { reference, weights, min_normal, ..squares.as_ref().clone() };
                Problem::squares(&reduced, squares)?
            }
        };
        Ok(Self { limits: limits.to_vec(), active, problem: Some(problem) })
    }

    /// Goes on from the workspace of all contacts, or from that of the limits before. Where that one is ready for nearest
    /// forces, this one is, too.
    pub(crate) fn adopt(&self, all: &ProblemWorkspace<D>, workspace: &mut Remembered<D>) -> Result<()> {
        let Some(problem) = &self.problem else { return Ok(()) };
        let mut fresh = self.workspace(problem);
        let ready = workspace.as_ref().map_or(all, |last| &last.active).nearest_options();
        if let Some(options) = ready.or_else(|| all.nearest_options()) {
            problem.prepare_nearest(&mut fresh.active, &options)?;
        }
        match workspace.take() {
            None => fresh.active.adopt(all),
            Some(last) => {
                fresh.earlier = last.earlier;
                let known = fresh.earlier.iter().find(|(contacts, _)| *contacts == self.active);
                // The last multiplier of least squares, and the last basis where the same contacts are on.
                fresh.active.adopt(&last.active);
                if last.contacts != self.active
                    && problem.program.criterion().is_some()
                    && let Some((_, known)) = known
                {
                    fresh.active.adopt(known);
                }
                fresh.earlier.retain(|(contacts, _)| *contacts != last.contacts);
                let mut kept = last.active;
                kept.nearest = None;
                fresh.earlier.insert(0, (last.contacts, kept));
                fresh.earlier.truncate(KEPT_SETS);
            }
        }
        *workspace = Some(Box::new(fresh));
        Ok(())
    }

    fn workspace(&self, problem: &Problem<D>) -> LimitedWorkspace<D> {
        LimitedWorkspace {
            contacts: self.active.clone(),
            active: problem.workspace(),
            earlier: Vec::new(),
            rows: vec![0.0; problem.grasp.num_contacts() * problem.grasp.force_dim()],
        }
    }

    fn claim<'a>(
        &self,
        problem: &Problem<D>,
        workspace: &'a mut Remembered<D>,
    ) -> &'a mut LimitedWorkspace<D> {
        let known = workspace.get_or_insert_with(|| Box::new(self.workspace(problem)));
        if known.contacts != self.active {
            **known = self.workspace(problem);
        }
        known
    }

    /// Forces of all contacts; those of `grasp` that are off have none.
    pub(crate) fn answer(
        &self,
        grasp: &Grasp<D>,
        workspace: &mut Remembered<D>,
        external_wrench: &Wrench<D>,
        request: Request<'_, D>,
    ) -> Result<Distribution<D>> {
        let Some(problem) = &self.problem else {
            let distance = distance_without_contacts(grasp, external_wrench, request)?;
            let none = Distribution::without_forces(self.limits.len(), 0.0);
            return Ok(Distribution { residual: *external_wrench, distance, ..none });
        };
        let inner = &mut self.claim(problem, workspace).active;
        Ok(self.expanded(match request {
            Request::Balance => problem.solve(inner, external_wrench),
            Request::Nearest(options) => problem.nearest(inner, external_wrench, options),
        }?))
    }

    /// Writes the components that `grasp` has; returns the objective, or the distance of the nearest forces and its gap.
    pub(crate) fn answer_into(
        &self,
        grasp: &Grasp<D>,
        workspace: &mut Remembered<D>,
        external_wrench: &Wrench<D>,
        request: Request<'_, D>,
        forces: &mut [f64],
    ) -> Result<(f64, f64)> {
        let Some(problem) = &self.problem else {
            let distance = distance_without_contacts(grasp, external_wrench, request)?;
            forces.fill(0.0);
            return Ok((distance, 0.0));
        };
        let LimitedWorkspace { active, rows, .. } = self.claim(problem, workspace);
        let value = match request {
            Request::Balance => problem.solve_into(active, external_wrench, rows).map(|value| (value, 0.0)),
            Request::Nearest(options) => problem.nearest_into(active, external_wrench, options, rows),
        }?;
        self.spread(rows, &problem.grasp, grasp, forces);
        Ok(value)
    }

    /// The rows of the contacts that are on among those of all contacts.
    fn spread(&self, rows: &[f64], reduced: &Grasp<D>, grasp: &Grasp<D>, forces: &mut [f64]) {
        forces.fill(0.0);
        let (components, known) = (grasp.force_components(), reduced.force_components());
        for (row, &i) in rows.chunks(known.len()).zip(&self.active) {
            let place = &mut forces[i * components.len()..(i + 1) * components.len()];
            for (x, component) in row.iter().zip(known) {
                if let Some(at) = components.iter().position(|c| c == component) {
                    place[at] = *x;
                }
            }
        }
    }

    /// The same forces among all contacts.
    fn expanded(&self, mut found: Distribution<D>) -> Distribution<D> {
        let contacts = self.limits.len();
        let (mut forces, mut shares) = (vec![ContactForce::zeros(); contacts], vec![0.0; contacts]);
        for (&i, (force, share)) in self.active.iter().zip(found.forces.iter().zip(&found.shares)) {
            (forces[i], shares[i]) = (*force, *share);
        }
        (found.forces, found.shares) = (forces, shares);
        found
    }
}

/// How far a wrench is from balance where all contacts are off. Only the zero wrench is balanced.
fn distance_without_contacts<const D: usize>(
    grasp: &Grasp<D>,
    external_wrench: &Wrench<D>,
    request: Request<'_, D>,
) -> Result<f64> {
    check_wrench(external_wrench)?;
    if let Request::Nearest(options) = request {
        return Ok(options.metric_of(grasp).norm(external_wrench));
    }
    if external_wrench.amax() > 0.0 {
        return Err(infeasible(&-external_wrench));
    }
    Ok(0.0)
}

/// The contact with another limit.
fn with_limit(contact: &Contact, limit: f64) -> Contact {
    let mut contact = contact.clone();
    if let ForceModel::Extreme(forces) = &mut contact.forces {
        let scale = limit / contact.max_normal_force;
        for force in forces {
            *force *= scale;
        }
    }
    contact.max_normal_force = limit;
    contact
}
