//! The furthest place over true cones by Newton's method, from the answers along two directions nearby.
//!
//! At the furthest place each contact slides, sticks or is idle, as in [`crate::force::true_cones::contact_status`]: a
//! share of its limit costs nothing, and the level of the maximum is one. With `v_i = A_i^T z` and the multipliers `-u` of
//! the four equations, `z . w = direction . place(w) + u . equations(w)`: the conditions are linear in u but for the turn of
//! the friction. Whatever u and shares it ends with, the place and the bound of the dual program certify themselves.

use nalgebra::{Matrix2, SVector, Vector4};

use super::HorizontalPoint as Point;
use super::furthest::Furthest;
use super::load::Load;
use crate::force::true_cones::contact_status::{ContactStatus as Status, friction, load};
use crate::force::true_cones::optimality_system::{OptimalitySystem, Unknown};
use crate::grasp::{ContactMap, Grasp};
use crate::tolerances::FEASIBILITY_TOLERANCE;
use crate::wrench_set::Criterion;

/// Steps with one set of statuses, and sets of statuses that are tried.
const MAX_STEPS: usize = 8;
const MAX_CHANGES: usize = 6;

/// An old factor is used again as long as each step reduces what is missing by this much.
const CHORD: f64 = 1e-2;

/// Rounding of balance, conditions and shares, in units of the longest wrench.
const ROUNDED: f64 = 1e-12;

/// A contact whose multiplier turns by less than this may stick, wherever its force lies.
const STICKING_TURN: f64 = 1e-6;

/// A true cone as a standard second-order cone: for the share and each friction component at its coefficient, the four
/// equations and the place of its wrench at the limit.
struct Cone {
    axes: [SVector<f64, 6>; 4],
    dim: usize,
}

#[derive(Debug, Clone, Copy)]
struct Held {
    status: Status,
    /// Share and friction: all of them where the contact sticks, only the share where it slides.
    x: Vector4<f64>,
    v: Vector4<f64>,
    /// Direction and length of the friction part of `v`; a guess right after a contact began to slide.
    turn: Vector4<f64>,
    slope: f64,
    guessed: bool,
}

/// The answer along one direction.
#[derive(Debug, Clone)]
pub(super) struct Optimum {
    u: Vector4<f64>,
    contacts: Vec<Held>,
}

/// A point of the wrench set as the direction that it lies furthest along: multipliers u and horizontal direction.
pub(super) type Along = SVector<f64, 6>;

pub(super) struct Newton {
    cones: Vec<Cone>,
    demand: Vector4<f64>,
    criterion: Criterion,
    size: f64,
    system: OptimalitySystem<4>,
}

impl Newton {
    /// `None` where a contact is no true cone.
    pub(super) fn new(
        grasp: &Grasp<6>,
        maps: &[ContactMap<6>],
        criterion: Criterion,
        load: &Load,
        demand: Vector4<f64>,
    ) -> Option<Self> {
        let mut cones = Vec::with_capacity(maps.len());
        for (i, (contact, map)) in grasp.contacts().iter().zip(maps).enumerate() {
            if grasp.edges(i).is_some() {
                return None;
            }
            let mut cone = Cone { axes: [SVector::zeros(); 4], dim: 0 };
            let coefficients = [1.0, contact.friction, contact.friction, contact.torsion];
            for (component, by) in coefficients.into_iter().enumerate().filter(|(_, by)| *by > 0.0) {
                let wrench = map.column(component) * (contact.max_normal_force * by);
                cone.axes[cone.dim].fixed_rows_mut::<4>(0).copy_from(&load.equations(&wrench));
                cone.axes[cone.dim].fixed_rows_mut::<2>(4).copy_from(&load.place(&wrench));
                cone.dim += 1;
            }
            cones.push(cone);
        }
        let axes = cones.iter().flat_map(|cone| cone.axes.iter());
        let size = 1.0 + axes.map(SVector::norm).fold(0.0, f64::max);
        let system = OptimalitySystem::new(cones.len());
        Some(Self { cones, demand, criterion, size, system })
    }

