//! Limits that change while a controller runs: contacts fade in and out, and one with a limit of zero is switched off.
//!
//! The contacts that are on make a grasp of their own, which a distributor of the same objective answers. What earlier
//! wrenches taught it goes on: the last basis while the same contacts are on, and the multipliers of least squares
//! always. Bases of sets of contacts that were on before are kept for their return.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::force::distributor::ForceDistributor;
use crate::force::nearest::answer::NearestOptions;
use crate::force::solution::{Distribution, check_wrench};
use crate::force::squares::options::SquaresOptions;
use crate::force::workspace::ForceWorkspace;
use crate::grasp::contact::{Contact, ContactForce, ForceModel};
use crate::grasp::wrench_norm::Metric;
use crate::grasp::{Grasp, GraspOptions, REPRESENTABLE, Wrench, unit};

/// Sets of contacts whose bases are kept.
const KEPT_SETS: usize = 8;

/// The contacts that are on, with the limits in force.
#[derive(Debug, Clone)]
pub(crate) struct Limited<const D: usize> {
    /// The limits of all contacts in N.
    pub(crate) limits: Vec<f64>,
    /// Contacts that are on.
    active: Vec<usize>,
    /// None where all are off.
    distributor: Option<ForceDistributor<D>>,
}

/// The workspace of the contacts that are on, and those of earlier sets of contacts.
#[derive(Debug, Clone)]
pub(crate) struct LimitedWorkspace<const D: usize> {
    active: Vec<usize>,
    inner: ForceWorkspace<D>,
    earlier: Vec<(Vec<usize>, ForceWorkspace<D>)>,
    rows: Vec<f64>,
}

impl<const D: usize> ForceDistributor<D> {
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
            return refused(Some(row), format!("{} must be zero, or within 1e-140 to 1e140 N", limits[row]));
        }
        let limited = Limited::new(self, limits)?;
        self.claim(workspace);
        if let Some(distributor) = &limited.distributor {
            let mut fresh = distributor.workspace();
            let mut earlier = Vec::new();
            match workspace.limited.take() {
                None => fresh.adopt(workspace),
                Some(last) => {
                    earlier = last.earlier;
                    if last.active != limited.active
                        && let Some((_, known)) = earlier.iter().find(|(active, _)| *active == limited.active)
                    {
                        fresh.adopt(known);
                    }
                    // The last multiplier of least squares, and the last basis where the same contacts are on.
                    fresh.adopt(&last.inner);
                    earlier.retain(|(active, _)| *active != last.active);
                    earlier.insert(0, (last.active, last.inner));
                    earlier.truncate(KEPT_SETS);
                }
            }
            let rows = vec![0.0; distributor.grasp().num_contacts() * distributor.grasp().force_dim()];
            let active = limited.active.clone();
            workspace.limited = Some(Box::new(LimitedWorkspace { active, inner: fresh, earlier, rows }));
        }
        self.limited = Some(Arc::new(limited));
        Ok(())
    }

    /// The limits that [`Self::set_limits`] was given last; `None` where the grasp's are in force.
    pub fn set_of_limits(&self) -> Option<Vec<f64>> {
        self.limited.as_ref().map(|limited| limited.limits.clone())
    }

    /// The upper bounds of the normal forces that are in force, in N.
    pub fn limits(&self) -> Vec<f64> {
        match &self.limited {
            Some(limited) => limited.limits.clone(),
            None => self.grasp().contacts().iter().map(|contact| contact.max_normal_force).collect(),
        }
    }
}

impl<const D: usize> Limited<D> {
    fn new(of: &ForceDistributor<D>, limits: &[f64]) -> Result<Self> {
        let active: Vec<usize> = (0..limits.len()).filter(|&i| limits[i] > 0.0).collect();
        if active.is_empty() {
            return Ok(Self { limits: limits.to_vec(), active, distributor: None });
        }
        let grasp = of.grasp();
        let contacts: Vec<Contact> =
            active.iter().map(|&i| with_limit(&grasp.contacts()[i], limits[i])).collect();
        // The contacts' friction is already divided by the margin.
        let margin = grasp.options().friction_margin;
        let options = GraspOptions { friction_margin: 1.0, ..*grasp.options() };
        let mut reduced = Grasp::<D>::with_options(&contacts, options)?;
        reduced.set_friction_margin(margin);
        let kept = |values: &[f64]| match values.len() {
            0 | 1 => values.to_vec(),
            _ => active.iter().map(|&i| values[i]).collect(),
        };
        let distributor = if let Some(squares) = of.squares_options() {
            let reference = match squares.reference.len() {
                0 => Vec::new(),
                _ => active.iter().map(|&i| squares.reference[i]).collect(),
            };
            ForceDistributor::squares(
                &reduced,
                SquaresOptions {
                    reference,
                    weights: kept(&squares.weights),
                    min_normal: kept(&squares.min_normal),
                    ..squares.clone()
                },
            )?
        } else {
            let mut options = of.options().clone();
            options.min_normal = kept(&options.min_normal);
            let objective = of.objective().unwrap_or(crate::Criterion::Max);
            ForceDistributor::with_options(&reduced, objective, options)?
        };
        Ok(Self { limits: limits.to_vec(), active, distributor: Some(distributor) })
    }

