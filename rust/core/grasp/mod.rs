//! A grasp: contacts, grasp matrix, extreme forces and primitive wrenches (Eqs. 3 and 8).
//!
//! `Grasp<3>` is planar with wrenches `[fx, fy, tau]`, `Grasp<6>` spatial with `[f, tau]`; wrenches are
//! physical, in N and N m about the torque origin. A grasp is immutable: whatever is derived from it stays
//! valid.
//!
//! | file | holds |
//! |---|---|
//! | [`contact`] | a contact, its frame and its extreme forces (Eq. 3) |
//! | [`wrench`] | wrenches, and the map from contact forces to them (Eq. 8) |
//! | [`exact_map`] | that map in 32 digits |
//! | [`derivative`] | how it changes as a contact moves |
//! | [`wrench_norm`] | the norm of wrenches in which quality is measured |
//! | [`wrench_rounding`] | what rounding may have done to wrenches |
//! | [`torque_limits`] | extreme forces that joint torques allow |
//! | [`plausibility`] | contacts that look like mistakes |

pub(crate) mod contact;
pub(crate) mod derivative;
pub(crate) mod exact_map;
pub(crate) mod plausibility;
pub(crate) mod torque_limits;
pub(crate) mod wrench;
pub(crate) mod wrench_norm;
pub(crate) mod wrench_rounding;

pub use wrench::{ContactMap, Wrench, wrench_of_force};
pub(crate) use wrench::{REPRESENTABLE, contact_map, length, unit};

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result, digits};
use crate::grasp::contact::{Contact, ContactForce, ForceModel, MAX_EXTREME_FORCES, force_components};
use crate::memory::{check_room, room};

/// What a grasp is measured about and with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspOptions {
    /// Point about which torques are taken, in m.
    pub origin: Vector3<f64>,
    /// Length `L` in m that makes torques comparable with forces: `|w|^2 = |f|^2 + |tau|^2 / L^2`.
    pub length_scale: f64,
    /// Factor >= 1 that divides every friction coefficient, so that least forces keep a distance from slip.
    pub friction_margin: f64,
}

impl Default for GraspOptions {
    fn default() -> Self {
        Self { origin: Vector3::zeros(), length_scale: 1.0, friction_margin: 1.0 }
    }
}

/// Products of four smaller coefficients could not be represented.
const LEAST_COEFFICIENT: f64 = 1e-60;

impl GraspOptions {
    /// Refuses what is not finite, not positive, or a margin below 1.
    pub fn check(&self) -> Result<()> {
        let (scale, margin) = (self.length_scale, self.friction_margin);
        let wrong = |argument, reason: String| Err(Error::grasp(argument, reason));
        if self.origin.iter().any(|x| !x.is_finite()) {
            return wrong("origin", format!("{:?} is not finite", self.origin.as_slice()));
        }
        if !(scale > 0.0 && scale.is_finite()) {
            return wrong("length_scale", format!("{} must be finite and positive", digits(scale)));
        }
        if !REPRESENTABLE.contains(&scale) {
            return wrong("length_scale", format!("{scale:e} lies outside 1e-140 to 1e140; check the units"));
        }
        if !(margin >= 1.0 && margin.is_finite()) {
            return wrong("friction_margin", format!("{} must be finite and at least 1", digits(margin)));
        }
        Ok(())
    }
}

/// Contacts on an object, checked, with everything derived from them.
///
/// ```
/// use graspforce::{Contact, Grasp};
/// use nalgebra::Vector3;
///
/// // Two fingers squeeze a disc of radius 1 from left and right.
/// let fingers = [(-1.0, 1.0), (1.0, -1.0)]
///     .map(|(x, n)| Contact::new(Vector3::new(x, 0.0, 0.0), Vector3::new(n, 0.0, 0.0)));
/// let grasp = Grasp::<3>::new(&fingers)?;
/// assert_eq!(grasp.primitive_wrenches()?.len(), 4);
/// # Ok::<(), graspforce::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Grasp<const D: usize> {
    contacts: Vec<Contact>,
    frames: Vec<Matrix3<f64>>,
    given_normals: GivenNormals,
    maps: Vec<ContactMap<D>>,
    edges: Vec<Option<Range<usize>>>,
    /// Shared with the wrench sets of the grasp.
    extreme_forces: Arc<Vec<ContactForce>>,
    primitive_wrenches: Vec<Wrench<D>>,
    options: GraspOptions,
    force_dim: usize,
}

