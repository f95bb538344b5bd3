//! A point of the optimality conditions: multiplier, level and forces, with the status of each contact, and what the
//! conditions miss there.

use nalgebra::{SVector, Vector4};

use crate::force::simplex::pricing::Objective;
use crate::force::true_cones::contact_status::{ContactStatus, StandardCone, friction, load};
use crate::force::true_cones::optimality_system::{OptimalitySystem, Unknown};

/// One contact at the point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactPoint {
    pub(crate) status: ContactStatus,
    /// Share and friction: all of them where the contact sticks, only the share where it slides.
    pub(crate) x: Vector4<f64>,
    /// `A^T z` of the last evaluation.
    pub(crate) v: Vector4<f64>,
    /// The direction of friction of a contact that slides.
    pub(crate) direction: Vector4<f64>,
    /// The length of the friction part of `v`. Right after a contact began to slide it is a guess.
    pub(crate) slope: f64,
    /// Whether direction and slope are a guess that the next evaluation has to take.
    pub(crate) guessed: bool,
}

/// The point, scaled with the wrench.
#[derive(Debug, Clone)]
pub(crate) struct OptimalPoint<const D: usize> {
    pub(crate) z: SVector<f64, D>,
    /// The maximum of the shares, where the objective bounds them.
    pub(crate) level: f64,
    pub(crate) contacts: Vec<ContactPoint>,
}

/// Cones and prices of the program.
#[derive(Debug, Clone)]
pub(crate) struct ConeConditions<const D: usize> {
    pub(crate) cones: Vec<StandardCone<D>>,
    /// What the objective charges for a share.
    pub(crate) price: f64,
    /// Whether it charges for the maximum of the shares.
    pub(crate) bounded: bool,
    /// Whether the least sum breaks ties.
    pub(crate) least_sum: bool,
}

/// What the conditions miss, relative to what rounding explains: at most one where they are satisfied.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Missing<const D: usize> {
    pub(crate) balance: SVector<f64, D>,
    pub(crate) error: f64,
}

impl<const D: usize> OptimalPoint<D> {
    pub(crate) fn new(contacts: usize) -> Self {
        let contact = ContactPoint {
            status: ContactStatus::Idle,
            x: Vector4::zeros(),
            v: Vector4::zeros(),
            direction: Vector4::zeros(),
            slope: 0.0,
            guessed: false,
        };
        Self { z: SVector::zeros(), level: 0.0, contacts: vec![contact; contacts] }
    }

    /// The normalised force of a contact.
    pub(crate) fn force(&self, contact: usize) -> Vector4<f64> {
        let ContactPoint { status, x, direction, .. } = &self.contacts[contact];
        let share = |n: f64| Vector4::new(n, n * direction[1], n * direction[2], n * direction[3]);
        match status {
            ContactStatus::Idle => Vector4::zeros(),
            ContactStatus::Sliding => share(x[0]),
            ContactStatus::Sticking => *x,
            ContactStatus::FullSliding => share(self.level),
            ContactStatus::FullSticking => Vector4::new(self.level, x[1], x[2], x[3]),
        }
    }

    /// Adds steps of the unknowns.
    pub(crate) fn advance(&mut self, unknowns: &[Unknown], step: &[f64], size: f64) {
        for (unknown, step) in unknowns.iter().zip(step) {
            match *unknown {
                Unknown::Level => self.level += size * step,
                Unknown::Share { contact } => self.contacts[contact].x[0] += size * step,
                Unknown::Coordinate { contact, k } => self.contacts[contact].x[k] += size * step,
            }
        }
    }
}

/// What rounding leaves of balance and conditions, relative to their terms.
const ROUNDED_CONDITIONS: f64 = 2e-14;

impl<const D: usize> ConeConditions<D> {
    pub(crate) fn new(cones: Vec<StandardCone<D>>, objective: Objective) -> Self {
        Self {
            cones,
            price: if objective == Objective::Sum { 1.0 } else { objective.weight() },
            bounded: objective != Objective::Sum,
            least_sum: objective == Objective::MaxThenSum,
        }
    }

