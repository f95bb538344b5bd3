//! What a body demands of its contacts, in coordinates where the demand is easy to state.
//!
//! With the mass `m = weight / g`, the centre of mass `c` and its acceleration `a`, the contacts must exert the wrench
//! `-w_ext(c)` with the force `F = -weight e_z - m a` at c:
//!
//! `w_ext(c) = [F, (c - origin) x F] + w_extra`.
//!
//! It is affine in the horizontal position of c. Forces count in units of `|F|`, lengths in units of the contacts' extent
//! about their mean. There the wrench `w = [f, tau]` of the contacts must fulfil four equations that c has no part in,
//! `f = -F - f_extra` and `tau . F = -tau_extra . F`, and places the centre of mass at
//!
//! `x = (tau_y + tau_extra_y + z F_x) / F_z`, `y = (z F_y - tau_x - tau_extra_x) / F_z`.

use nalgebra::{Vector2, Vector3, Vector4};

use super::HorizontalPoint as Point;
use super::SupportOptions;
use crate::error::{Error, Result, digits};
use crate::grasp::wrench::{contact_map, with_torque};
use crate::grasp::{ContactMap, Grasp, Wrench, unit};

/// Below this share of the whole force, what presses down is rounding: the centre of mass could be anywhere.
const NO_WEIGHT: f64 = 1e-9;

/// Contacts nearer to each other than this share of their coordinates are in one place, but for rounding.
const ONE_PLACE: f64 = 4.0 * f64::EPSILON;

/// The load of a body in the scaled coordinates.
#[derive(Debug, Clone)]
pub(super) struct Load {
    center: Vector3<f64>,
    origin: Vector3<f64>,
    /// The unit of lengths in m.
    pub(super) length: f64,
    /// The unit of forces in N.
    pub(super) force: f64,
    /// Unit vector along the force that acts at the centre of mass.
    down: Vector3<f64>,
    /// The right-hand sides of the four equations.
    pub(super) demand: Vector4<f64>,
    offset: Point,
}

impl Load {
    /// The load on the contacts of a grasp, or what is wrong with the options.
    pub(super) fn new(grasp: &Grasp<6>, options: &SupportOptions) -> Result<Self> {
        options.check()?;
        let mass = options.weight / options.gravity;
        let down = -Vector3::z() * options.weight - options.acceleration * mass;
        let force = down.norm();
        if down.z.abs() <= NO_WEIGHT * force.max(options.weight) {
            let [x, y, z] = options.acceleration.into();
            let reason = format!(
                "[{}, {}, {}] takes all weight off the contacts: no region is bounded; keep its vertical component away \
                 from {}",
                digits(x),
                digits(y),
                digits(z),
                digits(-options.gravity)
            );
            return Err(Error::input("acceleration", reason));
        }
        let contacts = grasp.contacts();
        let center = contacts.iter().map(|c| c.position / contacts.len() as f64).sum::<Vector3<f64>>();
        let extent = contacts.iter().map(|c| (c.position - center).norm().max(c.torsion)).fold(0.0, f64::max);
        let rounded = ONE_PLACE * contacts.iter().map(|c| c.position.amax()).fold(0.0, f64::max);
        let length = if extent > rounded { extent } else { 1.0 };
        let down = down / force;
        let origin = grasp.options().origin;
        let extra_force: Vector3<f64> = options.external_wrench.fixed_rows::<3>(0).into_owned();
        let extra_torque: Vector3<f64> = options.external_wrench.fixed_rows::<3>(3).into_owned();
        let extra_torque = (extra_torque - (center - origin).cross(&extra_force)) / (force * length);
        let balance = -down - extra_force / force;
        let demand = Vector4::new(balance.x, balance.y, balance.z, -extra_torque.dot(&down));
        let height = (options.height - center.z) / length;
        let offset =
            Vector2::new(height * down.x + extra_torque.y, height * down.y - extra_torque.x) / down.z;
        if !demand.iter().chain(offset.iter()).all(|x| x.is_finite()) {
            return Err(Error::input("external_wrench", "too large beside the weight to compute with"));
        }
        Ok(Self { center, origin, length, force, down, demand, offset })
    }

    /// The map from the forces of each contact to the scaled wrenches.
    pub(super) fn maps(&self, grasp: &Grasp<6>) -> Vec<ContactMap<6>> {
        let contacts = grasp.contacts().iter().zip(grasp.frames());
        let map = |(contact, frame): (&crate::Contact, &nalgebra::Matrix3<f64>)| {
            let mut map = contact_map::<6>(&((contact.position - self.center) / self.length), frame);
            let torsion = map.column(3) / self.length;
            map.set_column(3, &torsion);
            map / self.force
        };
        contacts.map(map).collect()
    }

    /// The left-hand sides of the four equations.
    pub(super) fn equations(&self, wrench: &Wrench<6>) -> Vector4<f64> {
        let torque = Vector3::new(wrench[3], wrench[4], wrench[5]);
        Vector4::new(wrench[0], wrench[1], wrench[2], torque.dot(&self.down))
    }

    /// Where a wrench places the centre of mass, but for a constant.
    pub(super) fn place(&self, wrench: &Wrench<6>) -> Point {
        Vector2::new(wrench[4], -wrench[3]) / self.down.z
    }

    /// The direction z of wrenches with `z . w = direction . place(w) - multipliers . equations(w)`.
    pub(super) fn covector(&self, direction: &Point, multipliers: &Vector4<f64>) -> Wrench<6> {
        let along = Vector3::new(-direction.y, direction.x, 0.0) / self.down.z;
        with_torque(&-multipliers.fixed_rows::<3>(0), &(along - self.down * multipliers[3]))
    }

    /// A place in world coordinates, in m.
    pub(super) fn world(&self, place: &Point) -> Point {
        self.center.xy() + (place + self.offset) * self.length
    }

    /// A direction of scaled wrenches as one of wrenches in N and N m about the grasp's origin, of unit length.
    pub(super) fn physical(&self, z: &Wrench<6>) -> Wrench<6> {
        let torque = Vector3::new(z[3], z[4], z[5]) / self.length;
        let force = Vector3::new(z[0], z[1], z[2]) - torque.cross(&(self.center - self.origin));
        unit(&with_torque(&force, &torque))
    }
}