impl<const D: usize> Grasp<D> {
    /// A grasp about the origin with length scale 1 m.
    pub fn new(contacts: &[Contact]) -> Result<Self> {
        Self::with_options(contacts, GraspOptions::default())
    }

    /// A grasp with its torque origin, length scale and friction margin.
    pub fn with_options(contacts: &[Contact], options: GraspOptions) -> Result<Self> {
        const { assert!(D == 3 || D == 6, "wrenches have 3 (planar) or 6 (spatial) components") };
        options.check()?;
        if contacts.is_empty() {
            return Err(Error::grasp("positions", "a grasp needs at least one contact"));
        }
        let planar = D == 3;
        let count = contacts.len();
        let counts = contacts.iter().map(|contact| contact.force_count(planar).min(MAX_EXTREME_FORCES));
        let forces = counts.fold(0, |sum: usize, count| sum.saturating_add(count).min(MAX_EXTREME_FORCES));
        let mut extreme_forces = room("edges", forces)?;
        let mut grasp = Self {
            contacts: room("positions", count)?,
            frames: room("positions", count)?,
            given_normals: GivenNormals(room("positions", count)?),
            maps: room("positions", count)?,
            edges: room("positions", count)?,
            extreme_forces: Arc::default(),
            primitive_wrenches: room("edges", forces)?,
            options,
            force_dim: if planar { 2 } else { 3 + usize::from(contacts.iter().any(has_torsion)) },
        };
        // Those that the caller gave are copied with their contacts.
        let given = contacts.iter().map(|contact| match &contact.forces {
            ForceModel::Extreme(forces) => forces.len(),
            _ => 0,
        });
        check_room("edges", 2 * given.sum::<usize>(), size_of::<ContactForce>())?;
        for (index, contact) in contacts.iter().enumerate() {
            grasp.push(index, contact, planar, &mut extreme_forces)?;
        }
        *Arc::make_mut(&mut grasp.extreme_forces) = extreme_forces;
        Ok(grasp)
    }

    fn push(
        &mut self,
        index: usize,
        contact: &Contact,
        planar: bool,
        extreme_forces: &mut Vec<ContactForce>,
    ) -> Result<()> {
        if planar && has_torsion(contact) {
            return Err(Error::contact("torsion", index, "a planar contact exerts no torsion"));
        }
        let frame = contact.frame(index, planar)?;
        let lever = contact.position - self.options.origin;
        let map = contact_map::<D>(&lever, &frame);
        let mut contact = contact.clone();
        let given_normal = contact.normal;
        contact.normal = frame.column(0).into();
        contact.friction /= self.options.friction_margin;
        contact.torsion /= self.options.friction_margin;
        let start = extreme_forces.len();
        let finite = contact.list_extreme_forces(index, planar, extreme_forces)?;
        self.primitive_wrenches.extend(extreme_forces[start..].iter().map(|force| map * force));
        self.edges.push(finite.then_some(start..extreme_forces.len()));
        // Squares of wrenches must be representable, or no norm of them is: also of a unit normal force.
        let arm = map.amax();
        for (argument, coefficient) in [("friction", contact.friction), ("torsion", contact.torsion)] {
            if REPRESENTABLE.contains(&arm) && arm * coefficient >= REPRESENTABLE.end {
                let reason =
                    format!("{coefficient:e} times the arm {arm:e} must lie below 1e140; check the units");
                return Err(Error::contact(argument, index, reason));
            }
            if coefficient > 0.0 && coefficient < LEAST_COEFFICIENT {
                let reason = format!("{coefficient:e} must be zero, or at least {LEAST_COEFFICIENT:e}");
                return Err(Error::contact(argument, index, reason));
            }
        }
        let reach = match contact.forces {
            ForceModel::Extreme(_) => 0.0,
            _ => arm * contact.max_normal_force * contact.friction.max(contact.torsion).max(1.0),
        };
        let largest = self.primitive_wrenches[start..].iter().map(Wrench::amax).fold(reach, f64::max);
        let finite = self.primitive_wrenches[start..].iter().flatten().all(|x| x.is_finite());
        let limit = contact.max_normal_force;
        if !REPRESENTABLE.contains(&limit) {
            let reason = format!("{limit:e}: limits must be between 1e-140 and 1e140; check the units");
            return Err(Error::contact("max_normal_force", index, reason));
        }
        if !finite || ![arm, largest].iter().all(|size| REPRESENTABLE.contains(size)) {
            let reason = format!(
                "its wrenches reach {largest:e} with arms of {arm:e}: both must lie within 1e-140 to 1e140; check the units"
            );
            return Err(Error::contact("positions", index, reason));
        }
        self.given_normals.0.push(given_normal);
        self.contacts.push(contact);
        self.frames.push(frame);
        self.maps.push(map);
        Ok(())
    }