    /// Evaluates the contacts at `z`, and what is missing for a wrench of unit size.
    pub(crate) fn evaluate(
        &self,
        point: &mut OptimalPoint<D>,
        target: &SVector<f64, D>,
        missing: &mut Vec<f64>,
    ) -> Missing<D> {
        missing.clear();
        let mut balance = *target;
        let (mut lifted, mut terms) = (0.0, 1.0);
        let OptimalPoint { z, level, contacts } = point;
        for (cone, contact) in self.cones.iter().zip(contacts.iter_mut()) {
            let v = cone.conjugate(z);
            contact.v = v;
            if contact.guessed {
                contact.guessed = false;
            } else {
                contact.slope = load(&v);
                let inverse = if contact.slope > 0.0 { 1.0 / contact.slope } else { 0.0 };
                contact.direction = friction(&v) * inverse;
            }
            let (mut x, reach) = match contact.status {
                ContactStatus::Idle => continue,
                ContactStatus::Sliding | ContactStatus::FullSliding => {
                    (contact.direction, v[0] + contact.direction.dot(&v))
                }
                ContactStatus::Sticking | ContactStatus::FullSticking => (contact.x, v[0]),
            };
            match contact.status {
                ContactStatus::Sliding => {
                    x *= contact.x[0];
                    x[0] = contact.x[0];
                    missing.push(self.price - reach);
                }
                ContactStatus::Sticking => {
                    missing.push(self.price - v[0]);
                    missing.extend((1..cone.dim).map(|k| -v[k]));
                }
                ContactStatus::FullSliding => {
                    x *= *level;
                    x[0] = *level;
                    lifted += reach - self.price;
                }
                ContactStatus::FullSticking => {
                    x[0] = *level;
                    lifted += reach - self.price;
                    missing.extend((1..cone.dim).map(|k| -v[k]));
                }
                ContactStatus::Idle => {}
            }
            terms += x.amax();
            balance -= cone.wrench(&x);
        }
        if self.bounded {
            missing.push(1.0 - lifted);
        }
        let condition = missing.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let error = (balance.amax() / terms).max(condition / (1.0 + z.lp_norm(1)));
        Missing { balance, error: if error.is_nan() { f64::INFINITY } else { error / ROUNDED_CONDITIONS } }
    }

    /// Writes down the columns and the curvature of the conditions at the point of the last evaluation.
    pub(crate) fn linearise(&self, point: &OptimalPoint<D>, system: &mut OptimalitySystem<D>) {
        system.clear();
        let mut full = SVector::zeros();
        for (contact, (cone, at)) in self.cones.iter().zip(&point.contacts).enumerate() {
            let slides = || cone.axes[0] + cone.wrench(&at.direction);
            match at.status {
                ContactStatus::Idle => {}
                ContactStatus::Sliding => {
                    system.push(Unknown::Share { contact }, slides());
                    bend(cone, at, at.x[0], system);
                }
                ContactStatus::Sticking => {
                    for k in 0..cone.dim {
                        system.push(Unknown::Coordinate { contact, k }, cone.axes[k]);
                    }
                }
                ContactStatus::FullSliding => {
                    full += slides();
                    bend(cone, at, point.level, system);
                }
                ContactStatus::FullSticking => {
                    full += cone.axes[0];
                    for k in 1..cone.dim {
                        system.push(Unknown::Coordinate { contact, k }, cone.axes[k]);
                    }
                }
            }
        }
        if self.bounded {
            system.push(Unknown::Level, full);
        }
    }
}

/// How the friction of a contact that slides turns with the multiplier.
fn bend<const D: usize>(
    cone: &StandardCone<D>,
    at: &ContactPoint,
    share: f64,
    system: &mut OptimalitySystem<D>,
) {
    if cone.dim < 3 || share <= 0.0 {
        return;
    }
    let size = (share / at.slope.max(f64::MIN_POSITIVE)).sqrt();
    let u = &at.direction;
    if cone.dim == 3 {
        system.bend(cone.axes[1] * (-u[2] * size) + cone.axes[2] * (u[1] * size));
        return;
    }
    // Two directions across `u`, from the reflection that takes the third axis to it.
    let sign = if u[3] < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = (-1.0 / (sign + u[3]), -u[1] * u[2] / (sign + u[3]));
    let first = [1.0 + sign * u[1] * u[1] * a, sign * b, -sign * u[1]];
    let second = [b, sign + u[2] * u[2] * a, -u[2]];
    for t in [first, second] {
        let across = cone.axes[1] * t[0] + cone.axes[2] * t[1] + cone.axes[3] * t[2];
        system.bend(across * size);
    }
}