    fn workspace<'a>(
        &self,
        distributor: &ForceDistributor<D>,
        workspace: &'a mut ForceWorkspace<D>,
    ) -> &'a mut LimitedWorkspace<D> {
        let fresh = || {
            let rows = vec![0.0; distributor.grasp().num_contacts() * distributor.grasp().force_dim()];
            let (active, inner) = (self.active.clone(), distributor.workspace());
            Box::new(LimitedWorkspace { active, inner, earlier: Vec::new(), rows })
        };
        let known = workspace.limited.get_or_insert_with(fresh);
        if known.active != self.active {
            *known = fresh();
        }
        known
    }

    pub(crate) fn solve(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
    ) -> Result<Distribution<D>> {
        let Some(distributor) = &self.distributor else { return self.nothing(external_wrench, None) };
        let inner = &mut self.workspace(distributor, workspace).inner;
        Ok(self.expanded(distributor.solve(inner, external_wrench)?))
    }

    pub(crate) fn nearest(
        &self,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        options: &NearestOptions<D>,
        default: Metric<D>,
    ) -> Result<Distribution<D>> {
        let Some(distributor) = &self.distributor else {
            let metric = options.metric.unwrap_or(default);
            return self.nothing(external_wrench, Some(metric.norm(external_wrench)));
        };
        let inner = &mut self.workspace(distributor, workspace).inner;
        Ok(self.expanded(distributor.nearest(inner, external_wrench, options)?))
    }

    /// Writes forces for an external wrench, or those that come nearest; returns the objective or the distance.
    pub(crate) fn write(
        &self,
        grasp: &Grasp<D>,
        workspace: &mut ForceWorkspace<D>,
        external_wrench: &Wrench<D>,
        nearest: Option<(&NearestOptions<D>, Metric<D>)>,
        forces: &mut [f64],
    ) -> Result<f64> {
        let Some(distributor) = &self.distributor else {
            let distance =
                nearest.map(|(options, default)| options.metric.unwrap_or(default).norm(external_wrench));
            let found = self.nothing(external_wrench, distance)?;
            forces.fill(0.0);
            return Ok(found.distance);
        };
        let LimitedWorkspace { inner, rows, .. } = self.workspace(distributor, workspace);
        let value = match nearest {
            None => distributor.solve_into(inner, external_wrench, rows)?,
            Some((options, _)) => distributor.nearest_into(inner, external_wrench, options, rows)?,
        };
        forces.fill(0.0);
        let (components, known) = (grasp.force_components(), distributor.grasp().force_components());
        for (row, &i) in rows.chunks(known.len()).zip(&self.active) {
            let place = &mut forces[i * components.len()..(i + 1) * components.len()];
            for (x, component) in row.iter().zip(known) {
                if let Some(at) = components.iter().position(|c| c == component) {
                    place[at] = *x;
                }
            }
        }
        Ok(value)
    }

    /// The answer where all contacts are off: `distance` is that of the nearest wrench, zero.
    fn nothing(&self, external_wrench: &Wrench<D>, distance: Option<f64>) -> Result<Distribution<D>> {
        check_wrench(external_wrench)?;
        if external_wrench.amax() > 0.0 && distance.is_none() {
            let direction = unit(&-external_wrench).as_slice().to_vec();
            return Err(Error::InfeasibleWrench { direction, lower_bounds: false });
        }
        let contacts = self.limits.len();
        Ok(Distribution {
            forces: vec![ContactForce::zeros(); contacts],
            shares: vec![0.0; contacts],
            residual: *external_wrench,
            distance: distance.unwrap_or(0.0),
            ..crate::force::distributor::no_forces(contacts, 0.0)
        })
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

impl<const D: usize> LimitedWorkspace<D> {
    pub(crate) fn inner(&self) -> &ForceWorkspace<D> {
        &self.inner
    }

    pub(crate) fn totals(&self, b: &Wrench<D>) -> (f64, f64) {
        self.inner.totals(b)
    }

    pub(crate) fn nearest_totals(&self) -> (f64, f64) {
        self.inner.forces.totals()
    }
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