    /// The furthest place along a direction between two others with known answers; `None` where the steps lead nowhere.
    pub(super) fn between(
        &mut self,
        direction: &Point,
        ends: [(&Point, &Optimum); 2],
        enough: f64,
    ) -> Option<(Furthest, Optimum)> {
        // Multipliers are homogeneous in the direction.
        let parts = Matrix2::from_columns(&[*ends[0].0, *ends[1].0]).try_inverse().map(|to| to * direction);
        let alike = ends[0].1.contacts.iter().zip(&ends[1].1.contacts).all(|(a, b)| a.status == b.status);
        for (end, other) in [(0, 1), (1, 0)] {
            let mut start = ends[end].1.clone();
            if let Some(parts) = parts.filter(|parts| parts.amax() < 2.0) {
                start.u = ends[0].1.u * parts[0] + ends[1].1.u * parts[1];
            }
            if alike {
                for (held, far) in start.contacts.iter_mut().zip(&ends[other].1.contacts) {
                    held.x = (held.x + far.x) * 0.5;
                }
            }
            if let Some(found) = self.reach(direction, start, enough) {
                return Some(found);
            }
            if alike {
                break;
            }
        }
        None
    }

    /// The furthest place from multipliers, and points of the wrench set with their shares, that are nearly optimal.
    pub(super) fn polish(
        &mut self,
        direction: &Point,
        u: Vector4<f64>,
        mixture: impl Iterator<Item = (Along, f64)>,
        enough: f64,
    ) -> Option<(Furthest, Optimum)> {
        let mut forces = vec![Vector4::zeros(); self.cones.len()];
        for (along, share) in mixture {
            let reaches: Vec<(f64, Vector4<f64>)> =
                self.cones.iter().map(|cone| cone.furthest(&along)).collect();
            let most = reaches.iter().map(|one| one.0).fold(0.0, f64::max);
            for (force, (reach, x)) in forces.iter_mut().zip(&reaches) {
                if *reach > 0.0 && (self.criterion == Criterion::Max || *reach >= most) {
                    *force += x * share;
                }
            }
        }
        let z = join(&u, direction);
        let held = |(cone, x): (&Cone, &Vector4<f64>)| {
            let v = cone.conjugate(&z);
            let excess = (v[0] + load(&v)) / self.size;
            let inside = (1.0 - load(x) / x[0].max(f64::MIN_POSITIVE)).max(STICKING_TURN);
            let full = self.criterion == Criterion::Max && excess > 1.0 - x[0];
            let sticks = cone.dim > 1 && inside > load(&v) / self.size;
            let status = match (full, sticks) {
                _ if -excess >= x[0] => Status::Idle,
                (false, false) => Status::Sliding,
                (false, true) => Status::Sticking,
                (true, false) => Status::FullSliding,
                (true, true) => Status::FullSticking,
            };
            Held { status, x: *x, v, turn: Vector4::zeros(), slope: 0.0, guessed: false }
        };
        let contacts = self.cones.iter().zip(&forces).map(held).collect();
        self.reach(direction, Optimum { u, contacts }, enough)
    }

    fn reach(&mut self, direction: &Point, mut at: Optimum, enough: f64) -> Option<(Furthest, Optimum)> {
        for _ in 0..MAX_CHANGES {
            if !self.converge(direction, &mut at) {
                return None;
            }
            if !self.change_statuses(&mut at) {
                return self.certified(direction, at, enough);
            }
        }
        None
    }

    fn converge(&mut self, direction: &Point, at: &mut Optimum) -> bool {
        let mut before = f64::INFINITY;
        for step in 0..=MAX_STEPS {
            let (missing, error) = self.evaluate(direction, at);
            if error <= ROUNDED * self.size {
                return true;
            }
            if !error.is_finite() {
                return false;
            }
            if step == 0 || error > CHORD * before {
                self.linearise(at);
                self.system.factorise(false);
            }
            before = error;
            at.u += self.system.solve(&missing);
            for (unknown, step) in self.system.unknowns.iter().zip(self.system.step()) {
                match *unknown {
                    Unknown::Share { contact } => at.contacts[contact].x[0] += step,
                    Unknown::Coordinate { contact, k } => at.contacts[contact].x[k] += step,
                    Unknown::Level => {}
                }
            }
        }
        false
    }