    /// Number of contacts `m`.
    pub fn num_contacts(&self) -> usize {
        self.contacts.len()
    }

    /// The contacts, with unit normals and the friction margin already applied.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Contact frames with columns `n`, `o`, `t`.
    pub fn frames(&self) -> &[Matrix3<f64>] {
        &self.frames
    }

    /// The normals before they were made unit vectors of 16 digits.
    pub(crate) fn given_normals(&self) -> &[Vector3<f64>] {
        &self.given_normals.0
    }

    /// The maps `G_i`, whose columns side by side are the grasp matrix.
    pub fn maps(&self) -> &[ContactMap<D>] {
        &self.maps
    }

    /// Torque origin, length scale and friction margin.
    pub fn options(&self) -> &GraspOptions {
        &self.options
    }

    /// Says that the contacts' friction was already divided by `margin`.
    pub(crate) fn set_friction_margin(&mut self, margin: f64) {
        self.options.friction_margin = margin;
    }

    /// Components `k` of a contact force as callers see it: 2 (planar), 3 (hard) or 4 (soft fingers).
    pub fn force_dim(&self) -> usize {
        self.force_dim
    }

    /// Which rows of `[f_n, f_o, f_t, torsion]` the `k` components are.
    pub fn force_components(&self) -> &'static [usize] {
        force_components(self.force_dim)
    }

    /// Whether every contact has finitely many extreme forces.
    pub fn is_finite(&self) -> bool {
        self.edges.iter().all(Option::is_some)
    }

    /// Where contact `i`'s extreme forces lie in [`Self::extreme_forces`]; `None` for a true cone.
    pub fn edges(&self, contact: usize) -> Option<Range<usize>> {
        self.edges[contact].clone()
    }

    /// All extreme forces `s_ih` (Eq. 3), contact by contact.
    pub fn extreme_forces(&self) -> Result<&[ContactForce]> {
        self.require_finite("extreme_forces")?;
        Ok(&self.extreme_forces)
    }

    /// All primitive wrenches `w_ih = G_i s_ih` (Eq. 8), contact by contact.
    pub fn primitive_wrenches(&self) -> Result<&[Wrench<D>]> {
        self.require_finite("primitive_wrenches")?;
        Ok(&self.primitive_wrenches)
    }

    /// The wrenches of the contacts that have finitely many extreme forces.
    pub(crate) fn finite_wrenches(&self) -> &[Wrench<D>] {
        &self.primitive_wrenches
    }

    /// The extreme forces of those contacts, beside [`Self::finite_wrenches`].
    pub(crate) fn finite_forces(&self) -> &[ContactForce] {
        &self.extreme_forces
    }

    /// The same, to be kept.
    pub(crate) fn shared_forces(&self) -> &Arc<Vec<ContactForce>> {
        &self.extreme_forces
    }

    pub(crate) fn require_finite(&self, what: &'static str) -> Result<()> {
        match self.edges.iter().position(Option::is_none) {
            None => Ok(()),
            Some(contact) => {
                let reason = format!("the true cone has no finite set, so no {what}; give a number of edges");
                Err(Error::contact("edges", contact, reason))
            }
        }
    }
}

/// Normals as they were given. Grasps whose unit normals are the same are equal, whatever these are.
#[derive(Debug, Clone)]
struct GivenNormals(Vec<Vector3<f64>>);

impl PartialEq for GivenNormals {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

fn has_torsion(contact: &Contact) -> bool {
    match &contact.forces {
        ForceModel::Extreme(forces) => forces.iter().any(|f| f[3] != 0.0),
        _ => contact.torsion != 0.0,
    }
}