    /// What the equations miss, and the largest of what they and the conditions on the multipliers do.
    fn evaluate(&mut self, direction: &Point, at: &mut Optimum) -> (Vector4<f64>, f64) {
        let z = join(&at.u, direction);
        let missing = &mut self.system.missing;
        missing.clear();
        let mut balance = self.demand;
        for (cone, held) in self.cones.iter().zip(&mut at.contacts) {
            held.v = cone.conjugate(&z);
            if !std::mem::take(&mut held.guessed) {
                held.slope = load(&held.v);
                held.turn = friction(&held.v) * if held.slope > 0.0 { 1.0 / held.slope } else { 0.0 };
            }
            match held.status {
                Status::Idle => continue,
                Status::Sliding => missing.push(-held.v[0] - held.turn.dot(&held.v)),
                Status::Sticking => missing.extend((0..cone.dim).map(|k| -held.v[k])),
                Status::FullSliding => {}
                Status::FullSticking => missing.extend((1..cone.dim).map(|k| -held.v[k])),
            }
            let x = held.force();
            for (k, axis) in cone.axes.iter().enumerate() {
                balance -= axis.fixed_rows::<4>(0) * x[k];
            }
        }
        let error = missing.iter().fold(balance.amax(), |most: f64, x| most.max(x.abs()));
        (balance, if error.is_nan() || balance.iter().any(|x| x.is_nan()) { f64::INFINITY } else { error })
    }

    fn linearise(&mut self, at: &Optimum) {
        let system = &mut self.system;
        system.clear();
        for (contact, (cone, held)) in self.cones.iter().zip(&at.contacts).enumerate() {
            let rows = |k: usize| cone.axes[k].fixed_rows::<4>(0).into_owned();
            let turned = |t: &Vector4<f64>| rows(1) * t[1] + rows(2) * t[2] + rows(3) * t[3];
            match held.status {
                Status::Sliding => {
                    system.push(Unknown::Share { contact }, rows(0) + turned(&held.turn));
                }
                Status::Sticking => {
                    (0..cone.dim).for_each(|k| system.push(Unknown::Coordinate { contact, k }, rows(k)));
                }
                Status::FullSticking => {
                    (1..cone.dim).for_each(|k| system.push(Unknown::Coordinate { contact, k }, rows(k)));
                }
                Status::Idle | Status::FullSliding => {}
            }
            let share = match held.status {
                Status::Sliding => held.x[0],
                Status::FullSliding => 1.0,
                _ => 0.0,
            };
            if cone.dim > 2 && share > 0.0 {
                let size = (share / held.slope.max(f64::MIN_POSITIVE)).sqrt();
                if cone.dim == 3 {
                    system.bend(turned(&Vector4::new(0.0, -held.turn[2], held.turn[1], 0.0)) * size);
                } else {
                    for t in &two_across(&held.turn) {
                        system.bend(turned(t) * size);
                    }
                }
            }
        }
    }

    /// Gives contacts that violate their status the one that they ask for; false if none does.
    fn change_statuses(&self, at: &mut Optimum) -> bool {
        let (small, flat) = (ROUNDED, ROUNDED * self.size * (1.0 + at.u.amax()));
        let each = self.criterion == Criterion::Max;
        let mut changed = false;
        for (cone, held) in self.cones.iter().zip(&mut at.contacts) {
            let x = held.force();
            let (reach, beyond) = (held.v[0] + load(&held.v), load(&x) - x[0]);
            let above = each && x[0] > 1.0 + small;
            let (status, slope) = match held.status {
                Status::Idle if reach > flat && cone.dim > 1 && load(&held.v) <= flat => {
                    (Status::Sticking, 0.0)
                }
                Status::Idle if reach > flat => (Status::Sliding, 0.0),
                Status::Sliding if x[0] < -small => (Status::Idle, 0.0),
                Status::Sliding if above => (Status::FullSliding, 0.0),
                Status::Sticking if x[0] < -load(&x) - small => (Status::Idle, 0.0),
                Status::Sticking if beyond > small => {
                    held.x[0] = f64::midpoint(x[0], load(&x));
                    let full = each && held.x[0] > 1.0;
                    (if full { Status::FullSliding } else { Status::Sliding }, 0.5 * beyond * self.size)
                }
                Status::Sticking if above => (Status::FullSticking, 0.0),
                Status::FullSliding if reach < -flat => (Status::Sliding, 0.0),
                Status::FullSticking if held.v[0] < -flat => (Status::Sticking, 0.0),
                Status::FullSticking if beyond > small => (Status::FullSliding, 0.5 * beyond * self.size),
                Status::Sliding if cone.dim > 1 && held.slope <= flat => (Status::Sticking, 0.0),
                Status::FullSliding if cone.dim > 1 && held.slope <= flat => (Status::FullSticking, 0.0),
                _ => continue,
            };
            let share = if held.status == Status::Sticking { held.x[0] } else { x[0] };
            (held.status, held.x) = (status, Vector4::new(share, x[1], x[2], x[3]));
            if slope > 0.0 && load(&x) > 0.0 {
                (held.turn, held.slope, held.guessed) = (friction(&x) / load(&x), slope, true);
            }
            changed = true;
        }
        changed
    }

    /// Place and bound of forces within their limits, if they are as near to each other as is enough.
    fn certified(&self, direction: &Point, at: Optimum, enough: f64) -> Option<(Furthest, Optimum)> {
        let (mut place, mut reached, mut shares) = (Point::zeros(), 0.0_f64, 0.0);
        let mut unbalanced = self.demand;
        let each = self.criterion == Criterion::Max;
        for (cone, held) in self.cones.iter().zip(&at.contacts) {
            let x = held.force();
            if x[0] < load(&x) - 2.0 * ROUNDED || (each && x[0] > 1.0 + 2.0 * ROUNDED) {
                return None;
            }
            shares += x[0];
            let reach = (held.v[0] + load(&held.v)).max(0.0);
            reached = if each { reached + reach } else { reached.max(reach) };
            for (k, axis) in cone.axes.iter().enumerate() {
                place += axis.fixed_rows::<2>(4) * x[k];
                unbalanced -= axis.fixed_rows::<4>(0) * x[k];
            }
        }
        if unbalanced.amax() > FEASIBILITY_TOLERANCE {
            return None;
        }
        let bound = reached - at.u.dot(&self.demand);
        let gap = bound - direction.dot(&place);
        let limited = each || shares <= 1.0 + 2.0 * ROUNDED;
        let bound = bound.max(direction.dot(&place));
        (limited && gap.abs() <= enough).then_some((Furthest { place, bound, reached }, at))
    }
}

impl Cone {
    /// `A^T z`.
    #[inline]
    fn conjugate(&self, z: &Along) -> Vector4<f64> {
        Vector4::from_fn(|k, _| self.axes[k].dot(z))
    }

    /// How far the cone reaches, and by which force.
    fn furthest(&self, z: &Along) -> (f64, Vector4<f64>) {
        let v = self.conjugate(z);
        let slope = load(&v);
        let mut x = friction(&v) * if slope > 0.0 { 1.0 / slope } else { 0.0 };
        x[0] = 1.0;
        (v[0] + slope, x)
    }
}

impl Held {
    fn force(&self) -> Vector4<f64> {
        let Self { status, x, turn, .. } = self;
        match status {
            Status::Idle => Vector4::zeros(),
            Status::Sliding => Vector4::new(x[0], x[0] * turn[1], x[0] * turn[2], x[0] * turn[3]),
            Status::Sticking => *x,
            Status::FullSliding => Vector4::new(1.0, turn[1], turn[2], turn[3]),
            Status::FullSticking => Vector4::new(1.0, x[1], x[2], x[3]),
        }
    }
}

/// Multipliers and direction as one vector.
pub(super) fn join(u: &Vector4<f64>, direction: &Point) -> Along {
    Along::new(u[0], u[1], u[2], u[3], direction.x, direction.y)
}

/// Two unit vectors of friction across a third.
fn two_across(turn: &Vector4<f64>) -> [Vector4<f64>; 2] {
    let u = nalgebra::Vector3::new(turn[1], turn[2], turn[3]);
    let first = u.cross(&nalgebra::Vector3::ith(u.iamin(), 1.0)).normalize();
    let second = u.cross(&first);
    [first, second].map(|t| Vector4::new(0.0, t[0], t[1], t[2]))
}
